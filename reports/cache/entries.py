"""One cache entry as bytes: what it is in JSON, its arrays as they lie in memory, and a checksum over all of it.

No pickle: a cache is a folder that anybody may have written to, and reading it must not run anything.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

MAGIC = b"rayproof entry 1\n"
DIGEST = hashlib.sha256().digest_size
START = len(MAGIC) + DIGEST
COUNT = 8  # bytes that tell how long the JSON part is


class DamagedEntryError(ValueError):
    """An entry is not what was written: cut short, altered or under another's name."""


def encode(about: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return an entry; float64 arrays that float32 holds to the last bit are written so."""
    written = {name: _narrowed(np.ascontiguousarray(array)) for name, array in arrays.items()}
    table = [
        [name, array.dtype.str, arrays[name].dtype.str, list(np.shape(arrays[name]))] for name, array in written.items()
    ]
    header = json.dumps({"about": about, "arrays": table}).encode()
    body = b"".join([len(header).to_bytes(COUNT, "little"), header, *(array.tobytes() for array in written.values())])
    return MAGIC + hashlib.sha256(body).digest() + body


def decode(data: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return what an entry is and its arrays; raise DamagedEntryError unless its checksum holds."""
    _check(data)
    header, offset = _header(data)
    arrays: dict[str, np.ndarray] = {}
    for name, stored, wanted, shape in header["arrays"]:
        kind, count = np.dtype(stored), int(np.prod(shape))
        flat = np.frombuffer(data, dtype=kind, count=count, offset=offset)
        arrays[name] = flat.reshape(shape).astype(np.dtype(wanted))
        offset += count * kind.itemsize
    return header["about"], arrays


def about(data: bytes) -> dict[str, Any]:
    """Return what an entry says it is, its checksum not looked at: for listings."""
    if not data.startswith(MAGIC):
        raise DamagedEntryError("it does not begin as an entry does")
    return _header(data)[0]["about"]


def _check(data: bytes) -> None:
    if not data.startswith(MAGIC):
        raise DamagedEntryError("it does not begin as an entry does")
    if hashlib.sha256(memoryview(data)[START:]).digest() != data[len(MAGIC) : START]:
        raise DamagedEntryError(f"its checksum does not hold ({len(data)} bytes)")


def _header(data: bytes) -> tuple[dict[str, Any], int]:
    """Return the JSON part and where the arrays begin."""
    begin = START + COUNT
    end = begin + int.from_bytes(data[START:begin], "little")
    try:
        return json.loads(data[begin:end]), end
    except ValueError as wrong:
        raise DamagedEntryError(f"it does not say what it is: {wrong}") from wrong


def _narrowed(array: np.ndarray) -> np.ndarray:
    if array.dtype != np.float64:
        return array
    with np.errstate(over="ignore", invalid="ignore"):
        narrow = array.astype(np.float32)
        same = narrow.astype(np.float64).tobytes() == array.tobytes()
    return narrow if same else array
