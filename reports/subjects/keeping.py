"""One call of a program, kept to be looked at and made again: what it was handed, its command, and what it said."""

import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rayproof.cases.scene import Scene
from rayproof.reports.results.json_numbers import legible, legible_lines
from rayproof.reports.subjects.calls import Ended
from rayproof.reports.subjects.request import NAME, hand_over

FOLDER = "calls"  # in a results folder
TOLD = "call.txt"
LARGEST = 2**26  # bytes of an image that is kept


@dataclass(frozen=True, kw_only=True)
class Keep:
    """Where a call is kept, and whether an image that could be used is, too."""

    folder: Path
    image: bool = False


def filled(command: Sequence[str], folder: Path, *, samples: int) -> list[str]:
    """Return the words of a call in a folder, its scene and image in it."""
    names = {
        "{scene}": str(folder / NAME),
        "{output}": str(folder / "image.exr"),
        "{output.pfm}": str(folder / "image.pfm"),
        "{samples}": str(samples),
    }
    words = []
    for word in command:
        for name, value in names.items():
            word = word.replace(name, value)
        words.append(word)
    return words


def image_name(command: Sequence[str]) -> str:
    """Return the name of the file that a command writes."""
    return "image.pfm" if any("{output.pfm}" in word for word in command) else "image.exr"


def keep_call(folder: Path, scene: Scene, words: Sequence[str], ended: Ended, *, notes: Sequence[str]) -> None:
    """Write the scene and its meshes as they were handed over, and in call.txt the command and how it ended.

    `notes` say what of the scene was handed over as something else.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if (folder / TOLD).is_file():  # an earlier call's: nothing of it must pass for this one's
        for name in (NAME, "mesh-*.obj", "image.exr", "image.pfm"):
            for path in folder.glob(name):
                path.unlink()
    hand_over(scene, folder)
    (folder / TOLD).write_text("\n".join(told(words, ended, notes)) + "\n", encoding="utf-8")


def keep_output(folder: Path, image: Path) -> None:
    """Keep an image that could not be used, if it is a file and not large."""
    if image.is_file() and not image.is_symlink() and image.stat().st_size <= LARGEST:
        shutil.copyfile(image, folder / image.name)


def told(words: Sequence[str], ended: Ended, notes: Sequence[str]) -> list[str]:
    """Return a call in lines: the command, to be run in its folder, how it ended, and what it printed."""
    lines = [f"# {note}" for note in notes] + [
        "# In this folder:",
        legible(shlex.join(words)),
        "",
        f"exit code: {ended.code}",
    ]
    lines += [f"problem: {legible(ended.problem)}"] if ended.problem is not None else []
    lines += [f"it says that it cannot: {legible(ended.refusal)}"] if ended.refusal is not None else []
    for what, text in (("standard error", ended.complaint), ("standard output", ended.said)):
        lines += ["", f"{what}:", legible_lines(text.rstrip())] if text.strip() else ["", f"{what}: nothing"]
    return lines
