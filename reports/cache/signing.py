"""The secret by which this user's entries are told from anybody else's: whoever lacks it can write none.

A cache is a folder, and folders are copied, shared and mounted; a checksum proves that an entry is whole, never that it
was this user who found what it says. The secret lies in the user's own state folder, outside of the cache. Processes of
the same user can read it: it guards against other people's entries, not against one's own programs.
"""

import hashlib
import os
import stat
import uuid
from contextlib import suppress
from functools import cache
from pathlib import Path

import platformdirs

VARIABLE = "RAYPROOF_CACHE_KEY"  # the environment variable that shares a secret between machines
FEWEST = 16  # characters of it: of a key that is guessed nothing is proved
NAME = "cache.key"
SIZE = 32  # bytes, as many as the digest that it makes


class NoSecretError(Exception):
    """There is no secret that only this user has; the message is a sentence that says why."""


def usual_secret() -> bytes:
    """Return RAYPROOF_CACHE_KEY's secret, or that of the user's state folder, made there at the first time.

    Raises:
        NoSecretError: there is none.

    """
    chosen = os.environ.get(VARIABLE)
    if not chosen:
        return _kept(Path(platformdirs.user_state_dir("rayproof")) / NAME)
    if len(chosen) < FEWEST:
        raise NoSecretError(f"{VARIABLE} has {len(chosen)} characters, and needs at least {FEWEST}")
    return hashlib.sha256(os.fsencode(chosen)).digest()


@cache
def _kept(path: Path) -> bytes:
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        return _read(path) or _made(path)
    except OSError as wrong:
        raise NoSecretError(
            f"the key of the cache cannot be had: {path}: {wrong.strerror or wrong}; {VARIABLE} can give one"
        ) from None


def _made(path: Path) -> bytes:
    """Write a new secret, whole and readable by nobody else from the first; of two processes the first one's counts."""
    draft = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
    handle = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with open(handle, "wb") as file:  # noqa: PTH123  a descriptor
            file.write(os.urandom(SIZE))
            file.flush()
            os.fsync(file.fileno())
        with suppress(FileExistsError):
            os.link(draft, path)
    finally:
        draft.unlink(missing_ok=True)
    secret = _read(path)
    if secret is None:
        raise NoSecretError(f"the key of the cache vanished while it was made: {path}")
    return secret


def _read(path: Path) -> bytes | None:
    """Return the secret in a file, None where there is no file; raise NoSecretError if it may be anybody's."""
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except FileNotFoundError:
        return None
    with open(handle, "rb") as file:  # noqa: PTH123  a descriptor
        about = os.fstat(handle)
        if not stat.S_ISREG(about.st_mode):
            raise NoSecretError(f"the key of the cache is no file: {path}")
        if os.name == "posix" and (about.st_uid != os.geteuid() or about.st_mode & 0o077):
            raise NoSecretError(f"the key of the cache is others' to read or write: {path}; remove it, or chmod 600")
        secret = file.read(SIZE + 1)
    if len(secret) != SIZE:
        raise NoSecretError(f"the key of the cache has {len(secret)} bytes instead of {SIZE}: remove {path}")
    return secret
