"""`run`: the command `run`, called in this process.

A Python function under test is called in the thread that called `run`, because the loop of its worker pool accepts the
calls.
"""

import contextlib
import json
import os
import shlex
import shutil
import socket
import sys
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.scene_json import save_scene
from rayproof.reports.api.asking import image_stages
from rayproof.reports.api.function import Renderer, answered
from rayproof.reports.api.outcome import Run, loaded
from rayproof.reports.processes.pool import taking_calls
from rayproof.reports.results.document import has_results
from rayproof.reports.subjects import SERVED

RELAY = Path(__file__).with_name("relay.py")
WAITING = 128  # connections in the socket's queue
LONGEST = 2**16  # bytes of a call: two paths
PATIENCE = 10.0  # s from the connection of a program to its complete request


class Served:
    """A function, and the socket that receives its calls."""

    def __init__(self, renderer: Renderer, folder: Path, *, stages: Sequence[str] | None = None) -> None:
        """Listen at a socket in `folder`; `stages` are the stages that the function supports, by default all.

        Raises:
            ValueError: there is no such image stage.

        """
        self._renderer, self._stages = renderer, None if stages is None else [*map(str, image_stages(stages))]
        self._place = folder / "calls.sock"
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(self._place))
        self.listener.listen(WAITING)

    @property
    def command(self) -> str:
        """Return the value of `--subject` for this function."""
        return f"{SERVED}:{shlex.join([sys.executable, '-I', '-S', str(RELAY), str(self._place)])}"

    def __enter__(self) -> "Served":
        return self

    def __exit__(self, *_: object) -> None:
        self.listener.close()

    def answer_one(self) -> None:
        """Accept and answer one call; an exception of the function is sent to the caller as an error of its case."""
        end, _ = self.listener.accept()
        with end:
            end.settimeout(PATIENCE)
            try:
                request = json.loads(_line(end))
                end.sendall(json.dumps(answered(self._renderer, request, self._stages)).encode())
            except OSError:  # the caller has ended, because of its time limit or at the end of its run
                return


def _line(end: socket.socket) -> bytes:
    """Read the first line of the peer."""
    line = b""
    while not line.endswith(b"\n") and len(line) < LONGEST:
        piece = end.recv(LONGEST)
        if not piece:
            raise OSError("the caller has ended")
        line += piece
    return line


INTERRUPTED = 130


def run(
    cases: Sequence[str | Path | Case | Scene] | str | None = None,
    subject: str | Renderer | None = None,
    *,
    stages: Sequence[str] | None = None,
    configurations: Sequence[str] = (),
    formulas: Sequence[str] = (),
    require: Sequence[str] = (),
    declare: str | Path | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    expect: str | Path | None = None,
    jobs: int | None = None,
    timeout: float | None = None,
    diagnose: bool = True,
    quiet: bool = False,
) -> Run:
    """Judge a renderer on cases, in the same way as `rayproof run`, and return the finished run.

    `cases` are selectors (families, family/case, patterns, scene files), cases of `select_cases`, or scenes; None is
    the default suite. `subject` is the renderer under test: None for the tracer, a reference's name, "exec:COMMAND
    {scene} {output}", "serve:COMMAND", "python:FILE.py:FUNCTION", or a function `(scene, stages) -> {stage: array}`.

    A function is called in this process and thread, once per scene, and a second time for twenty of the scenes. Its
    arrays are (height, width, channels), of any library that supports DLPack; they are written and judged as float32.
    It must return the stages in `stages`, by default any of those requested. It raises NotImplementedError if it does
    not support a scene. Its attribute `deterministic`, if True, promises that two of its images of one scene are equal
    to the last bit.

    `declare` is the path of a JSON file with capabilities that a program does not declare itself. The other arguments
    are the command's options (`rayproof run --help`). Without `out` the results are written to a temporary folder,
    which is removed together with the returned object.

    Raises:
        ValueError: the arguments are wrong; the message is the command's one line.
        RuntimeError: the run ended without results.
        KeyboardInterrupt: Ctrl-C; finished cases are in `out`, and `resume=True` continues.

    """
    function = subject if callable(subject) else None
    if stages is not None and function is None:
        raise ValueError("`stages` are those that a Python function answers, and the subject is none")
    folder = Path(tempfile.mkdtemp(prefix="rayproof-run-") if out is None else out)
    options = {
        "--out": folder,
        "--declare": declare,
        "--expect": expect,
        "--jobs": jobs,
        "--timeout": timeout,
        "--diagnose": None if diagnose else "off",
    }
    repeated = {"--configuration": configurations, "--formula": formulas, "--require": require}
    words = [f"{name}={value}" for name, value in options.items() if value is not None]
    words += [f"{name}={value}" for name, values in repeated.items() for value in values]
    words += ["--resume"] if resume else []
    try:
        with TemporaryDirectory(prefix="rayproof-call-") as place:
            words += _selectors(cases, Path(place))
            with contextlib.ExitStack() as stack:
                if function is not None:
                    served = stack.enter_context(Served(function, Path(place), stages=stages))
                    stack.enter_context(taking_calls(served.listener.fileno(), served.answer_one))
                    words += [f"--subject={served.command}"]
                elif subject is not None:
                    words += [f"--subject={subject}"]
                code = _run(words, quiet=quiet)
        if code == INTERRUPTED:
            raise KeyboardInterrupt
        if not has_results(folder):
            raise RuntimeError(f"the run ended with {code} and left no results")
        finished = loaded(folder, code)
    except BaseException:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    if out is None:
        weakref.finalize(finished, shutil.rmtree, folder, ignore_errors=True)
    return finished


def _selectors(cases: Sequence[str | Path | Case | Scene] | str | None, place: Path) -> list[str]:
    """Return the command's selectors of cases; scenes are written as scene files into `place`."""
    if cases is None:
        return []
    words = []
    for number, case in enumerate([cases] if isinstance(cases, str) else cases):
        if isinstance(case, Scene):
            file = place / f"scene-{number}.json"
            save_scene(case, file)
            words.append(str(file))
        else:
            words.append(case.name if isinstance(case, Case) else str(case))
    if not words:
        raise ValueError("no case is named; None is the default suite")
    return words


def _run(words: Sequence[str], *, quiet: bool) -> int:
    """Run the command in this process and return its exit code; raise ValueError for wrong arguments."""
    from cyclopts import CycloptsError

    from rayproof.reports.cli import application
    from rayproof.reports.commands.usage import UsageError, disown, one_line
    from rayproof.reports.program_name import remember
    from rayproof.tracer.formulas.own_file import forget

    forget()  # a file of the user may have changed since an earlier call
    remember(["run", *words])
    about = {"exit_on_error": False, "print_error": False, "result_action": "return_value"}
    with contextlib.ExitStack() as stack:
        stack.callback(remember)
        stack.callback(disown)
        if quiet:
            nowhere = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123
            stack.enter_context(contextlib.redirect_stdout(nowhere))
            stack.enter_context(contextlib.redirect_stderr(nowhere))
        try:
            return application()(["run", *words], **about)
        except (UsageError, CycloptsError) as error:
            raise ValueError(one_line(error)) from error
