"""Typed arrays out of a glTF document's buffers (sections 3.6.1 and 3.6.2), checked against the bytes there are."""

from typing import Any

import numpy as np

from rayproof.cases.scene import SceneError, shown
from rayproof.reports.interchange.gltf.document import Document
from rayproof.reports.interchange.gltf.entries import AccessorEntry, BufferViewEntry

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COUNTS = {"SCALAR": 1, "VEC3": 3}


def array(document: Document, index: Any, kind: str) -> np.ndarray:
    """Return an accessor's elements, shape (count, components), in the file's own type; normalized ones as float64.

    Raises:
        SceneError: the accessor is sparse, compressed, of another kind, or reaches beyond its bytes.

    """
    accessor = document.one(AccessorEntry, index)
    if accessor.get("type") != kind or kind not in COUNTS:
        raise SceneError(f"accessor {index} must be {kind}, got {shown(accessor.get('type'))}")
    if "sparse" in accessor:
        raise SceneError(f"accessor {index} is sparse, which is not read")
    if accessor.get("componentType") not in COMPONENTS:
        raise SceneError(f"accessor {index} has no known componentType: {shown(accessor.get('componentType'))}")
    element = np.dtype(COMPONENTS[accessor["componentType"]])
    components, count = COUNTS[kind], _whole(accessor, "count", index)
    document.budget.expand(count * components * element.itemsize, by=f"accessor {shown(index)} of {count} elements")
    if "bufferView" not in accessor:
        return np.zeros((count, components), dtype=element)
    view = document.one(BufferViewEntry, accessor["bufferView"])
    buffer = _buffer(document, view)
    start = _whole(view, "byteOffset", index, 0) + _whole(accessor, "byteOffset", index, 0)
    stride = _whole(view, "byteStride", index, element.itemsize * components)
    end = start + stride * (count - 1) + element.itemsize * components if count else start
    if end > len(buffer) or stride < element.itemsize * components:
        raise SceneError(f"accessor {index} reaches to byte {end} of {len(buffer)}")
    found = np.ndarray((count, components), element, buffer, start, (stride, element.itemsize)).copy()
    stands_for_fractions = accessor.get("normalized") is True and element.kind in "iu" and kind != "SCALAR"
    if stands_for_fractions:
        document.budget.expand(8 * found.size, by=f"accessor {shown(index)}, normalized,")
        return _fractions(found)
    return found


def _fractions(whole: np.ndarray) -> np.ndarray:
    """Return what normalized whole numbers stand for: 1 is the largest, -1 the least and its neighbour (3.11)."""
    return np.maximum(whole / float(np.iinfo(whole.dtype).max), -1.0)


def _buffer(document: Document, view: BufferViewEntry) -> memoryview:
    index = view.get("buffer")
    if not isinstance(index, int) or not 0 <= index < len(document.buffers):
        raise SceneError(f"a buffer view names no buffer: {shown(index)}")
    return document.buffers[index]


def _whole(members: AccessorEntry | BufferViewEntry, name: str, index: Any, usual: int | None = None) -> int:
    value = members.get(name, usual)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise SceneError(f"accessor {index}: {name} must be a whole number >= 0, got {shown(value)}")
    return value
