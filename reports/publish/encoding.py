"""Float images as text that a browser decodes without a library: bit for bit, and small.

What is stored is the difference of bits to a prediction (`reports.publish.predicting`), zigzag-coded, and where that is
smaller its second difference along the rows: smooth images are near a parabola. Channel by channel, in byte planes
from the highest byte down, deflated (RFC 1950) and in base64; `DecompressionStream` undoes the deflating and
html/decode.js the rest.
"""

import base64
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

QUICK, LEVEL = 1, 6  # to choose by, and to store by


def encode(image: np.ndarray, predictions: Iterable[tuple[Mapping[str, Any], np.ndarray]]) -> dict[str, Any]:
    """Return a float32 image (height, width, channels) as plain JSON data, by the prediction that leaves least.

    Raises:
        ValueError: the image is not float32, or a prediction has another shape or type.

    """
    if image.dtype != np.float32:
        raise ValueError(f"images to embed must be float32, got {image.dtype}")
    best: tuple[int, dict[str, Any], bytes] | None = None
    for how, prediction in predictions:
        if prediction.shape != image.shape or prediction.dtype != np.float32:
            raise ValueError(f"an image of shape {image.shape} cannot be stored against {prediction.shape}")
        residual = _bits(image) - _bits(prediction)
        # What is left of a good prediction is rounding, which has no curvature worth trying.
        for curved in (False, True) if how["by"] == "nothing" else (False,):
            planes = _planes(_curvature(residual) if curved else residual)
            size = len(zlib.compress(planes, QUICK))
            if best is None or size < best[0]:
                best = (size, {**how, "curved": curved}, planes)
    if best is None:
        raise ValueError("an image needs a prediction, be it nothing")
    packed = base64.b64encode(zlib.compress(best[2], LEVEL)).decode("ascii")
    return {"channels": image.shape[-1], **best[1], "data": packed}


def decode(stored: Mapping[str, Any], height: int, width: int, prediction: np.ndarray | None) -> np.ndarray:
    """Undo `encode`: return the float32 image (height, width, channels).

    Raises:
        ValueError: the data is no such image.

    """
    try:
        planes = np.frombuffer(zlib.decompress(base64.b64decode(stored["data"])), np.uint8)
        bits = np.ascontiguousarray(planes.reshape(4, -1).T).view(">u4").astype(np.uint32)
        bits = ((bits >> 1) ^ (0 - (bits & 1))).reshape(stored["channels"], height, width)
    except (zlib.error, ValueError, TypeError) as error:
        raise ValueError(f"no image: {error}") from error
    bits = np.ascontiguousarray(np.moveaxis(bits, 0, -1))
    if stored["curved"]:
        bits = np.cumsum(np.cumsum(bits, axis=1, dtype=np.uint32), axis=1, dtype=np.uint32)
    if prediction is not None:
        bits = bits + _bits(prediction)
    return bits.view(np.float32)


def pack(content: bytes) -> str:
    """Return bytes deflated and in base64."""
    return base64.b64encode(zlib.compress(content, LEVEL)).decode("ascii")


def pack_text(text: str) -> str:
    """Return text deflated and in base64."""
    return pack(text.encode("utf-8", errors="replace"))


def _bits(image: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(image).view(np.uint32)


def _curvature(residual: np.ndarray) -> np.ndarray:
    """Return the second difference along each row, modulo 2^32; what lies left of the row is 0."""
    slope = np.diff(residual, axis=1, prepend=np.uint32(0))
    return np.diff(slope, axis=1, prepend=np.uint32(0))


def _planes(residual: np.ndarray) -> bytes:
    """Return the zigzag code of signed differences, small ones of either sign small, as byte planes."""
    signed = np.ascontiguousarray(np.moveaxis(residual, -1, 0)).view(np.int32)
    zigzag = ((signed << 1) ^ (signed >> 31)).view(np.uint32)
    return zigzag.reshape(-1).astype(">u4").view(np.uint8).reshape(-1, 4).T.tobytes()
