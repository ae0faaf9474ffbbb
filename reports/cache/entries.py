"""One cache entry as bytes: what it is in JSON, its arrays as they lie in memory, and a signature over all of it.

The signature is HMAC-SHA256 (RFC 2104) by the user's secret, over the question and every byte of the answer, and holds
before anything is parsed. No pickle: a cache is a folder that anybody may have written to, and reading it must not run
anything.
"""

import hashlib
import hmac
import json
from collections.abc import Iterable, Mapping
from typing import Any, TypedDict, cast

import numpy as np

MAGIC = b"rayproof entry 2\n"
DIGEST = hashlib.sha256().digest_size
START = len(MAGIC) + DIGEST
COUNT = 8  # bytes that tell how long the JSON part is
GLANCE = 4096  # numbers of an array that are looked at before all are


class About(TypedDict, total=False):
    """What an entry says it is: its question's digest, and what a listing tells of it."""

    key: str
    kind: str  # "render", "edges", "judgement" or "guard"
    reference: str  # or whatever else it is of
    version: str
    settings: dict[str, str]
    stages: list[str]
    samples: int
    size: list[int]  # of the image
    shapes: int
    lights: int
    seconds: float
    light_ends: list[tuple[int, int, int, float]]  # of edges: light, shape, face and gap


class Header(TypedDict):
    """The JSON part."""

    about: About
    arrays: list[tuple[str, str, str, list[int]]]  # name, type as written, type as wanted, shape


class DamagedEntryError(ValueError):
    """An entry is not what was written: cut short, altered, forged or under another's name."""


def encode(about: About, arrays: Mapping[str, np.ndarray], *, question: str, secret: bytes) -> bytes:
    """Return an entry, signed; float64 arrays that float32 holds to the last bit are written so."""
    written = {name: _narrowed(np.ascontiguousarray(array)) for name, array in arrays.items()}
    table = [
        [name, array.dtype.str, arrays[name].dtype.str, list(np.shape(arrays[name]))] for name, array in written.items()
    ]
    header = json.dumps({"about": about, "arrays": table}).encode()
    parts = [len(header).to_bytes(COUNT, "little"), header, *(_bytes(array) for array in written.values())]
    return b"".join([MAGIC, _signature(parts, question, secret), *parts])


def decode(data: bytes, *, question: str, secret: bytes) -> tuple[About, dict[str, np.ndarray]]:
    """Return what an entry is and its arrays; raise DamagedEntryError unless it was signed as this question's."""
    _check(data, question, secret)
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
    """Return what an entry says it is, its signature not looked at: for listings, which believe nothing."""
    _begins(data)
    return _header(data)[0]["about"]


def _begins(data: bytes) -> None:
    if not data.startswith(MAGIC):
        raise DamagedEntryError("it does not begin as an entry does")


def _check(data: bytes, question: str, secret: bytes) -> None:
    _begins(data)
    if not hmac.compare_digest(_signature([memoryview(data)[START:]], question, secret), data[len(MAGIC) : START]):
        raise DamagedEntryError(f"its signature does not hold ({len(data)} bytes)")


def _signature(parts: Iterable[Any], question: str, secret: bytes) -> bytes:
    """Return the HMAC-SHA256 of a question and of an answer's bytes: nothing else can be passed off as its answer."""
    name = question.encode()
    signature = hmac.new(secret, len(name).to_bytes(COUNT, "little") + name, hashlib.sha256)
    for part in parts:
        signature.update(part)
    return signature.digest()


def _header(data: bytes) -> tuple[Header, int]:
    """Return the JSON part and where the arrays begin."""
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
    # Nearly all that float32 does not hold says so in its first numbers.
    if array.dtype != np.float64 or not _holds(_narrow(array.ravel()[:GLANCE]), array.ravel()[:GLANCE]):
        return array
    narrow = _narrow(array)
    return narrow if _holds(narrow, array) else array


def _narrow(array: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        return array.astype(np.float32)


def _holds(narrow: np.ndarray, array: np.ndarray) -> bool:
    """Say whether float32 numbers are the float64 ones to the last bit, the signs of zeros and NaNs included."""
    return np.array_equal(narrow.astype(np.float64).view(np.uint64), array.view(np.uint64))


def _bytes(array: np.ndarray) -> np.ndarray:
    """Return an array's bytes where they lie."""
    return array.reshape(-1).view(np.uint8)
