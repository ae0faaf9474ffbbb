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
NEAR = 2  # times the least estimate: of 1580 residuals one farther off deflated to less in 9, by a thousandth in sum


def encode(image: np.ndarray, predictions: Iterable[tuple[Mapping[str, Any], np.ndarray]]) -> dict[str, Any]:
    """Return a float32 image (height, width, channels) as plain JSON data, by the prediction that leaves least.

    Raises:
        ValueError: the image is not float32, or a prediction has another shape or type.

    """
    if image.dtype != np.float32:
        raise ValueError(f"images to embed must be float32, got {image.dtype}")
    drafts: list[tuple[int, dict[str, Any], np.ndarray]] = []
    for how, prediction in predictions:
        if prediction.shape != image.shape or prediction.dtype != np.float32:
            raise ValueError(f"an image of shape {image.shape} cannot be stored against {prediction.shape}")
        residual = _bits(image) - _bits(prediction)
        bytes_left = _bytes_left(residual)
        if how["by"] == "nothing":
            slope = _slope(residual)
            # What repeats along the rows deflates to what its changes would.
            drafts.append((min(bytes_left, 2 * _bytes_left(slope)), {**how, "curved": False}, residual))
            bend = _slope(slope)
            drafts.append((_bytes_left(bend), {**how, "curved": True}, bend))
        else:
            # What is left of a good prediction is rounding, which has no curvature worth trying.
            drafts.append((bytes_left, {**how, "curved": False}, residual))
    if not drafts:
        raise ValueError("an image needs a prediction, be it nothing")
    least = min(bytes_left for bytes_left, _, _ in drafts)
    near = [(how, _planes(residual)) for bytes_left, how, residual in drafts if bytes_left <= NEAR * least]
    # Deflating only to choose takes longer than deflating to store, so that what cannot win is not deflated.
    how, planes = near[0] if len(near) == 1 else min(near, key=lambda one: len(zlib.compress(one[1], QUICK)))
    packed = base64.b64encode(zlib.compress(planes, LEVEL)).decode("ascii")
    return {"channels": image.shape[-1], **how, "data": packed}


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


def _slope(residual: np.ndarray) -> np.ndarray:
    """Return the difference along each row, modulo 2^32; what lies left of the row is 0."""
    return np.diff(residual, axis=1, prepend=np.uint32(0))


def _zigzag(residual: np.ndarray) -> np.ndarray:
    """Return differences modulo 2^32 so that small ones of either sign are small."""
    signed = residual.view(np.int32)
    return ((signed << 1) ^ (signed >> 31)).view(np.uint32)


def _bytes_left(residual: np.ndarray) -> int:
    """Return how many bytes of the zigzag code are in use: an estimate of what deflating leaves."""
    code = _zigzag(residual)
    return sum(int(np.count_nonzero(code >= np.uint32(1 << bits))) for bits in (0, 8, 16, 24))


def _planes(residual: np.ndarray) -> bytes:
    """Return the zigzag code of signed differences, small ones of either sign small, as byte planes."""
    code = _zigzag(np.ascontiguousarray(np.moveaxis(residual, -1, 0)))
    return code.reshape(-1).astype(">u4").view(np.uint8).reshape(-1, 4).T.tobytes()
