"""A Python function served as a program under test, with one answer per request (docs/protocol.md, version 2).

`rayproof run --subject python:FILE.py:FUNCTION` starts `serve` in a separate process; `rayproof.run(cases, function)`
calls `answered` in the caller's process.
"""

import importlib.util
import json
import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rayproof.cases.scene import Scene
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.api.asking import answers_from, image_stages
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.images import write_answers
from rayproof.reports.subjects.protocol import STAYS

Renderer = Callable[[Scene, Sequence[Stage]], Mapping[str, Any] | Any]
MODULE = "rayproof_function_under_test"  # an unusual name: no module next to the user's file has it by chance


def answered(renderer: Renderer, request: Mapping[str, Any], stages: Sequence[str] | None = None) -> dict[str, Any]:
    """Answer a request: call the function and write its images; its exceptions become error answers.

    `stages` are the stages that the function must return; by default it may return any of them.

    Raises:
        ValueError: there is no such image stage.

    """
    wanted = tuple(IMAGE_STAGES if stages is None else image_stages(stages))
    number = request["id"]
    if "capabilities" in request:
        return {"id": number, "capabilities": _declared(renderer, None if stages is None else wanted)}
    try:
        scene = load_scene(request["scene"])
        requested = tuple(stage for stage in stages_of(scene) if stage in wanted)
        answers = answers_from(renderer(scene, requested), scene, requested)
        missing = [stage.value for stage in requested if stage not in answers]
        if missing and (stages is not None or not answers):
            raise ValueError(f"it gave no {', '.join(missing)}")
        write_answers(Path(request["output"]), answers, len(scene.lights))
    except NotImplementedError as reason:
        return {"id": number, "unsupported": " ".join(str(reason).split()) or "it says so"}
    except Exception as error:  # boundary to foreign code: any exception of a renderer is an error of its case
        return _failure(number, error, _folder(renderer))
    return {"id": number, "ok": True}


def _declared(renderer: Renderer, stages: Sequence[Stage] | None) -> dict[str, Any]:
    """Return the function's capabilities, with the keys of docs/protocol.md."""
    name = getattr(renderer, "__qualname__", type(renderer).__name__)
    capabilities: dict[str, Any] = {"protocol": STAYS, "name": str(name)[:80], "version": "", "precision": "float64"}
    if stages is not None:
        capabilities["stages"] = [stage.value for stage in stages]
    if getattr(renderer, "deterministic", False) is True:
        capabilities["deterministic"] = True
    return capabilities


def _folder(renderer: Renderer) -> Path | None:
    """Return the folder of the function's file, or None if it has no code object."""
    code = getattr(renderer, "__code__", None) or getattr(getattr(type(renderer), "__call__", None), "__code__", None)  # noqa: B004
    return None if code is None else Path(code.co_filename).parent


def _failure(number: int, error: BaseException, folder: Path | None) -> dict[str, Any]:
    """Return the answer to a failed request; its `trace`, the traceback, is for standard error."""
    trace = "".join(traceback.format_exception(error))
    return {"id": number, "error": raised(error, folder), "trace": trace}


def raised(error: BaseException, folder: Path | None) -> str:
    """Return an exception as text, with the innermost file and line in `folder` of its traceback."""
    text = " ".join(f"{type(error).__name__}: {error}".split()) if str(error) else type(error).__name__
    if isinstance(error, SyntaxError) and error.filename is not None:
        return f"{text.split(' (')[0]} ({Path(error.filename).name}, line {error.lineno})"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if folder is not None and Path(frame.filename).is_relative_to(folder)]
    return f"{text} ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else text


def serve(file: str, function: str) -> None:
    """Load a function and answer requests until standard input closes.

    If the function cannot be loaded, each answer is an error with the reason. Child processes of the function do not
    inherit the requests as their standard input; answers begin on a new line, because output of the function may end
    without one.
    """
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    renderer: Renderer | None = None
    failure: dict[str, Any] = {}
    try:
        renderer = _loaded(Path(file), function)
    except Exception as error:  # boundary to foreign code: a file may raise any exception while it is loaded
        failure = _failure(0, error, Path(file).parent)
    for line in requests:
        request = json.loads(line)
        answer = {**failure, "id": request["id"]} if renderer is None else answered(renderer, request)
        sys.stderr.write(str(answer.pop("trace", "")))
        sys.stdout.flush()
        os.write(1, f"\n{json.dumps(answer)}\n".encode())


def _loaded(file: Path, function: str) -> Renderer:
    """Load a file, which may import modules of its folder, and return its function."""
    sys.path[0] = str(file.parent)
    spec = importlib.util.spec_from_file_location(MODULE, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[MODULE] = module
    spec.loader.exec_module(module)
    renderer = getattr(module, function, None)
    if not callable(renderer):
        raise LookupError(f"{file.name} has no function {function}")
    return renderer
