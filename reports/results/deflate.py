"""Byte planes as one zlib stream (RFC 1950, RFC 1951), each plane deflated by what it is made of.

The high bytes of residuals are runs and the lowest mostly noise: looking for repeats in either takes most of the time
that deflating takes and finds none. Where there are any, a part of the plane shows it. With codes of its own a plane
takes fewer bytes, too.
"""

import zlib
from collections.abc import Sequence

RUNS, REPEATS = zlib.Z_RLE, zlib.Z_DEFAULT_STRATEGY
QUICK, LEVEL = 1, 6  # of looking for repeats, to find out and to store; of runs it says nothing
RAW = -15  # bits of the window, the sign for a stream without a head
HEAD = b"\x78\x9c"  # deflated, in a window of 2^15 bytes, without a dictionary
FEW = 256  # bytes: what runs leave of a plane that need be no less
PART = 8  # of a plane, its middle: the whole finds 1.5 % more, in 1.4 times the time


def deflated(planes: Sequence[bytes]) -> bytes:
    """Return the planes, one behind the other, as a stream that any inflater reads."""
    parts, check = [HEAD], zlib.adler32(b"")
    for index, plane in enumerate(planes):
        parts.append(_segment(plane, last=index + 1 == len(planes)))
        check = zlib.adler32(plane, check)
    return b"".join([*parts, check.to_bytes(4, "big")])


def by_runs(planes: Sequence[bytes]) -> int:
    """Return how many bytes deflating by runs alone leaves: quick, and near what `deflated` does."""
    return sum(len(_by(RUNS, plane)) for plane in planes)


def _segment(plane: bytes, *, last: bool) -> bytes:
    """Return one plane's part of a stream, to be followed by others unless it is the last."""
    found = _by(RUNS, plane, last=last)
    if len(found) > FEW:
        middle, half = len(plane) // 2, len(plane) // (2 * PART)
        sample = plane[middle - half : middle + half]
        if len(_by(REPEATS, sample, level=QUICK)) < len(_by(RUNS, sample)):
            return _by(REPEATS, plane, last=last)
    return found


def _by(strategy: int, content: bytes, *, level: int = LEVEL, last: bool = True) -> bytes:
    stream = zlib.compressobj(level, zlib.DEFLATED, RAW, zlib.DEF_MEM_LEVEL, strategy)
    # A synchronising flush ends on a byte, where the next segment can begin.
    return stream.compress(content) + stream.flush(zlib.Z_FINISH if last else zlib.Z_SYNC_FLUSH)
