"""A lock file by which only one process writes a folder; it is released when that process dies.

The lock is filelock's: `flock` on an open file, which the kernel lets go however the process ends, and which processes
that it starts do not inherit. The file says who owns the folder, for whoever is refused. Where a file system has no
`flock` nobody is refused.
"""

import errno
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from filelock import BaseFileLock

NAME = ".owner"
PATIENCE = 0.1  # s for an owner that is just ending
MOST_SAID = 4096  # bytes of the file that are read
LONGEST_COMMAND = 200  # characters of the owner's command that a refusal repeats
NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS)


class OwnedError(OSError):
    """A folder is another process's to write, which `strerror` names with its command and since when."""


@contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Make `folder` if need be and own it for the body; the lock's file goes with the body.

    Raises:
        OwnedError: another process owns it.
        OSError: nothing can be written there.

    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = acquired(folder)
    try:
        yield
    finally:
        (folder / NAME).unlink(missing_ok=True)
        lock.release(force=True)


def acquired(folder: Path) -> "BaseFileLock":
    """Return the lock that now owns an existing folder, which its `release` lets go.

    Raises:
        OwnedError: another process owns the folder.
        OSError: nothing can be written there.

    """
    from filelock import Timeout

    lock = _lock_of(folder)
    try:
        lock.acquire(timeout=PATIENCE, poll_interval=PATIENCE / 4)
    except Timeout:
        raise OwnedError(errno.EBUSY, f"{_owner(folder)}; name another folder, or wait", str(folder)) from None
    except OSError as error:
        if error.errno not in NO_LOCKS:
            raise
    now = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    ourselves = {"pid": os.getpid(), "command": " ".join(["rayproof", *sys.argv[1:]])[:LONGEST_COMMAND], "since": now}
    (folder / NAME).write_text(json.dumps(ourselves), encoding="utf-8")
    return lock


def abandoned(folder: Path) -> bool:
    """Say whether a folder has an owner's file, written to the end, and no process that holds it."""
    from filelock import Timeout

    try:
        if not (folder / NAME).stat().st_size:
            return False  # it is being taken
        with _lock_of(folder).acquire(blocking=False):
            return True
    except (Timeout, OSError):
        return False


def _lock_of(folder: Path) -> "BaseFileLock":
    from filelock import FileLock

    # Without a lock nobody is refused: a file that stands for one would outlive a process that is killed.
    return FileLock(folder / NAME, thread_local=False, fallback_to_soft=False)


def _owner(folder: Path) -> str:
    """Return a sentence about who owns a folder; the file may be half written, or anybody's."""
    try:
        with (folder / NAME).open(encoding="utf-8") as file:
            content: dict[str, Any] = json.loads(file.read(MOST_SAID))
        pid, command, since = int(content["pid"]), str(content["command"]), str(content["since"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return "another process is writing it"
    clean = "".join(letter if letter.isprintable() else "?" for letter in f"({command}) since {since}")
    return f"process {pid} {clean[: 2 * LONGEST_COMMAND]} is writing it"
