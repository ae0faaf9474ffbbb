"""One call of a user's program in a folder of its own, within limits: its result and output; stored calls.

A stored call can be inspected and repeated: it contains the program's input, its command and its output.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from rayproof.cases.scene import Scene
from rayproof.reports.processes.signals import adopt_orphans, descendants, end_below
from rayproof.reports.results.files import legible, legible_lines, several
from rayproof.reports.subjects import environment
from rayproof.reports.subjects.image_files import FORMATS
from rayproof.reports.subjects.protocol import JSON, NAME, hand_over, scene_name

KEEPER = str(Path(__file__).with_name("keeper.py"))
CANNOT = 77  # the exit code of a program that cannot draw the scene; Automake's test programs skip with it
SHELLS_WORD = 128  # a shell's exit code is this plus the number of the signal that ended its program
GLANCE = 0.2  # s between measurements of the program's output
MOST_SAID = 64 * 2**10  # bytes of printed output that are kept, from its end
LONGEST_LINE = 200  # characters of a line of standard error that a verdict contains
LAST_LINES = 3  # lines of standard error in the verdict of a program that stays alive


@dataclass(frozen=True, kw_only=True)
class Ended:
    """The result of a call: `problem` is a sentence, or None if it ended with exit code 0 within its limits."""

    problem: str | None
    refusal: str | None  # the program's reason why it cannot draw the scene
    said: str  # the end of standard output
    complaint: str = ""  # the end of standard error
    stopped: bool = False  # whether it exceeded its time and was stopped
    code: int | None = None  # its exit code, or minus the number of the signal that ended it
    lost: bool = False  # a persistent program died or exceeded a limit, and must be started again
    astray: bool = False  # of a program that stays alive: its answer belongs to no request
    reported: bool = False  # whether `problem` is the program's own message
    declared: Mapping[str, Any] | None = None  # its capabilities
    prints: int = 0  # the number of lines on standard output that are no answers
    first_print: str = ""  # the first of these lines


class Overrun(str):
    """The problem of a program that exceeded its time."""


def call(
    arguments: Sequence[str],
    folder: Path,
    *,
    seconds: float,
    memory: int,
    output: int,
    variables: Collection[str] = (),
) -> Ended:
    """Run a program in `folder` and wait for its end, at most `seconds`; processes that it started are ended.

    `memory` limits the address space [bytes], `output` the size of each file and of the folder [bytes]. `variables`
    names environment variables that are passed besides the usual ones.
    """
    adopt_orphans()
    others = frozenset(process.pid for process in descendants(os.getpid()))
    # Neither files in the folder, which the program may delete, nor pipes, which block if they are not read.
    with tempfile.TemporaryFile() as printed, tempfile.TemporaryFile() as complaint:
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", KEEPER, str(os.getpid()), str(memory), str(output), *arguments],
            cwd=folder,
            env=environment(variables),
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=complaint,
            start_new_session=True,
        )
        try:
            problem = _watch(process, folder, seconds, output)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
            left = end_below(os.getpid(), besides=others)
        text, wrong, note = _tail(printed), _tail(complaint), ""
        about = {"said": text, "complaint": wrong, "code": process.returncode, "stopped": isinstance(problem, Overrun)}
        if problem is None and process.returncode == CANNOT:
            return Ended(problem=None, refusal=_first_line(text) or "It says that it cannot.", **about)
        if problem is None and process.returncode != 0:
            problem = how_it_ended(process.returncode, output)
            note = withheld(variables)
        if problem is None and left:
            problem = f"it left {len(left)} process{'es' if len(left) > 1 else ''} running ({left[0]}), now ended"
        last = last_lines(wrong, 1) if problem is not None else ""
        if problem is not None:
            problem = f"{problem}: {last}{note}" if last else f"{problem}{note}"
        return Ended(problem=problem, refusal=None, **about)


def withheld(variables: Collection[str]) -> str:
    """Return a note, for a program's failure, on the environment variables that were withheld from it."""
    count = len(os.environ) - len(environment(variables))
    return f" ({several(count, 'environment variable')} withheld; --env NAME passes one on)" if count else ""


def _watch(process: subprocess.Popen[bytes], folder: Path, seconds: float, output: int) -> str | None:
    """Wait for the program's end; return why it must be stopped, or None if it ended by itself."""
    deadline = time.monotonic() + seconds
    while True:
        try:
            process.wait(timeout=max(0.0, min(GLANCE, deadline - time.monotonic())))
            return None
        except subprocess.TimeoutExpired:
            if time.monotonic() >= deadline:
                return Overrun(f"it did not end within {seconds:g} s and was stopped")
            if size_below(folder) > output:
                return f"it wrote more than {output / 2**20:g} MiB and was stopped"


def size_below(folder: Path) -> int:
    """Return the total size of the files below `folder` [bytes]; files may appear and vanish meanwhile."""
    total = 0
    for where, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.lstat(os.path.join(where, name)).st_size  # noqa: PTH118  paths of any bytes
            except OSError:
                continue
    return total


def how_it_ended(code: int, output: int) -> str:
    """Return a sentence on a program's exit code; `output` is its limit of a file's size [bytes]."""
    if code > SHELLS_WORD and code - SHELLS_WORD in set(signal.Signals):
        return f"it ended with exit code {code}, a shell's word for {signal.Signals(code - SHELLS_WORD).name}"
    if code >= 0:
        return f"it ended with exit code {code}"
    if code == -getattr(signal, "SIGXFSZ", 0):
        return f"it wrote a file of more than {output / 2**20:g} MiB and was stopped"
    try:
        return f"it was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"it was ended by signal {-code}"


def _tail(file: IO[bytes]) -> str:
    """Return the last `MOST_SAID` bytes of a file as text."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - MOST_SAID))
    return file.read().decode("utf-8", errors="replace")


def _first_line(text: str) -> str:
    return next(iter(_lines(text)), "")


def last_lines(text: str, most: int = LAST_LINES) -> str:
    """Return the last lines with a letter or digit, joined to one line."""
    lines = [line for line in _lines(text) if any(letter.isalnum() for letter in line)]
    return " | ".join(lines[-most:])


def _lines(text: str) -> list[str]:
    """Return the lines that are not blank, legible and shortened."""
    plain = (legible(line).strip() for line in text.splitlines())
    return [line[:LONGEST_LINE] for line in plain if line]


TOLD = "call.txt"
SCENE_WORD = re.compile(r"\{scene\.(\w+)\}")  # the path of a scene in another program's format
LARGEST = 2**26  # bytes of a stored image


def filled(command: Sequence[str], folder: Path, scene: Scene, *, samples: int, seed: int, spp: int) -> list[str]:
    """Return the words of a command with its placeholders filled in, for a scene and an image in `folder`."""
    camera = scene.camera
    names = {
        "{scene}": str(folder / NAME),
        "{output}": str(folder / "image.exr"),
        "{samples}": str(samples),
        "{spp}": str(spp),
        "{seed}": str(seed),
        "{width}": str(camera.width),
        "{height}": str(camera.height),
        **{f"{{output.{name}}}": str(folder / f"image.{name}") for name in FORMATS},
    }
    words = []
    for word in command:
        for name, value in names.items():
            word = word.replace(name, value)
        words.append(SCENE_WORD.sub(lambda match: str(folder / scene_name(match[1])), word))
    return words


def keep_call(
    folder: Path, scene: Scene, line: str, ended: Ended, *, notes: Sequence[str], scene_format: str = JSON
) -> None:
    """Store a call: the scene and its meshes as the program got them, and call.txt with the command and its result.

    `line` is the command for a shell; `notes` are sentences about the differences of this scene to the case.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / TOLD).is_file():  # of an earlier call, whose files must be removed
        for name in ("scene.*", "scene-*.ply", "mesh-*.obj", "image.*"):
            for path in folder.glob(name):
                path.unlink()
    hand_over(scene, folder, scene_format)
    (folder / TOLD).write_text("\n".join(told(line, ended, notes)) + "\n", encoding="utf-8")


def keep_output(folder: Path, image: Path) -> None:
    """Copy the image of a call into `folder`, if it is a regular file of at most `LARGEST` bytes."""
    if image.is_file() and not image.is_symlink() and image.stat().st_size <= LARGEST:
        shutil.copyfile(image, folder / image.name)


def told(line: str, ended: Ended, notes: Sequence[str]) -> list[str]:
    """Return the lines of call.txt: the command `line`, to be run in the call's folder, its result and output."""
    lines = [f"# {note}" for note in notes] + [
        "# In this folder:",
        legible(line),
        "",
        *([f"exit code: {ended.code}"] if ended.code is not None else []),
    ]
    lines += [f"problem: {legible(ended.problem)}"] if ended.problem is not None else []
    lines += [f"it says that it cannot: {legible(ended.refusal)}"] if ended.refusal is not None else []
    for what, text in (("standard error", ended.complaint), ("standard output", ended.said)):
        lines += ["", f"{what}:", legible_lines(text.rstrip())] if text.strip() else ["", f"{what}: nothing"]
    return lines
