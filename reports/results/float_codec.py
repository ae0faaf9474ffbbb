"""Float images as text that a browser decodes without a library: bit for bit, and small.

What is stored is the difference of bits to a prediction (`reports.results.prediction`), zigzag-coded, and where that is
smaller its second difference along the rows: smooth images are near a parabola. Channel by channel, in byte planes
from the highest byte down, deflated and in base64; `DecompressionStream` undoes the deflating and html/decode.js
the rest.
"""

import base64
import zlib
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rayproof.reports.results.json_numbers import as_json, legible_json
from rayproof.reports.results.prediction import Drafted, Encoded, Prediction

LEVEL = 6  # of zlib

Draft = tuple[int, Drafted, np.ndarray]  # bytes that are left by estimate, how, and the residual of bits


def encode(image: np.ndarray, predictions: Iterable[tuple[Prediction, np.ndarray]]) -> Encoded:
    """Return a float32 image (height, width, channels) as plain JSON data, by the prediction that leaves least.

    Raises:
        ValueError: the image is not float32, or a prediction has another shape or type.

    """
    if image.dtype != np.float32:
        raise ValueError(f"images to embed must be float32, got {image.dtype}")
    how, residual = _least(_drafts(image, predictions))
    return {"channels": image.shape[-1], **how, "data": pack(_planes(residual))}


def _drafts(image: np.ndarray, predictions: Iterable[tuple[Prediction, np.ndarray]]) -> Iterator[Draft]:
    """Yield how an image could be stored: estimated bytes, how, and what is left; the cheapest to find first."""
    bits = _bits(image)
    waiting: list[tuple[Prediction, np.ndarray]] = []
    for how, prediction in predictions:
        if prediction.shape != image.shape or prediction.dtype != np.float32:
            raise ValueError(f"an image of shape {image.shape} cannot be stored against {prediction.shape}")
        residual = bits - _bits(prediction)
        if how["by"] == "nothing" and residual.any():
            waiting.append((how, residual))
        else:
            # What is left of a good prediction is rounding, which has no curvature worth trying.
            yield _bytes_left(residual), {**how, "curved": False}, residual
    for how, residual in waiting:
        slope = _slope(residual)
        # What repeats along the rows deflates to what its changes would.
        yield min(_bytes_left(residual), 2 * _bytes_left(slope)), {**how, "curved": False}, residual
        bend = _slope(slope)
        yield _bytes_left(bend), {**how, "curved": True}, bend


def _least(drafts: Iterable[Draft]) -> tuple[Drafted, np.ndarray]:
    """Return how, and what is left, of the draft that takes least; where nothing is left at all no other is made."""
    made: list[Draft] = []
    for bytes_left, how, residual in drafts:
        if not bytes_left:
            return how, residual
        made.append((bytes_left, how, residual))
    if not made:
        raise ValueError("an image needs a prediction, be it nothing")
    _, how, residual = min(made, key=lambda draft: draft[0])
    return how, residual


def decode(stored: Encoded, height: int, width: int, prediction: np.ndarray | None) -> np.ndarray:
    """Undo `encode`: return the float32 image (height, width, channels).

    Raises:
        ValueError: the data is no such image.

    """
    try:
        planes = np.frombuffer(inflated(stored["data"], 4 * stored["channels"] * height * width), np.uint8)
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


def inflated(data: str, size: int) -> bytes:
    """Return the `size` bytes that `data` packs; never more is unpacked.

    Raises:
        ValueError: it packs more or less, or nothing that can be unpacked.

    """
    if not isinstance(data, str) or size <= 0:
        raise ValueError(f"{size} bytes of packed text are needed")
    try:
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(base64.b64decode(data, validate=True), size)
    except (zlib.error, ValueError) as error:
        raise ValueError(f"it cannot be unpacked: {error}") from None
    if len(content) != size or unpacking.unconsumed_tail.strip(b"\0") or unpacking.decompress(b"", 1):
        raise ValueError(f"it must pack {size} bytes, and packs {'fewer' if len(content) < size else 'more'}")
    return content


def pack(content: bytes) -> str:
    """Return bytes deflated and in base64."""
    return base64.b64encode(zlib.compress(content, LEVEL)).decode("ascii")


def pack_text(text: str) -> str:
    """Return text deflated and in base64."""
    return pack(text.encode("utf-8", errors="replace"))


def pack_json(content: Any) -> str:
    """Return data as JSON whose texts are only texts, deflated and in base64."""
    return pack_text(legible_json(as_json(content)))


def _bits(image: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(image).view(np.uint32)


def _slope(residual: np.ndarray) -> np.ndarray:
    """Return the difference along each row, modulo 2^32; what lies left of the row is 0."""
    slope = residual.copy()
    slope[:, 1:] -= residual[:, :-1]
    return slope


def _bytes_left(residual: np.ndarray) -> int:
    """Return how many bytes of the zigzag code are in use: an estimate of what deflating leaves."""
    signed = residual.view(np.int32)
    size = signed ^ (signed >> 31)  # half the zigzag code, rounded down
    used = np.count_nonzero(residual)
    for bits in (7, 15, 23):
        more = np.count_nonzero(size >= np.int32(1 << bits))
        if not more:
            break
        used += more
    return int(used)


def _planes(residual: np.ndarray) -> bytes:
    """Return the zigzag code of signed differences, small ones of either sign small, as byte planes by channel."""
    signed = residual.view(np.int32)
    code = ((signed << 1) ^ (signed >> 31)).astype("<i4", copy=False)
    return code.view(np.uint8).reshape(-1, residual.shape[-1], 4).transpose(2, 1, 0)[::-1].tobytes()
