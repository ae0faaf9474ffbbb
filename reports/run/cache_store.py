"""The cache's files: entries by key with SHA-256, checked on every read; the least recently used go first.

An entry consists of a description in JSON, the bytes of its arrays, and a SHA-256 over its key and all bytes. There is
no pickle, so that reading an entry executes no code. The folder belongs to the user (mode 0700). If other users may
write to it, the store is disabled: it stores and returns nothing, and `unused` is the reason.

Entries that this run or the previous one used are not evicted: otherwise a suite slightly larger than the store would
have no cache hit at all, since each entry would be evicted just before its next use. If there is no space without such
an eviction, the new entry is not stored, and its bytes are counted in a separate file, so that a run can report them.

Many processes may use the store at once: an entry is written to a draft and renamed, so that a reader sees a whole
entry or none, and a file that another process has removed is a cache miss.
"""

import hashlib
import json
import math
import os
import stat
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypedDict, TypeVar, cast

import numpy as np
import platformdirs

MAGIC = b"rayproof entry 3\n"
DIGEST = hashlib.sha256().digest_size
START = len(MAGIC) + DIGEST
COUNT = 8  # bytes of the JSON part's length
GLANCE = 4096  # numbers at the start of an array that are tested before the whole array


class About(TypedDict, total=False):
    """The description of an entry: the digest of its question, and facts for a listing."""

    key: str
    kind: str  # "render", "judgement" or "guard"
    reference: str  # name of the reference, case or self-test
    version: str
    settings: dict[str, str]
    stages: list[str]
    samples: int
    size: list[int]  # of the image
    shapes: int
    lights: int
    seconds: float


class Header(TypedDict):
    """The JSON part."""

    about: About
    arrays: list[tuple[str, str, str, list[int]]]  # name, type as written, type as wanted, shape


class DamagedEntryError(ValueError):
    """An entry differs from the written one: it is truncated, altered, forged or renamed."""


def encode(about: About, arrays: Mapping[str, np.ndarray], *, question: str) -> bytes:
    """Return an entry with its checksum; float64 arrays that float32 represents exactly are stored as float32."""
    written = {name: _narrowed(np.ascontiguousarray(array)) for name, array in arrays.items()}
    table = [
        [name, array.dtype.str, arrays[name].dtype.str, list(np.shape(arrays[name]))] for name, array in written.items()
    ]
    header = json.dumps({"about": about, "arrays": table}).encode()
    parts = [len(header).to_bytes(COUNT, "little"), header, *(_bytes(array) for array in written.values())]
    return b"".join([MAGIC, _checksum(parts, question), *parts])


def decode(data: bytes, *, question: str) -> tuple[About, dict[str, np.ndarray]]:
    """Return the description and the arrays of an entry; raise DamagedEntryError unless it belongs to this question."""
    _check(data, question)
    header, offset = _header(data)
    arrays: dict[str, np.ndarray] = {}
    try:
        for name, stored, wanted, shape in header["arrays"]:
            kind, count = np.dtype(stored), int(np.prod(shape))
            flat = np.frombuffer(data, dtype=kind, count=count, offset=offset)
            arrays[name] = flat.reshape(shape).astype(np.dtype(wanted))
            offset += count * kind.itemsize
    except (ValueError, TypeError, OverflowError) as wrong:
        raise DamagedEntryError(f"its arrays cannot be read: {wrong}") from wrong
    return header["about"], arrays


def about(data: bytes) -> About:
    """Return the description of an entry without a check of its digest, for listings."""
    _begins(data)
    return _header(data)[0]["about"]


def _begins(data: bytes) -> None:
    if not data.startswith(MAGIC):
        raise DamagedEntryError("it does not begin as an entry does")


def _check(data: bytes, question: str) -> None:
    _begins(data)
    if not _checksum([memoryview(data)[START:]], question) == data[len(MAGIC) : START]:
        raise DamagedEntryError(f"its checksum does not hold ({len(data)} bytes)")


def _checksum(parts: Iterable[Any], question: str) -> bytes:
    """Return the SHA-256 of a key and an entry's bytes, so that a renamed entry counts as damaged."""
    name = question.encode()
    checksum = hashlib.sha256(len(name).to_bytes(COUNT, "little") + name)
    for part in parts:
        checksum.update(part)
    return checksum.digest()


def _header(data: bytes) -> tuple[Header, int]:
    """Return the JSON part and the offset [bytes] of the arrays."""
    begin = START + COUNT
    end = begin + int.from_bytes(data[START:begin], "little")
    try:
        header = json.loads(data[begin:end])
    except (ValueError, RecursionError) as wrong:
        raise DamagedEntryError(f"it does not say what it is: {wrong}") from wrong
    if not (isinstance(header, dict) and isinstance(header.get("about"), dict) and "arrays" in header):
        raise DamagedEntryError("it does not say what it is")
    return cast("Header", header), end


def _narrowed(array: np.ndarray) -> np.ndarray:
    # Test the first numbers first: nearly every array that float32 cannot represent has such a number there.
    if array.dtype != np.float64 or not _holds(_narrow(array.ravel()[:GLANCE]), array.ravel()[:GLANCE]):
        return array
    narrow = _narrow(array)
    return narrow if _holds(narrow, array) else array


def _narrow(array: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        return array.astype(np.float32)


def _holds(narrow: np.ndarray, array: np.ndarray) -> bool:
    """Return whether float32 numbers equal the float64 ones bit by bit, including the signs of zeros and NaNs."""
    return np.array_equal(narrow.astype(np.float64).view(np.uint64), array.view(np.uint64))


def _bytes(array: np.ndarray) -> np.ndarray:
    """Return a view of a contiguous array's bytes."""
    return array.reshape(-1).view(np.uint8)


LIMIT_VARIABLE = "RAYPROOF_CACHE_LIMIT"  # the environment variable that names another limit [GiB]
LIMIT = 2 * 2**30  # bytes: three default suites
MOST = 2.0**33  # GiB


def usual_limit() -> int:
    """Return the limit of the store's size [bytes]: RAYPROOF_CACHE_LIMIT [GiB] if it is set, or the usual limit.

    Raises:
        ValueError: the variable's value is no positive number of GiB.

    """
    text = os.environ.get(LIMIT_VARIABLE)
    if not text:
        return LIMIT
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value <= MOST:
        raise ValueError(f"{LIMIT_VARIABLE} must be positive and at most {MOST:g} GiB, got {text}")
    return int(value * 2**30)


VARIABLE = "RAYPROOF_CACHE"  # the environment variable that names another folder
LEAVE = 0.9  # share of the limit that is in use after an eviction
UNSEEN = 1 / 64  # share of the limit: bytes that a process may write before it counts the store again
SUFFIX, DRAFT = ".entry", ".draft"
HEAD = 2**16  # bytes of an entry that a listing reads
RUNS, LEFT_OUT = "runs", "left_out"  # files: starts of the last two runs [s]; bytes that were not stored
FORGOTTEN = 3600.0  # s; an older draft belongs to a process that was killed

Entry = tuple[About, dict[str, np.ndarray]]  # description and arrays
Read = TypeVar("Read")


@dataclass(frozen=True, kw_only=True)
class Item:
    """One entry of a listing."""

    path: Path
    size: int  # bytes
    used: float  # s since the epoch
    about: About  # empty where it cannot be read


def usual_folder() -> Path:
    """Return the cache's folder: RAYPROOF_CACHE, or the user's own cache folder."""
    chosen = os.environ.get(VARIABLE)
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("rayproof")) / "answers"


def usual_store() -> "Store":
    """Return this process's store in the usual folder."""
    return _store(usual_folder(), usual_limit())


@cache
def _store(folder: Path, limit: int) -> "Store":
    return Store(folder, limit=limit)


class Store:
    """Entries by key in a folder that need not exist yet; `unused` is the reason if the store is not used."""

    def __init__(self, folder: Path, *, limit: int = LIMIT) -> None:
        self.folder = folder
        self._limit = limit
        self._size: int | None = None  # bytes, when they were counted last
        self._written = 0  # bytes since then
        self._full = False  # no entry could be evicted
        self.unused = _anybodys(folder)

    def path(self, key: str) -> Path:
        """Return the path of a key's entry."""
        return self.folder / key[:2] / f"{key}{SUFFIX}"

    def get(self, key: str) -> Entry | None:
        """Return the description and the arrays of a key's entry, None without one.

        Raises:
            DamagedEntryError: it differs from the entry that was written under this key; it has been removed if
            possible.

        """
        return self.read(key, lambda entry: entry)

    def read(self, key: str, reader: Callable[[Entry], Read]) -> Read | None:
        """Return the result of `reader` for a key's entry, None without one.

        Raises:
            DamagedEntryError: it differs from the entry that was written under this key, or the reader raised an
                exception; the entry has been removed if possible.

        """
        path = self.path(key)
        try:
            data = path.read_bytes() if self.unused is None else None
        except OSError:
            return None
        if data is None:
            return None
        try:
            read = reader(self._decoded(key, data))
        except Exception as wrong:
            self._remove(path)
            if isinstance(wrong, DamagedEntryError):
                raise
            raise DamagedEntryError(f"it cannot be read ({type(wrong).__name__}: {wrong})") from wrong
        self._touch(path)
        return read

    def _decoded(self, key: str, data: bytes) -> Entry:
        return decode(data, question=key)

    def put(self, key: str, description: About, arrays: Mapping[str, np.ndarray]) -> None:
        """Write an entry, after an eviction if necessary, or count its bytes if there is no room.

        Raises:
            OSError: the entry cannot be written.

        """
        if self.unused is not None:
            return
        data = encode({**description, "key": key}, arrays, question=key)
        if self._has_room(len(data)):
            self._write(self.path(key), data)
            self._written += len(data)
        else:
            self._note_left_out(len(data))

    def _has_room(self, more: int) -> bool:
        """Return whether `more` bytes fit, after the eviction of other entries if necessary."""
        if more > self._limit or self._full:
            return False
        if self._size is None or self._written > UNSEEN * self._limit:
            self._remove_old_drafts()
            self._size, self._written = sum(size for _, size, _ in self._files()), 0
        if self._size + self._written + more > self._limit:
            self._evict(more)
            self._full = self._size + more > self._limit
        return not self._full

    def begin(self) -> None:
        """Record the start of a run, and reset the count of bytes that were not stored, if the store can be written."""
        if self.unused is not None:
            return
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            (self.folder / LEFT_OUT).unlink(missing_ok=True)
            draft = self.folder / f"{RUNS}.{uuid.uuid4().hex}{DRAFT}"
            draft.write_text(json.dumps([self._begun()[-1], time.time()]), encoding="utf-8")
            draft.replace(self.folder / RUNS)

    def _begun(self) -> list[float]:
        """Return the start times of the last two runs [s since the epoch], 0 for a run that does not exist."""
        try:
            begun = json.loads((self.folder / RUNS).read_text(encoding="utf-8"))
            return [float(begun[0]), float(begun[1])]
        except (OSError, ValueError, TypeError, LookupError):
            return [0.0, 0.0]

    def _note_left_out(self, size: int) -> None:
        with suppress(OSError), (self.folder / LEFT_OUT).open("a", encoding="utf-8") as file:
            file.write(f"{size}\n")

    @property
    def left_out(self) -> int:
        """Return the bytes that no process could store for lack of room since the last run began."""
        try:
            return sum(int(line) for line in (self.folder / LEFT_OUT).read_text(encoding="utf-8").split())
        except (OSError, ValueError):
            return 0

    @property
    def limit(self) -> int:
        """Return the limit of the store's size [bytes]."""
        return self._limit

    @staticmethod
    def _write(path: Path, data: bytes) -> None:
        """Write a whole entry or none; the name of the draft is unique, also among threads of this process."""
        path.parents[1].mkdir(parents=True, exist_ok=True, mode=0o700)
        path.parent.mkdir(exist_ok=True, mode=0o700)
        draft = path.with_name(f"{path.stem}.{uuid.uuid4().hex}{DRAFT}")
        try:
            draft.write_bytes(data)
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)

    def items(self) -> list[Item]:
        """Return all entries, the least recently used first."""
        return [Item(path=path, size=size, used=used, about=_told(path)) for path, size, used in self._by_use()]

    def verify(self) -> tuple[int, list[tuple[Path, str]]]:
        """Read every entry; return the number of good entries, and the damaged ones, now removed, with reasons."""
        good, bad = 0, []
        for path, _, _ in self._by_use():
            try:
                self._decoded(path.stem, path.read_bytes())
                good += 1
            except FileNotFoundError:
                continue  # another process removed it meanwhile
            except DamagedEntryError as wrong:
                path.unlink(missing_ok=True)
                bad.append((path, str(wrong)))
        return good, bad

    def clear(self) -> tuple[int, int]:
        """Remove every entry; return their number and their size [bytes]."""
        count = size = 0
        for path, length, _ in list(self._files()):
            path.unlink(missing_ok=True)
            count, size = count + 1, size + length
        self._remove_old_drafts(0.0)
        for name in (RUNS, LEFT_OUT):
            (self.folder / name).unlink(missing_ok=True)
        return count, size

    def _remove_old_drafts(self, age: float = FORGOTTEN) -> None:
        """Remove drafts of killed processes that are at least `age` seconds old."""
        for draft in list(self.folder.glob(f"??/*{DRAFT}")):
            with suppress(OSError):
                if time.time() - draft.stat().st_mtime >= age:
                    draft.unlink()

    def _files(self) -> Iterator[tuple[Path, int, float]]:
        """Yield the path, size [bytes] and time of last use [s] of each entry, except entries that vanish meanwhile."""
        for path in self.folder.glob(f"??/*{SUFFIX}"):
            try:
                status = path.stat()
            except OSError:
                continue
            yield path, status.st_size, status.st_mtime

    def _by_use(self) -> list[tuple[Path, int, float]]:
        return sorted(self._files(), key=lambda file: (file[2], file[0]))

    def _evict(self, more: int) -> None:
        """Remove the least recently used entries until `more` bytes fit, but none that the last two runs used."""
        files = self._by_use()
        left = sum(size for _, size, _ in files)
        before, now = self._begun()
        for path, size, used in files:
            if left + more <= LEAVE * self._limit or (now and used >= before):
                break
            left -= size if self._remove(path) else 0
        self._size, self._written = left, 0

    @staticmethod
    def _remove(path: Path) -> bool:
        """Return whether the entry was removed; it cannot be if another user owns it or the folder is read-only."""
        try:
            path.unlink(missing_ok=True)
        except OSError:
            return False
        return True

    @staticmethod
    def _touch(path: Path) -> None:
        """Note that an entry was used."""
        now = time.time()
        try:
            os.utime(path, (now, now))
        except OSError:
            return  # removed meanwhile, or in a read-only folder, where the time of use cannot be updated


def _anybodys(folder: Path) -> str | None:
    """Return a sentence if other users may write the folder, None if they may not or it does not exist yet."""
    try:
        about = folder.stat()
    except OSError:
        return None
    if os.name == "posix" and (about.st_uid not in (0, os.geteuid()) or about.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        return f"others may write the cache: {folder}; chmod go-w it, or name another in {VARIABLE}"
    return None


def _told(path: Path) -> About:
    try:
        with path.open("rb") as file:
            return about(file.read(HEAD))
    except (OSError, DamagedEntryError):
        return {}
