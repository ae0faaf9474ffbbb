"""Reading of the images that programs write: OpenEXR, PFM, Radiance HDR and PNG, with the resolution of their values.

Sources: OpenEXR file layout (Academy Software Foundation); Debevec, "PFM Portable FloatMap Image Format", 2001; Ward,
"Real Pixels", Graphics Gems II, 1991, and the Radiance reference for RGBE pictures; ISO/IEC 15948:2004 for PNG;
IEC 61966-2-1 for the sRGB transfer curve.
"""

import ctypes
import io
import os
import re
import stat
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import FACTS, IMAGE_STAGES, Resolution, Stage, exr_channels

Transfer = str | float  # "linear", "srgb", or the exponent of a power curve; "" if the file specifies it
FORMATS = ("exr", "pfm", "hdr", "png")
CLIPPED = frozenset({"png"})  # formats whose largest value is 1
LINEAR, SRGB = "linear", "srgb"
PFM_MAGIC = b"PF"
_HEADER = re.compile(rb"PF\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?[0-9.eE+-]{1,20})(\s)")
EXR_MAGIC = b"\x76\x2f\x31\x01"
HDR_MAGIC = b"#?"
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
MOST_CHANNELS = 256
HALF = Resolution(relative=2.0**-11, absolute=2.0**-25, because="written as half: 11 bits, at least 2^-24 apart")
# The resolution of a file of float32 whose values a program computed as float64.
FLOAT = Resolution(relative=2.0**-24, absolute=2.0**-150, because="written as float: each value rounded once")
_VISIBILITY = re.compile(r"visibility\.\d+")


@dataclass(frozen=True, kw_only=True)
class Taken:
    """The stages in an image file, float64 (height, width, channels), and the resolution of coarse stages."""

    images: dict[Stage, np.ndarray]
    resolutions: dict[Stage, Resolution]
    lacking: dict[Stage, str] = field(default_factory=dict)  # stage with missing channels -> a sentence on them


class UnfitError(ValueError):
    """An image that is readable but not valid for the scene."""


def take_back(path: Path, scene: Scene, *, most: int, transfer: Transfer = "") -> Taken:
    """Read a program's image of `scene` at `path`, of at most `most` bytes.

    `transfer` is the curve by which radiance was encoded; if it is "", a PNG file specifies it, and others are linear.

    Raises:
        ValueError: there is no image, or it is invalid; the message is a sentence with the reason.

    """
    try:
        facts = os.lstat(path)
    except OSError:
        raise ValueError(f"it wrote no image to {path.name}") from None
    if not stat.S_ISREG(facts.st_mode):
        raise ValueError(f"it made of {path.name} something that is no regular file")
    if facts.st_size > most:
        raise ValueError(f"its image has {facts.st_size} bytes, more than {most}")
    with path.open("rb") as file:
        magic = file.read(8)
    width, height = scene.camera.width, scene.camera.height
    if magic[:4] == EXR_MAGIC:
        return _decoded(_sorted(_exr(path, width=width, height=height), lights=len(scene.lights)), transfer)
    if magic[:2] == PFM_MAGIC:
        image = read_pfm(path.read_bytes(), width=width, height=height)
        return _decoded(Taken(images={Stage.RADIANCE: image}, resolutions={}), transfer)
    if magic[:2] == HDR_MAGIC:
        image, steps = read_hdr(path.read_bytes(), width=width, height=height)
        coarse = stepped(steps, because="written as RGBE: a step of the pixel's largest channel")
        return _decoded(Taken(images={Stage.RADIANCE: image}, resolutions={Stage.RADIANCE: coarse}), transfer)
    if magic == PNG_MAGIC:
        codes, deepest, own = read_png(path.read_bytes(), width=width, height=height)
        curve = transfer or own
        image, steps = linear(codes, curve, step=0.5 / deepest)
        because = f"written in {deepest + 1} steps, {_curve_in_words(curve)}"
        return Taken(images={Stage.RADIANCE: image}, resolutions={Stage.RADIANCE: stepped(steps, because=because)})
    formats = "neither OpenEXR, PFM, Radiance HDR nor PNG"
    raise ValueError(f"its image is {formats}: it has {facts.st_size} bytes and begins {magic!r}")


def stepped(steps: np.ndarray, *, because: str) -> Resolution:
    """Return the resolution of values with a step each; its `absolute` is the largest step."""
    return Resolution(relative=0.0, absolute=float(steps.max(initial=0.0)), because=because, steps=steps)


def linear(codes: np.ndarray, transfer: Transfer, *, step: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the linear values of encoded values, and their largest change by `step` of the code; shapes of `codes`."""
    step = np.broadcast_to(np.asarray(step, dtype=np.float64), codes.shape)
    if transfer == LINEAR:
        return codes, step.copy()
    light = _light(codes, transfer)
    # The curves are convex, so that the upper end of the step has the larger change.
    with np.errstate(invalid="ignore"):
        return light, np.maximum(_light(codes + step, transfer) - light, light - _light(codes - step, transfer))


def _light(codes: np.ndarray, transfer: Transfer) -> np.ndarray:
    """Return the linear values of encoded values; the curve is odd."""
    size, sign = np.abs(codes), np.sign(codes)
    if transfer == SRGB:
        return sign * np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    assert isinstance(transfer, float)
    return sign * size**transfer


def _curve_in_words(transfer: Transfer) -> str:
    return {LINEAR: "linear", SRGB: "by the sRGB curve"}.get(str(transfer), f"by a gamma of {transfer}")


def _decoded(taken: Taken, transfer: Transfer) -> Taken:
    """Return the image with linear radiance and its resolution, that of float32 unless the file's is coarser."""
    if transfer in ("", LINEAR) or Stage.RADIANCE not in taken.images:
        return taken
    codes = taken.images[Stage.RADIANCE]
    coarse = taken.resolutions.get(Stage.RADIANCE, FLOAT)
    image, steps = linear(codes, transfer, step=coarse.step(codes))
    because = f"{coarse.because}, {_curve_in_words(transfer)}"
    resolutions = taken.resolutions | {Stage.RADIANCE: stepped(steps, because=because)}
    return Taken(images=taken.images | {Stage.RADIANCE: image}, resolutions=resolutions, lacking=taken.lacking)


def read_pfm(content: bytes, *, width: int, height: int) -> np.ndarray:
    """Return the image of a PFM file (height, width, 3), row 0 at the top; the header's lines may end in CR LF.

    Raises:
        ValueError: the file is no colour PFM of this size, or its data is too long or too short.

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
    if header[4] == b"\r":
        pixels = pixels.removeprefix(b"\n")
    if len(pixels) != width * height * 12:
        raise ValueError(f"it holds {len(pixels)} bytes of pixels, not {width * height * 12}")
    image = np.frombuffer(pixels, dtype="<f4" if scale < 0 else ">f4").reshape(height, width, 3)
    with np.errstate(invalid="ignore"):  # signalling NaN are treated as other NaN
        return image[::-1].astype(np.float64)


# Radiance HDR: a text header, a line with the size, and scan lines of four bytes per pixel, each plain or run-length
# encoded. A pixel (r, g, b, e) is (r, g, b) 2^(e - 136), or black if e is 0.

_PICTURE_SIZE = re.compile(rb"-Y (\d{1,6}) \+X (\d{1,6})\n")
# Radiance truncates the mantissa and reads the centre of its interval, other programs round it: a value with the code m
# is in [m - 0.5, m + 1). These are the interval's centre, relative to m, and half its width.
RGBE_MIDDLE, RGBE_STEP = 0.25, 0.75


def read_hdr(content: bytes, *, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a Radiance picture and the largest rounding error of each value, both (height, width, 3).

    Raises:
        ValueError: the file is no picture of this size in RGBE, or is truncated.

    """
    head, _, rest = content.partition(b"\n\n")
    lines = [line.strip() for line in head.split(b"\n")]
    if b"FORMAT=32-bit_rle_rgbe" not in lines:
        raise ValueError("it begins like a Radiance picture but its header does not say FORMAT=32-bit_rle_rgbe")
    if any(line.startswith((b"EXPOSURE=", b"COLORCORR=")) for line in lines):
        raise ValueError("it has an EXPOSURE or COLORCORR in its header, by which its values would have to be divided")
    size = _PICTURE_SIZE.match(rest)
    if size is None:
        raise ValueError("its size must read -Y HEIGHT +X WIDTH, with row 0 at the top")
    if (int(size[2]), int(size[1])) != (width, height):
        raise ValueError(f"it is {int(size[2])} x {int(size[1])} px, not {width} x {height}")
    data, place = np.frombuffer(rest, dtype=np.uint8), size.end()
    rows = np.zeros((height, width, 4), dtype=np.uint8)
    for row in rows:
        place = _hdr_row(data, place, row)
    if place != len(data):
        raise ValueError(f"it holds {len(data) - place} bytes after its last row")
    mantissas, exponents = rows[..., :3].astype(np.float64), rows[..., 3:].astype(np.int32)
    unit = np.where(exponents > 0, np.ldexp(1.0, exponents - 136), 0.0)
    return (mantissas + RGBE_MIDDLE) * unit, np.broadcast_to(RGBE_STEP * unit, mantissas.shape)


def _hdr_row(data: np.ndarray, place: int, row: np.ndarray) -> int:
    """Fill `row` (width, 4) from the bytes at `place`, and return the place of the next row."""
    width = len(row)
    start = data[place : place + 4].tolist()
    if len(start) < 4:
        raise ValueError("it is cut short")
    if start[:2] != [2, 2] or start[2] * 256 + start[3] != width or not 8 <= width < 2**15:
        flat = data[place : place + 4 * width]
        if len(flat) < 4 * width:
            raise ValueError("it is cut short")
        row[:] = flat.reshape(width, 4)
        # Three bytes of 1 are no normalised colour: they mark a run of the older encoding.
        if bool((row[:, :3] == 1).all(axis=1).any()):
            raise ValueError("its rows are run-length encoded in the way of before 1991, which is not read")
        return place + 4 * width
    place += 4
    for channel in range(4):
        column = 0
        while column < width:
            if place + 1 >= len(data):
                raise ValueError("it is cut short")
            count = int(data[place])
            run = count > 128
            count -= 128 if run else 0
            piece = data[place + 1 : place + 2 if run else place + 1 + count]
            if not 0 < count <= width - column or len(piece) < (1 if run else count):
                raise ValueError("a run of it is longer than its row, or empty")
            row[column : column + count, channel] = piece
            column, place = column + count, place + 1 + len(piece)
    return place


# PNG: chunks of length, name, content and CRC; the pixels are filtered row by row and compressed together.

_PNG_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}  # colour type -> channels; type 3 is a palette
_PNG_TYPES = {0: "grey", 2: "RGB", 4: "grey with alpha", 6: "RGB with alpha"}


def read_png(content: bytes, *, width: int, height: int) -> tuple[np.ndarray, int, Transfer]:
    """Return the codes (height, width, 3) scaled to 0 to 1, the file's largest code, and the file's transfer curve.

    Alpha is ignored. The curve is sRGB unless there is a gAMA chunk and no sRGB chunk.

    Raises:
        ValueError: the file is no PNG of this size in 8 or 16 bits, or is truncated or damaged.

    """
    header, packed, gamma, standard = b"", [], 0, False
    for name, data in _chunks(content):
        if name == b"IHDR":
            header = data
        elif name == b"IDAT":
            packed.append(data)
        elif name == b"gAMA" and len(data) == 4:
            gamma = int.from_bytes(data, "big")
        elif name == b"sRGB":
            standard = True
    if len(header) != 13:
        raise ValueError("it is a PNG without the header of one")
    columns, rows, bits, kind, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    if (columns, rows) != (width, height):
        raise ValueError(f"it is {columns} x {rows} px, not {width} x {height}")
    if kind not in _PNG_CHANNELS or bits not in (8, 16) or interlaced:
        raise ValueError(
            "it must be a PNG in 8 or 16 bits of grey or RGB, without palette and not interlaced, got "
            f"{_PNG_TYPES.get(kind, 'a palette')} in {bits} bits{', interlaced' if interlaced else ''}"
        )
    channels = _PNG_CHANNELS[kind]
    length = columns * channels * bits // 8
    unpacker = zlib.decompressobj()
    try:
        raw = unpacker.decompress(b"".join(packed), rows * (length + 1) + 1)
    except zlib.error as error:
        raise ValueError(f"it is a broken PNG: {error}") from None
    if len(raw) != rows * (length + 1):
        raise ValueError(f"it is a PNG with {len(raw)} bytes of pixels, not {rows * (length + 1)}")
    lines = _unfiltered(np.frombuffer(raw, np.uint8).reshape(rows, length + 1), channels * bits // 8)
    codes = np.frombuffer(lines.tobytes(), ">u2" if bits == 16 else np.uint8).reshape(rows, columns, channels)
    colour = codes[..., :3] if channels >= 3 else codes[..., :1].repeat(3, axis=-1)
    own: Transfer = SRGB if standard or not gamma else LINEAR if gamma == 100_000 else 100_000 / gamma
    return colour.astype(np.float64) / (2**bits - 1), 2**bits - 1, own


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the name and the content of each chunk of a PNG file."""
    place = len(PNG_MAGIC)
    while place + 12 <= len(content):
        (length,) = struct.unpack_from(">I", content, place)
        name, data = content[place + 4 : place + 8], content[place + 8 : place + 8 + length]
        stored = content[place + 8 + length : place + 12 + length]
        if len(stored) < 4 or zlib.crc32(name + data) != int.from_bytes(stored, "big"):
            raise ValueError("it is a PNG that is cut short or broken: a checksum is not that of its chunk")
        yield name, data
        if name == b"IEND":
            return
        place += 12 + length
    raise ValueError("it is a PNG that is cut short")


def _unfiltered(rows: np.ndarray, size: int) -> np.ndarray:
    """Undo the filters of rows, which are in their first bytes; `size` is the number of bytes per pixel."""
    pixels = rows[:, 1:].copy()
    above = np.zeros(pixels.shape[1], dtype=np.uint8)
    for kind, row in zip(rows[:, 0].tolist(), pixels, strict=True):
        if kind == 1:
            row[:] = np.cumsum(row.reshape(-1, size), axis=0, dtype=np.uint8).ravel()
        elif kind == 2:
            row += above
        elif kind in (3, 4):
            row[:] = _predicted(row.tolist(), above.tolist(), size, paeth=kind == 4)
        elif kind != 0:
            raise ValueError(f"it is a broken PNG: a row has the filter {kind}")
        above = row
    return pixels


def _predicted(row: list[int], above: list[int], size: int, *, paeth: bool) -> list[int]:
    """Return a row by adding to each byte its prediction from the left and the upper neighbours."""
    for place, stored in enumerate(row):
        left, corner = (row[place - size], above[place - size]) if place >= size else (0, 0)
        up = above[place]
        if paeth:
            along, down, across = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            guess = left if along <= down and along <= across else up if down <= across else corner
        else:
            guess = (left + up) // 2
        row[place] = (stored + guess) & 255
    return row


def _exr(path: Path, *, width: int, height: int) -> dict[str, np.ndarray]:
    """Return an OpenEXR image's channels in the display window; the header is validated before pixels are read.

    Pixels of the display window outside of the data window were not rendered: they get the values of a miss, or NaN in
    channels without such a value.
    """
    import OpenEXR

    try:
        with _silence():
            with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
                parts = len(file.parts)
                windows = [file.header()[name] for name in ("dataWindow", "displayWindow")]
                named = {channel.name: (channel.xSampling, channel.ySampling) for channel in file.header()["channels"]}
            data, display = ([tuple(int(number) for number in corner) for corner in window] for window in windows)
            size = (display[1][0] - display[0][0] + 1, display[1][1] - display[0][1] + 1)
            stored = (data[1][0] - data[0][0] + 1, data[1][1] - data[0][1] + 1)
            if size != (width, height):
                by = "" if size == stored else " by its display window"
                raise UnfitError(f"it is {size[0]} x {size[1]} px{by}, not {width} x {height}")
            if stored[0] * stored[1] > 4 * width * height:
                raise UnfitError(
                    f"its data window has {stored[0]} x {stored[1]} px, for an image of {width} x {height}"
                )
            if parts != 1 or len(named) > MOST_CHANNELS or any(step != (1, 1) for step in named.values()):
                raise UnfitError(f"it must be one part of at most {MOST_CHANNELS} channels, none of them subsampled")
            with OpenEXR.File(str(path), separate_channels=True) as file:
                channels: dict[str, np.ndarray] = {name: channel.pixels for name, channel in file.channels().items()}
    except UnfitError:
        raise
    except (RuntimeError, ValueError, KeyError, TypeError) as error:
        why = (str(error).splitlines() or [type(error).__name__])[0]
        message = why.replace(f"{path.parent}{os.sep}", "").strip()
        raise ValueError(f"its image is cut short or broken (OpenEXR says: {message})") from None
    column, row = (data[0][axis] - display[0][axis] for axis in (0, 1))
    if (column, row, *stored) == (0, 0, width, height):
        return channels
    return {name: _placed(pixels, column, row, (height, width), _missed(name)) for name, pixels in channels.items()}


def _placed(pixels: np.ndarray, column: int, row: int, size: tuple[int, int], missed: float) -> np.ndarray:
    """Return an image of `size` (height, width) with `pixels` at (column, row), and the value `missed` elsewhere."""
    # Unsigned integers have neither NaN nor -1.
    wide = pixels.dtype.kind in "ui" and not missed >= 0
    image = np.full(size, missed, dtype=np.float64 if wide else pixels.dtype)
    top, left = max(0, row), max(0, column)
    bottom, right = min(size[0], row + pixels.shape[0]), min(size[1], column + pixels.shape[1])
    if top < bottom and left < right:
        image[top:bottom, left:right] = pixels[top - row : bottom - row, left - column : right - column]
    return image


def _missed(channel: str) -> float:
    """Return the value of a channel where a ray hits nothing; NaN if the stage has no such value."""
    stage = next((stage for stage in IMAGE_STAGES if channel in FACTS[stage].channels), Stage.VISIBILITY)
    missed = FACTS[stage].miss
    return np.nan if missed is None else missed


def _sorted(channels: dict[str, np.ndarray], *, lights: int) -> Taken:
    """Return the stages among the channels; channels that the specification does not name are ignored."""
    images: dict[Stage, np.ndarray] = {}
    resolutions: dict[Stage, Resolution] = {}
    lacking: dict[Stage, str] = {}
    for stage in IMAGE_STAGES:
        names = exr_channels(stage, lights=lights)
        present = [name for name in names if name in channels]
        if stage is Stage.VISIBILITY:
            present += [name for name in channels if _VISIBILITY.fullmatch(name) and name not in names]
        if not present:
            continue
        if set(present) != set(names):
            lacking[stage] = f"its {stage} has the channels {', '.join(present)}, not {', '.join(names) or 'none'}"
            continue
        kinds = {channels[name].dtype for name in names}
        with np.errstate(invalid="ignore"):  # signalling NaN are treated as other NaN
            images[stage] = np.stack([channels[name].astype(np.float64) for name in names], axis=-1)
        if np.dtype(np.float16) in kinds:
            resolutions[stage] = HALF
    if not images and lacking:
        raise ValueError(next(iter(lacking.values())))
    if not images:
        raise ValueError(f"its channels are {', '.join(sorted(channels)[:8]) or 'none'}; none of them is a stage's")
    return Taken(images=images, resolutions=resolutions, lacking=lacking)


@contextmanager
def _silence() -> Iterator[None]:
    """Suppress the output of a library in C and Python; its exceptions are sufficient."""
    flush = ctypes.CDLL(None).fflush  # C buffers its output, and would print it later
    flush(None)
    kept = [(number, os.dup(number)) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number, _ in kept:
            os.dup2(nowhere, number)
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    finally:
        flush(None)
        for number, copy in kept:
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
