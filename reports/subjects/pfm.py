"""Portable float maps: three float32 channels, rows from the bottom up.

Source: Debevec, "PFM Portable FloatMap Image Format" (2001).
"""

import re

import numpy as np

MAGIC = b"PF"
_HEADER = re.compile(rb"PF\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?[0-9.eE+-]{1,20})\s")


def read_pfm(content: bytes, *, width: int, height: int) -> np.ndarray:
    """Return the image (height, width, 3), row 0 at the top.

    Raises:
        ValueError: it is no colour PFM of this size, or holds more or less than its header says.

    """
    header = _HEADER.match(content)
    if header is None:
        raise ValueError("it begins like a PFM but has no header of one: PF, width and height, scale")
    size = (int(header[1]), int(header[2]))
    if size != (width, height):
        raise ValueError(f"it is {size[0]} x {size[1]} px, not {width} x {height}")
    try:
        scale = float(header[3])
    except ValueError:
        scale = 0.0
    if scale not in (1.0, -1.0):
        raise ValueError(f"its scale must be -1.0 (little-endian) or 1.0, got {header[3].decode(errors='replace')}")
    pixels = content[header.end() :]
    if len(pixels) != width * height * 12:
        raise ValueError(f"it holds {len(pixels)} bytes of pixels, not {width * height * 12}")
    image = np.frombuffer(pixels, dtype="<f4" if scale < 0 else ">f4").reshape(height, width, 3)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN like others
        return image[::-1].astype(np.float64)
