"""Images of a program under test: every format that is read, as other programs write it, cut short, and broken."""

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.subjects.image_files import read_hdr, read_pfm, read_png, take_back
from tests.reports.judge.scenes import SCENE

WIDTH, HEIGHT = SCENE.camera.width, SCENE.camera.height
RANDOM = np.random.default_rng(55)
RADIANCE = RANDOM.uniform(0, 1, (HEIGHT, WIDTH, 3))


def test_a_signalling_nan_is_a_nan_like_others(tmp_path):
    # Found by the fuzz campaign: its conversion to float64 warns, and in the judge's tests warnings are errors.
    bits = np.full((HEIGHT, WIDTH), 0x7FA00001, dtype=np.uint32).view(np.float32)
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, dict.fromkeys("RGB", bits)).write(str(tmp_path / "image.exr"))

    taken = take_back(tmp_path / "image.exr", SCENE, most=10**8)

    assert np.isnan(taken.images[Stage.RADIANCE]).all()


def exr(path: Path, channels: dict[str, np.ndarray], data: tuple[int, int], display: tuple[int, int, int, int]) -> None:
    """Write an EXR whose data window begins at `data` and whose display window has these corners."""
    height, width = next(iter(channels.values())).shape
    left, top, right, bottom = display
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "dataWindow": (np.array(data, np.int32), np.array((data[0] + width - 1, data[1] + height - 1), np.int32)),
        "displayWindow": (np.array((left, top), np.int32), np.array((right, bottom), np.int32)),
    }
    OpenEXR.File(header, {name: np.ascontiguousarray(image) for name, image in channels.items()}).write(str(path))


@pytest.mark.parametrize("shift", [(0, 0), (1, 0), (0, -1), (WIDTH // 2, -HEIGHT // 2), (WIDTH, 0)])
@pytest.mark.parametrize("origin", [(0, 0), (-7, 11)])
def test_a_data_window_is_placed_in_the_display_window(tmp_path: Path, shift: tuple[int, int], origin) -> None:
    image = RADIANCE.astype(np.float32)
    left, top = origin
    channels = {name: image[..., index] for index, name in enumerate("RGB")}
    channels["object.V"] = channels["face.V"] = np.ones((HEIGHT, WIDTH), dtype=np.uint32)
    channels["distance.V"] = np.ones((HEIGHT, WIDTH), dtype=np.float16)
    display = (left, top, left + WIDTH - 1, top + HEIGHT - 1)
    exr(tmp_path / "image.exr", channels, (left + shift[0], top + shift[1]), display)

    images = take_back(tmp_path / "image.exr", SCENE, most=10**8).images

    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    written = (columns >= shift[0]) & (columns < shift[0] + WIDTH) & (rows >= shift[1]) & (rows < shift[1] + HEIGHT)
    moved = np.roll(image.astype(np.float64), (shift[1], shift[0]), axis=(0, 1))
    assert np.array_equal(images[Stage.RADIANCE], np.where(written[..., np.newaxis], moved, 0.0))
    for stage in (Stage.OBJECT, Stage.DISTANCE):
        missed = FACTS[stage].miss
        assert np.array_equal(images[stage], np.where(written[..., np.newaxis], np.ones_like(images[stage]), missed))


def test_an_image_of_another_display_window_is_refused(tmp_path: Path) -> None:
    image = np.ones((HEIGHT, WIDTH), dtype=np.float32)
    exr(tmp_path / "image.exr", dict.fromkeys("RGB", image), (0, 0), (0, 0, 2 * WIDTH - 1, HEIGHT - 1))

    with pytest.raises(ValueError, match=f"it is {2 * WIDTH} x {HEIGHT} px by its display window"):
        take_back(tmp_path / "image.exr", SCENE, most=10**8)


@pytest.mark.parametrize("end", [b"\n", b" ", b"\r\n"])
@pytest.mark.parametrize("first", [0x41200000, 0x0A0A0A0A, 0x0000000A])
def test_a_pfm_header_may_end_in_any_white_space(end: bytes, first: int) -> None:
    pixels = np.arange(2 * 3 * 3, dtype="<f4")
    pixels.view("<u4")[0] = first
    content = end.join((b"PF", b"3 2", b"-1.0")) + end + pixels.tobytes()

    assert np.array_equal(read_pfm(content, width=3, height=2)[::-1].ravel(), pixels.astype(np.float64))
    with pytest.raises(ValueError, match="bytes of pixels"):
        read_pfm(content[:-1], width=3, height=2)


def rgbe(image: np.ndarray) -> np.ndarray:
    """Return an image in Radiance's four bytes a pixel, cut off as Radiance does."""
    largest = image.max(axis=-1)
    exponents = np.frexp(largest)[1]
    mantissas = np.floor(np.ldexp(image, 8 - exponents[..., np.newaxis]))
    pixels = np.concatenate([mantissas, exponents[..., np.newaxis] + 128], axis=-1)
    return np.where(largest[..., np.newaxis] > 0, pixels, 0).astype(np.uint8)


def picture(pixels: np.ndarray, *, packed: bool) -> bytes:
    """Return a Radiance picture, run-length encoded or plain."""
    height, width, _ = pixels.shape
    rows = []
    for row in pixels:
        if not packed:
            rows.append(row.tobytes())
            continue
        rows.append(struct.pack(">BBH", 2, 2, width))
        for channel in range(4):
            values, place = row[:, channel].tolist(), 0
            while place < width:
                count = 1
                while place + count < width and count < 127 and values[place + count] == values[place]:
                    count += 1
                rows.append(bytes([128 + count, values[place]]) if count > 1 else bytes([1, values[place]]))
                place += count
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return head.encode() + b"".join(rows)


@pytest.mark.parametrize("packed", [False, True])
def test_a_radiance_picture_is_read_within_its_steps(packed: bool) -> None:
    image = RANDOM.uniform(0, 1, (9, 40, 3)) ** 8 * 1000
    image[2:4] = 0
    image[5, 3:30] = (3.0, 0.0, 0.25)

    read, steps = read_hdr(picture(rgbe(image), packed=packed), width=40, height=9)

    assert (np.abs(read - image) <= steps).all()
    assert (read[2:4] == 0).all()
    assert (
        steps[~(image == 0).all(axis=-1)].max(axis=-1) <= image.max(axis=-1)[~(image == 0).all(axis=-1)] / 128
    ).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda content: content[:-1], "cut short|longer than its row"),
        (lambda content: content + b"0", "1 bytes after its last row"),
        (lambda content: content.replace(b"rgbe", b"xyze"), "FORMAT=32-bit_rle_rgbe"),
        (lambda content: content.replace(b"\n\n", b"\nEXPOSURE=2\n\n"), "EXPOSURE"),
        (lambda content: content.replace(b"+X", b"-X"), "-Y HEIGHT"),
        (lambda content: content.replace(b"+X 4", b"+X 5"), "50 x 9 px, not 40 x 9"),
    ],
)
@pytest.mark.parametrize("packed", [False, True])
def test_a_radiance_picture_that_is_broken_is_refused(change, said: str, packed: bool) -> None:
    content = picture(rgbe(np.full((9, 40, 3), 0.75)), packed=packed)

    with pytest.raises(ValueError, match=said):
        read_hdr(change(content), width=40, height=9)


def png(
    codes: np.ndarray, filters: list[int], *chunks: tuple[bytes, bytes], kind: int = 2, interlaced: int = 0
) -> bytes:
    """Return a PNG of `codes` (height, width, channels), uint8 or uint16, with a filter for each row in turn."""
    height, width, channels = codes.shape
    size = channels * codes.dtype.itemsize
    rows = (
        np.frombuffer(codes.astype(codes.dtype.newbyteorder(">")).tobytes(), np.uint8).reshape(height, -1).astype(int)
    )
    packed = b""
    for number, row in enumerate(rows):
        above = rows[number - 1] if number else np.zeros_like(row)
        left, corner = (np.concatenate([np.zeros(size, int), each[:-size]]) for each in (row, above))
        guess = left + above - corner
        near = np.stack([np.abs(guess - each) for each in (left, above, corner)])
        paeth = np.choose(near.argmin(axis=0), [left, above, corner])
        kind_of_row = filters[number % len(filters)]
        predicted = [np.zeros_like(row), left, above, (left + above) // 2, paeth][kind_of_row]
        packed += bytes([kind_of_row]) + ((row - predicted) % 256).astype(np.uint8).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8 * codes.dtype.itemsize, kind, 0, 0, interlaced)
    parts = [(b"IHDR", header), *chunks, (b"IDAT", zlib.compress(packed)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts
    )


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("filters", [[0], [1], [2], [3], [4], [4, 3, 2, 1, 0]])
def test_every_filter_of_a_png_is_undone(kind: type, filters: list[int]) -> None:
    codes = RANDOM.integers(0, np.iinfo(kind).max + 1, (7, 11, 3), dtype=kind)

    read, deepest, _ = read_png(png(codes, filters), width=11, height=7)

    assert np.array_equal(read, codes / deepest)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (png(np.zeros((2, 3, 1), np.uint8), [0], kind=3), "a palette in 8 bits"),
        (png(np.zeros((2, 3, 3), np.uint8), [0], interlaced=1), "interlaced"),
        (png(np.zeros((2, 3, 3), np.uint8), [0])[:-20], "cut short|checksum"),
        (png(np.zeros((2, 3, 3), np.uint8), [0]).replace(b"IDAT", b"IDAU"), "checksum"),
        (png(np.zeros((3, 2, 3), np.uint8), [0]), "2 x 3 px, not 3 x 2"),
    ],
)
def test_a_png_that_cannot_be_used_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_png(content, width=3, height=2)


def encoded(image: np.ndarray, curve: str | float) -> np.ndarray:
    """Return light encoded by a transfer curve."""
    if curve == "srgb":
        return np.where(image <= 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
    return image if curve == "linear" else image ** (1 / float(curve))


@pytest.mark.parametrize("curve", ["linear", "srgb", 1.8])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("by_file", [False, True])
def test_the_transfer_curve_is_undone_within_its_steps(tmp_path: Path, curve, kind: type, by_file: bool) -> None:
    deepest = np.iinfo(kind).max
    codes = np.rint(encoded(RADIANCE, curve) * deepest).astype(kind)
    gamma = {"linear": 1.0, 1.8: 1 / 1.8}.get(curve, 0)
    chunks = [(b"gAMA", struct.pack(">I", round(gamma * 100_000)))] if gamma else [(b"sRGB", b"\0")]
    (tmp_path / "image.png").write_bytes(png(codes, [0], *(chunks if by_file else [])))

    taken = take_back(tmp_path / "image.png", SCENE, most=10**8, transfer="" if by_file else curve)

    coarse = taken.resolutions[Stage.RADIANCE]
    off = np.abs(taken.images[Stage.RADIANCE] - RADIANCE)
    assert (off <= coarse.step(RADIANCE) * (1 + 1e-4) + 2e-5 * by_file).all()
    assert coarse.absolute == coarse.step(RADIANCE).max()
    assert off.max() > coarse.absolute / 4, "else the step is far from what it takes"


def test_an_encoded_exr_is_decoded(tmp_path: Path) -> None:
    image = encoded(RADIANCE, 2.2).astype(np.float32)
    OpenEXR.File({}, {name: np.ascontiguousarray(image[..., index]) for index, name in enumerate("RGB")}).write(
        str(tmp_path / "image.exr")
    )

    taken = take_back(tmp_path / "image.exr", replace(SCENE, lights=()), most=10**8, transfer=2.2)

    assert np.allclose(taken.images[Stage.RADIANCE], RADIANCE, rtol=1e-6)
    assert taken.resolutions[Stage.RADIANCE].absolute < 1e-6
