"""A folder is written by one process at a time: who takes it holds a lock on a file in it, which dies with the process.

The lock is `flock` on an open file, which the kernel lets go however the process ends; processes that it starts do not
inherit it. The file says who owns the folder, for whoever is refused. Where there is no `flock` (a file system over the
network, another operating system) nobody is refused.
"""

import errno
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # not POSIX
    fcntl = None

NAME = ".owner"
MOST_SAID = 4096  # bytes of the file that are read
LONGEST_COMMAND = 200  # characters of the owner's command that a refusal repeats


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
        release(folder, lock)


def acquired(folder: Path) -> int:
    """Return the descriptor of the lock that now owns an existing folder; `release` gives it back.

    Raises:
        OwnedError: another process owns the folder.
        OSError: nothing can be written there.

    """
    path = folder / NAME
    while True:
        lock = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
        try:
            _lock(lock, folder)
            if _is(path, lock):
                os.ftruncate(lock, 0)
                os.pwrite(lock, json.dumps(_ourselves()).encode(), 0)
                return lock
        except BaseException:
            os.close(lock)
            raise
        os.close(lock)  # whoever owned it before removed the file meanwhile


def release(folder: Path, lock: int) -> None:
    """Remove the lock's file and let the lock go; the folder itself may be gone."""
    with suppress(OSError):
        (folder / NAME).unlink(missing_ok=True)
    os.close(lock)


def abandoned(folder: Path) -> bool:
    """Say whether a folder has an owner's file, written to the end, and no process that holds it."""
    try:
        lock = os.open(folder / NAME, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return False
    try:
        if not os.fstat(lock).st_size:
            return False  # it is being taken
        return _lock(lock, folder)
    except OSError:
        return False
    finally:
        os.close(lock)


def _lock(lock: int, folder: Path) -> bool:
    """Take the lock; return False where there is none to be had, raise OwnedError where another process has it."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        raise OwnedError(errno.EBUSY, f"{_owner(lock)}; name another folder, or wait", str(folder)) from None
    except OSError as error:
        if error.errno not in (errno.ENOLCK, errno.ENOTSUP, errno.EINVAL, errno.ENOSYS):
            raise
        return False


def _is(path: Path, lock: int) -> bool:
    """Say whether a descriptor is still the file of that path."""
    try:
        return os.path.samestat(path.stat(), os.fstat(lock))
    except FileNotFoundError:
        return False


def _ourselves() -> dict[str, Any]:
    now = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    return {"pid": os.getpid(), "command": " ".join(["rayproof", *sys.argv[1:]])[:LONGEST_COMMAND], "since": now}


def _owner(lock: int) -> str:
    """Return a sentence about who owns a folder; the file may be half written, or anybody's."""
    try:
        said = json.loads(os.pread(lock, MOST_SAID, 0))
        pid, command, since = int(said["pid"]), str(said["command"]), str(said["since"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return "another process is writing it"
    clean = "".join(letter if letter.isprintable() else "?" for letter in f"({command}) since {since}")
    return f"process {pid} {clean[: 2 * LONGEST_COMMAND]} is writing it"
