"""Float images as text that a browser decodes without a library: bit for bit, and small.

Each image becomes byte planes, highest byte first, deflated (RFC 1950) and in base64; `DecompressionStream` undoes it.
An image close to another one (two renderers of one stage) is stored as the zigzag-coded difference of their bits, of
which deflate leaves little: a quarter of the size for images that differ by roundings. html/decode.js is the inverse.
"""

import base64
import zlib
from typing import Any

import numpy as np

LEVEL = 6


def encode(image: np.ndarray, base: np.ndarray | None = None) -> dict[str, Any]:
    """Return a float32 image (height, width, channels), as it is or against `base`, as plain JSON data.

    Raises:
        ValueError: the image is not float32, or `base` has another shape.

    """
    if image.dtype != np.float32 or (base is not None and base.dtype != np.float32):
        raise ValueError(f"images to embed must be float32, got {image.dtype}")
    bits = np.ascontiguousarray(image).view(np.uint32)
    if base is not None:
        if base.shape != image.shape:
            raise ValueError(f"an image of shape {image.shape} cannot be stored against one of {base.shape}")
        difference = (bits - np.ascontiguousarray(base).view(np.uint32)).view(np.int32)
        bits = ((difference << 1) ^ (difference >> 31)).view(np.uint32)
    planes = bits.reshape(-1).astype(">u4").view(np.uint8).reshape(-1, 4).T
    packed = base64.b64encode(zlib.compress(planes.tobytes(), LEVEL)).decode("ascii")
    return {"channels": image.shape[-1], "against": base is not None, "data": packed}


def pack_text(text: str) -> str:
    """Return text deflated and in base64."""
    return base64.b64encode(zlib.compress(text.encode("utf-8", errors="replace"), LEVEL)).decode("ascii")
