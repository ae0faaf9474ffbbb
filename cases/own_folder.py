"""The files that a scene may name: regular ones inside of its own folder, looked at before they are opened."""

import os
import stat
from pathlib import Path, PurePosixPath, PureWindowsPath

from rayproof.cases.scene import SceneError
from rayproof.cases.scene_fields import shown


def path_within(
    name: str, folder: Path, *, what: str, largest: int, kinds: tuple[str, ...] = (), beside: Path | None = None
) -> Path:
    """Return the real path of the regular file `name` in `beside` (default: `folder`), which lies inside `folder`.

    `kinds` are the endings that it may have (default: any).

    Raises:
        SceneError: it leads elsewhere, is no regular file, or has more than `largest` bytes; begins with `what`.

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


def content_of(path: Path, *, largest: int) -> bytes:
    """Return a regular file's bytes; what became of the path since it was looked at is refused, never waited for.

    Raises:
        OSError: it cannot be opened.
        SceneError: it is no regular file any more, or a larger one.

    """
    # A FIFO that took the file's place would be waited for without the flag.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        facts = os.fstat(file.fileno())
        if not stat.S_ISREG(facts.st_mode) or facts.st_size > largest:
            raise SceneError(f"{path.name} is no regular file of at most {largest} bytes any more")
        return file.read(largest + 1)[:largest]
