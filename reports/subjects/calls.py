"""One call of a user's program in a folder of its own, within limits: how it ended, its last lines; calls kept.

A call that is kept can be looked at and made again: what the program was handed, its command, and what it printed.
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
CANNOT = 77  # the exit code by which a program says that it cannot draw this scene, as test programs skip by it
SHELLS_WORD = 128  # a shell ends with this plus the number of the signal that ended its program
GLANCE = 0.2  # s between looks at what the program has written
MOST_SAID = 64 * 2**10  # bytes kept of what it printed
LONGEST_LINE = 200  # characters of its complaint that a verdict repeats
LAST_LINES = 3  # of them, of a program that stays alive


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a call ended: `problem` is a sentence, or None if it ended with 0 and kept within its limits."""

    problem: str | None
    refusal: str | None  # why it says it cannot, in its own words
    said: str  # what it printed
    complaint: str = ""  # what it printed on standard error, the end of it
    stopped: bool = False  # its time was over
    code: int | None = None  # its exit code, or less a signal's number
    lost: bool = False  # of a program that stays alive: it died or exceeded a limit, and must be started again
    astray: bool = False  # likewise: it answered out of turn
    reported: bool = False  # the problem is what it says itself
    declared: Mapping[str, Any] | None = None  # its capabilities
    prints: int = 0  # lines on standard output that are no answers
    first_print: str = ""


class Overrun(str):
    """The problem of a program whose time was over."""


def call(
    arguments: Sequence[str],
    folder: Path,
    *,
    seconds: float,
    memory: int,
    output: int,
    variables: Collection[str] = (),
) -> Ended:
    """Run a program in `folder` and wait for its end, at most `seconds`; nothing that it started outlives the call.

    `memory` [bytes of address space] and `output` [bytes, of a file and of the folder] are limits as well. `variables`
    of the environment are passed beyond the usual ones.
    """
    adopt_orphans()
    others = frozenset(process.pid for process in descendants(os.getpid()))
    # Not in the folder, and no pipes: a program may delete the one, and stops where nobody reads the other.
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as complaint:
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", KEEPER, str(os.getpid()), str(memory), str(output), *arguments],
            cwd=folder,
            env=environment(variables),
            stdin=subprocess.DEVNULL,
            stdout=said,
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
        text, wrong, note = _tail(said), _tail(complaint), ""
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
    """Return a note on the variables that a program did not get, for the problem of a program that failed."""
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
    """Return how much the files below `folder` hold [bytes]; they may come and go meanwhile."""
    total = 0
    for where, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.lstat(os.path.join(where, name)).st_size  # noqa: PTH118  paths of any bytes
            except OSError:
                continue
    return total


def how_it_ended(code: int, output: int) -> str:
    """Return in words how a program ended that may write `output` bytes into a file."""
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
    """Return the end of what was printed."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - MOST_SAID))
    return file.read().decode("utf-8", errors="replace")


def _first_line(text: str) -> str:
    return next(iter(_lines(text)), "")


def last_lines(text: str, most: int = LAST_LINES) -> str:
    """Return the last lines that say something, in one."""
    said = [line for line in _lines(text) if any(letter.isalnum() for letter in line)]
    return " | ".join(said[-most:])


def _lines(text: str) -> list[str]:
    """Return the lines that say something, fit to be shown in one."""
    plain = (legible(line).strip() for line in text.splitlines())
    return [line[:LONGEST_LINE] for line in plain if line]


TOLD = "call.txt"
SCENE_WORD = re.compile(r"\{scene\.(\w+)\}")  # the path of a scene in another program's format
LARGEST = 2**26  # bytes of an image that is kept


def filled(command: Sequence[str], folder: Path, scene: Scene, *, samples: int, seed: int, spp: int) -> list[str]:
    """Return the words of a call in a folder, its scene and image in it."""
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
    """Write the scene and its meshes as they were handed over, and in call.txt the command and how it ended.

    `line` is the command as a shell takes it; `notes` say what of the scene was handed over as something else.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / TOLD).is_file():  # an earlier call's: nothing of it must pass for this one's
        for name in ("scene.*", "scene-*.ply", "mesh-*.obj", "image.*"):
            for path in folder.glob(name):
                path.unlink()
    hand_over(scene, folder, scene_format)
    (folder / TOLD).write_text("\n".join(told(line, ended, notes)) + "\n", encoding="utf-8")


def keep_output(folder: Path, image: Path) -> None:
    """Copy the image of a call into `folder`, if it is a file and not large."""
    if image.is_file() and not image.is_symlink() and image.stat().st_size <= LARGEST:
        shutil.copyfile(image, folder / image.name)


def told(line: str, ended: Ended, notes: Sequence[str]) -> list[str]:
    """Return a call in lines: the command `line`, to be run in its folder, how it ended, and what it printed."""
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
