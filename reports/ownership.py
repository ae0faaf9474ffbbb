"""A lock file that lets only one process write a folder; it is released when that process ends.

The lock is filelock's: `flock` on an open file. The kernel releases it however the process ends, and child processes do
not inherit it. The file contains the owner's process number and command, for the message to other processes. On a file
system without `flock` there is no lock, and no process is refused.
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
PATIENCE = 0.1  # s to wait for an owner that is just ending
MOST_SAID = 4096  # bytes of the file that are read
LONGEST_COMMAND = 200  # characters of the owner's command in an error message
NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS)


class OwnedError(OSError):
    """Another process owns the folder; `strerror` contains its number, its command and the start time."""


@contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Create `folder` if necessary and own it during the body; remove the lock file afterwards.

    Raises:
        OwnedError: another process owns the folder.
        OSError: the folder cannot be written.

    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = acquired(folder)
    try:
        yield
    finally:
        (folder / NAME).unlink(missing_ok=True)
        lock.release(force=True)


def acquired(folder: Path) -> "BaseFileLock":
    """Acquire an existing folder and return the lock; its method `release` gives the folder up.

    Raises:
        OwnedError: another process owns the folder.
        OSError: the folder cannot be written.

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
    """Return whether a folder has a complete lock file that no process holds."""
    from filelock import Timeout

    try:
        if not (folder / NAME).stat().st_size:
            return False  # a process is just acquiring it
        with _lock_of(folder).acquire(blocking=False):
            return True
    except (Timeout, OSError):
        return False


def _lock_of(folder: Path) -> "BaseFileLock":
    from filelock import FileLock

    # No fallback to the mere existence of a file as a lock: it would remain after a process is killed.
    return FileLock(folder / NAME, thread_local=False, fallback_to_soft=False)


def _owner(folder: Path) -> str:
    """Return a sentence about the owner of a folder; the file may be incomplete or written by another program."""
    try:
        with (folder / NAME).open(encoding="utf-8") as file:
            content: dict[str, Any] = json.loads(file.read(MOST_SAID))
        pid, command, since = int(content["pid"]), str(content["command"]), str(content["since"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return "another process is writing it"
    clean = "".join(letter if letter.isprintable() else "?" for letter in f"({command}) since {since}")
    return f"process {pid} {clean[: 2 * LONGEST_COMMAND]} is writing it"
