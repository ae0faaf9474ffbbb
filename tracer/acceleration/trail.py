"""Where a way through a tree stands, in two words: the heap index `key` of a node, and `trail`, what is left to visit.

A node has four children, and trail three bits per level, one for each sibling that is still to be visited: to go back,
climb to the deepest set bit and turn to that sibling. So there is no stack.
"""

from collections.abc import Sequence
from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arrays import ArrayTypes

DONE = 0xFFFFFFFF  # the node of those that are done
# What is pending on a level are the siblings x = 1 .. 3 of the current child, counted by exclusive or: bit x - 1. Of
# the eight combinations, the one to turn to, and what is then pending as seen from there.
FIRST = (0, 1, 2, 1, 3, 1, 2, 1)
REST = (0, 0, 0, 4, 0, 2, 1, 6)


def _below(types: ArrayTypes, table: Sequence[int], place: Any) -> Any:
    """Return an entry below 16 of a table of eight: one word that is shifted."""
    word = sum(entry << (4 * k) for k, entry in enumerate(table))
    return (types.UInt(word) >> (place << 2)) & 15


def pop(types: ArrayTypes, key: Any, trail: Any) -> tuple[Any, Any]:
    """Return the deepest node still to be visited, or key DONE where none is left."""
    Single: Any = dr.float32_array_t(types.Float)
    # The exponent of the lowest bit as a float: AVX2 has no instruction that counts zeros.
    lowest = Single(dr.int32_array_t(types.UInt)(trail & (~trail + 1)))
    bits: Any = dr.reinterpret_array(types.UInt, lowest)
    zeros = (bits >> 23) - 127
    done = trail == 0
    levels = dr.select(done, 0, (zeros * 11) >> 5)  # a third, for all below 32
    trail = trail >> (levels * 3)
    pending = trail & 7
    key = (key >> (levels * 2)) ^ _below(types, FIRST, pending)
    return dr.select(done, DONE, key), (trail & ~types.UInt(7)) | _below(types, REST, pending)


def nearest_child(types: ArrayTypes, hits: Sequence[Any], enters: Sequence[Any]) -> tuple[Any, Any, Any]:
    """Return whether any of four children is met, the nearest of them, and the others relative to it."""
    UInt = types.UInt
    t = [dr.select(hit, enter, dr.inf) for hit, enter in zip(hits, enters, strict=True)]
    second, fourth = t[1] < t[0], t[3] < t[2]
    upper = dr.select(fourth, t[3], t[2]) < dr.select(second, t[1], t[0])
    odd = (upper & fourth) | (~upper & second)
    child = dr.select(upper, UInt(2), 0) | dr.select(odd, UInt(1), 0)
    bits = [dr.select(hit, UInt(1 << k), 0) for k, hit in enumerate(hits)]
    some = (bits[0] | bits[1]) | (bits[2] | bits[3])
    others = dr.select(odd, ((some & 5) << 1) | ((some >> 1) & 5), some)
    others = dr.select(upper, ((others & 3) << 2) | (others >> 2), others)
    return some != 0, child, others >> 1
