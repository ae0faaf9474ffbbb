"""Untrusted files: allowed folders, safe opening, and the budget for reading one scene.

A scene file may come from an untrusted source. So a file that it names must be inside the scene's folder after every
link is resolved, or in a folder that the user allows. A file of a kilobyte can demand gigabytes: by instances of
instances, by parameters made of parameters, by arrays without data. So every reader spends from one budget per scene
before it builds anything, and the budget grows only with the bytes that were read.
"""

import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath

import numpy as np

from rayproof.cases.scene import SceneError, shown

LET_IN = "another one is let in by --allow-folder"
FREE_BYTES = 64 * 2**20  # that the expanded arrays of any scene may take, even if its files are small
BYTES_A_BYTE = 16  # additional bytes per byte read: a face of a text mesh has 8 characters and needs 24 bytes
LIMITS = {
    "triangles": 20_000_000,
    "elements": 100_000,  # of a file's tree: XML elements, glTF nodes and primitives
    "references": 1_000_000,  # from element to element, followed again for every instance
    "shapes": 20_000,  # after instances are unfolded
    "includes": 256,  # of XML files in each other
    "levels of nesting": 64,
}


@dataclass(kw_only=True)
class Budget:
    """The budget of a scene. A refusal names the element that spends, the exhausted resource and its limit."""

    read: int = 0  # bytes of files, each once
    meshes: dict[Path, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # that were read, by file
    notes: dict[Path, tuple[str, ...]] = field(default_factory=dict)  # remarks for the report, by file
    _files: set[Path] = field(default_factory=set)
    _spent: dict[str, int] = field(default_factory=dict)

    def spend(self, what: str, amount: int, *, by: str) -> None:
        """Spend `amount` of one of LIMITS for `by`.

        Raises:
            SceneError: less than that is left.

        """
        self._spent[what] = self._spent.get(what, 0) + amount
        if self._spent[what] > LIMITS[what]:
            raise SceneError(
                f"{by} takes the scene to {self._spent[what]} {what}; at most {LIMITS[what]} {what} are read"
            )

    def expand(self, size: int, *, by: str) -> None:
        """Take `size` bytes of memory for the expanded arrays or texts of `by`.

        Raises:
            SceneError: the files that were read are too small to need so much.

        """
        self._spent["bytes"] = self._spent.get("bytes", 0) + size
        most = FREE_BYTES + BYTES_A_BYTE * self.read
        if self._spent["bytes"] > most:
            raise SceneError(
                f"{by} takes the scene to {self._spent['bytes']} bytes; files of {self.read} bytes may unfold to at "
                f"most {most} bytes"
            )

    def go_down(self, depth: int, *, by: str) -> None:
        """Raise SceneError if `by` is nested too deeply."""
        most = LIMITS["levels of nesting"]
        if depth > most:
            raise SceneError(f"{by} lies {depth} levels deep; at most {most} levels of nesting are read")

    def count_file(self, path: Path, size: int) -> None:
        """Count the bytes of a file that is read, the first time."""
        if path not in self._files:
            self._files.add(path)
            self.read += size


def path_within(
    name: str, folder: Path, *, what: str, largest: int, kinds: tuple[str, ...] = (), beside: Path | None = None
) -> Path:
    """Return the real path of the regular file `name`, relative to `beside` (default: `folder`), inside `folder`.

    `kinds` are the allowed suffixes (default: any).

    Raises:
        SceneError: it is outside `folder`, is no regular file, or has more than `largest` bytes; begins with `what`.

    """
    absolute = PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor
    if not name or absolute or not name.isprintable() or ".." in PurePosixPath(name.replace("\\", "/")).parts:
        raise SceneError(f"{what} must be a relative path inside the scene's folder, got {shown(name)}")
    if kinds and PurePosixPath(name).suffix.lower() not in kinds:
        raise SceneError(f"{what} must end in one of {', '.join(kinds)}, got {shown(name)}")
    try:
        path = ((beside or folder) / name).resolve(strict=True)
        facts = path.stat()
    except FileNotFoundError:
        raise SceneError(f"{what} names no file: {shown(name)}") from None
    except (OSError, RuntimeError):  # a loop of links, a part that is no folder, no permission, too long a name
        raise SceneError(f"{what} cannot be opened: {shown(name)}") from None
    if not path.is_relative_to(folder.resolve()):
        raise SceneError(
            f"{what} must be a relative path inside the scene's folder, got a link out of it: {shown(name)}"
        )
    if not stat.S_ISREG(facts.st_mode):
        raise SceneError(f"{what} must name a regular file, got {shown(name)}")
    if facts.st_size > largest:
        raise SceneError(f"{what} must have at most {largest} bytes, got {facts.st_size} bytes in {shown(name)}")
    return path


def is_plain(name: str) -> bool:
    """Return whether a name can be a file's name: long and unprintable names cannot."""
    return name.isprintable() and len(name) < 1000 and all(len(part) < 250 for part in Path(name).parts)


def located(name: str, folders: Sequence[Path], roots: Sequence[Path], what: str) -> tuple[Path, str]:
    """Return a folder and a name in it for the file `name`, searched for in `folders`.

    A name that contains `..` must lead into one of the `roots`. `path_within` checks that the file exists and may be
    opened.

    Raises:
        SceneError: it leads elsewhere; the message begins with `what`.

    """
    beside = next((folder for folder in folders if is_plain(name) and (folder / name).is_file()), folders[0])
    if ".." not in Path(name).parts or not is_plain(name):
        return beside, name
    path = (beside / name).resolve()
    for root in roots:
        if path.is_relative_to(root.resolve()):
            return root, path.relative_to(root.resolve()).as_posix()
    raise SceneError(f"{what} must be a relative path inside the scene's folder, got {shown(name)}; {LET_IN}")


def content_of(path: Path, *, largest: int) -> bytes:
    """Return a regular file's bytes. A path that has become a pipe since it was checked is refused without blocking.

    Raises:
        OSError: it cannot be opened.
        SceneError: it is no longer a regular file, or has become too large.

    """
    # A FIFO that took the file's place would be waited for without the flag.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        facts = os.fstat(file.fileno())
        if not stat.S_ISREG(facts.st_mode) or facts.st_size > largest:
            raise SceneError(f"{path.name} is no regular file of at most {largest} bytes any more")
        return file.read(largest + 1)[:largest]
