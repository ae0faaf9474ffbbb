"""A Python function as a program under test: it is called in this process, in the thread that asked for the run."""

import json
import shlex
import socket
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from rayproof.cases.scene import Scene
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.api.arrays import answers_from
from rayproof.reports.api.asking import image_stages
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.exr import write_answers

Renderer = Callable[[Scene, Sequence[Stage]], Mapping[str, Any] | Any]
RELAY = Path(__file__).with_name("relay.py")
WAITING = 128  # calls that may wait for their turn
LONGEST = 2**16  # bytes of a call: two paths
PATIENCE = 10.0  # s for a program that has connected to say what it wants


class Declared(TypedDict):
    """What is said of the function, in the words of docs/protocol.md."""

    protocol: int
    name: str
    version: str
    precision: str
    stages: NotRequired[list[str]]
    deterministic: NotRequired[bool]


class Answer(TypedDict, total=False):
    """What a call is told; nothing where the images lie where it wants them."""

    capabilities: Declared
    unsupported: str
    error: str


class Served:
    """The function, and the socket at which calls of it arrive."""

    def __init__(self, renderer: Renderer, folder: Path, *, stages: Sequence[str] | None = None) -> None:
        """Listen at a socket in `folder`; `stages` are those that the function answers, all by default.

        Raises:
            ValueError: there is no such image stage.

        """
        self._renderer = renderer
        self._stages = tuple(IMAGE_STAGES if stages is None else image_stages(stages))
        self._declared = stages is not None
        self._place = folder / "calls.sock"
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(self._place))
        self.listener.listen(WAITING)

    @property
    def command(self) -> str:
        """Return what `--subject` is to be told."""
        words = [sys.executable, "-I", "-S", str(RELAY), str(self._place)]
        return f"exec:{shlex.join(words)} {{scene}} {{output}}"

    def __enter__(self) -> "Served":
        return self

    def __exit__(self, *_: object) -> None:
        self.listener.close()

    def answer_one(self) -> None:
        """Take one call and answer it; what the function raises is told to the caller, and is its case's error."""
        end, _ = self.listener.accept()
        with end:
            end.settimeout(PATIENCE)
            try:
                words = json.loads(_line(end))
                end.sendall(json.dumps(self._answer(words)).encode())
            except OSError:  # the caller has ended, by its time limit or with its run
                return

    def _answer(self, words: list[str]) -> Answer:
        if words == ["--capabilities"]:
            return {"capabilities": self._capabilities()}
        scene_file, output = words
        try:
            scene = load_scene(scene_file)
            asked = tuple(stage for stage in stages_of(scene) if stage in self._stages)
            answers = answers_from(self._renderer(scene, asked), scene, asked)
            missing = [stage.value for stage in asked if stage not in answers]
            if missing and (self._declared or not answers):
                raise ValueError(f"it gave no {', '.join(missing)}")
            write_answers(Path(output), answers, len(scene.lights))
        except NotImplementedError as reason:
            return {"unsupported": " ".join(str(reason).split()) or "it says so"}
        except Exception:  # the boundary: whatever a renderer raises is that case's error
            return {"error": traceback.format_exc()}
        return {}

    def _capabilities(self) -> Declared:
        name = getattr(self._renderer, "__qualname__", type(self._renderer).__name__)
        known: Declared = {"protocol": 1, "name": str(name), "version": "", "precision": "float64"}
        if self._declared:
            known["stages"] = [stage.value for stage in self._stages]
        if getattr(self._renderer, "deterministic", True) is False:
            known["deterministic"] = False
        return known


def _line(end: socket.socket) -> bytes:
    """Return the line that the other side sends first."""
    told = b""
    while not told.endswith(b"\n") and len(told) < LONGEST:
        piece = end.recv(LONGEST)
        if not piece:
            raise OSError("the caller has ended")
        told += piece
    return told
