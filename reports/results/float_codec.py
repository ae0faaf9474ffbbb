"""Lossless coding of float images as text for a browser: predictions, zigzag code, byte planes, deflate, base64.

Each image is predicted from images that the reader has decoded already. The residual, the difference of the bits to the
prediction, is stored in zigzag code, or its second difference along the rows if that is smaller: smooth images are
nearly parabolic. It is stored per channel, in byte planes from the highest byte to the lowest, deflated and in base64;
`DecompressionStream` inflates it, and html/floats.js decodes the rest. Each prediction is float32, computed by IEEE
operations that Python and JavaScript round alike (html/floats.js is the same code for browsers), so that adding the
residual restores every bit. Predictions that are not finite are replaced by 0, since the bits of a computed NaN differ
between platforms.
"""

import base64
import math
import zlib
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any, Required, TypedDict

import numpy as np

from rayproof.cases.placement import frame
from rayproof.cases.stages import Stage
from rayproof.reports.results.files import as_json, legible_json

Images = Mapping[Stage, np.ndarray]  # of one renderer, float32 (height, width, channels)
Factors = dict[str, list[float]]  # object -> factor of each channel

# Stages that are an earlier stage times a constant per object: M = albedo E, L = M / pi.
TIMES = {Stage.EXITANCE: Stage.IRRADIANCE, Stage.RADIANCE: Stage.EXITANCE}

BY_LIGHTS = (Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)  # the stages that, with the lights, determine E


class EncodedImage(TypedDict, total=False):
    """An encoded image: the method of prediction, its parameters, and the residual (absent in a mere prediction)."""

    by: Required[str]  # "nothing", "base", "factors", "pinhole", "ray" or "lights"
    of: str  # the stage that is multiplied
    factors: Factors
    rays: list[list[float]]
    eye: list[float]
    lights: list[list[float]]
    curved: bool  # whether the residual is stored as its second difference along the rows
    channels: int
    data: str  # the deflated residual in base64
    height: int
    width: int


def predictions(
    stage: Stage,
    own: Images,
    base: Images | None,
    eye: tuple[float, float, float],
    rays: list[list[float]] | None = None,
    tables: dict[Stage, Factors] | None = None,
    lights: list[list[float]] | None = None,
) -> Iterator[tuple[EncodedImage, np.ndarray]]:
    """Yield each possible prediction of `own[stage]`: its method, as plain JSON data, and the float32 prediction.

    `own` contains the renderer's images, `base` the images of the base renderer, with which all are compared, or None
    for the base renderer itself. `eye` (3) is the camera's position [m], `rays` its `pinhole`, or None, `lights` are
    the scene's `intensities`. `tables` caches the computed factors for the other renderers of the same scene.
    """
    image = own[stage]
    yield {"by": "nothing"}, np.zeros_like(image)
    if base is not None and stage in base and base[stage].shape == image.shape:
        yield {"by": "base"}, base[stage]
    source = TIMES.get(stage)
    if source is not None and source in own and Stage.OBJECT in own and own[source].shape == image.shape:
        table = _factors(stage, source, own, base, {} if tables is None else tables)
        yield {"by": "factors", "of": source.value, "factors": table}, times(own[source], own[Stage.OBJECT], table)
    if stage is Stage.RAY and rays is not None:
        yield {"by": "pinhole", "rays": rays}, through(rays, image.shape[0], image.shape[1])
    if stage is Stage.POSITION and {Stage.RAY, Stage.DISTANCE} <= set(own):
        yield {"by": "ray", "eye": list(eye)}, along(own[Stage.RAY], own[Stage.DISTANCE], eye)
    if stage is Stage.IRRADIANCE and base is None and lights:
        shapes = [own[input_stage].shape for input_stage in BY_LIGHTS if input_stage in own]
        if shapes == [image.shape, image.shape, (*image.shape[:2], len(lights))]:
            yield {"by": "lights", "lights": lights}, lit(own, lights)


def predicted(how: EncodedImage, stage: Stage, own: Images, base: Images | None) -> np.ndarray | None:
    """Return the prediction that `how` describes, or None if it is 0 everywhere."""
    if how["by"] == "base":
        assert base is not None
        return base[stage]
    if how["by"] == "factors":
        return times(own[Stage(how["of"])], own[Stage.OBJECT], how["factors"])
    if how["by"] == "pinhole":
        return through(how["rays"], how["height"], how["width"])
    if how["by"] == "lights":
        return lit(own, how["lights"])
    return along(own[Stage.RAY], own[Stage.DISTANCE], how["eye"]) if how["by"] == "ray" else None


def _factors(stage: Stage, source: Stage, own: Images, base: Images | None, tables: dict[Stage, Factors]) -> Factors:
    """Return the cached factors of the base renderer, which has the same albedos; if that is impossible, its own."""
    images = own if base is None else base
    if any(
        needed not in images or images[needed].shape != own[needed].shape for needed in (stage, source, Stage.OBJECT)
    ):
        return factors(own[stage], own[source], own[Stage.OBJECT])
    if stage not in tables:
        tables[stage] = factors(images[stage], images[source], images[Stage.OBJECT])
    return tables[stage]


def factors(image: np.ndarray, source: np.ndarray, objects: np.ndarray) -> Factors:
    """Return the median of image / source per object and channel, rounded to float32: the albedo, or 1 / pi."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.ascontiguousarray((image.astype(np.float64) / source).reshape(-1, image.shape[-1]).T)
    finite, numbers = np.isfinite(ratio), objects[..., 0].ravel()
    table: Factors = {}
    for index in np.unique(numbers):
        here = numbers == index
        medians = _medians(ratio[:, here], finite[:, here])
        with np.errstate(over="ignore"):
            rounded = np.nan_to_num(medians.astype(np.float32), posinf=0.0, neginf=0.0)
        table[_key(index)] = [float(value) for value in rounded]
    return table


def _medians(rows: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Return the median of each row's values where `valid` is true, 0 for rows without such values."""
    if valid.any() and (valid == valid[0]).all():
        return np.median(rows[:, valid[0]], axis=1)
    return np.asarray([np.median(row[there]) if there.any() else 0.0 for row, there in zip(rows, valid, strict=True)])


def times(source: np.ndarray, objects: np.ndarray, table: Mapping[str, list[float]]) -> np.ndarray:
    """Return the source image times the factors of each pixel's object, rounded to float32 once."""
    numbers = objects[..., 0]
    indices = np.unique(numbers)
    scales = np.array([table.get(_key(index), [0.0] * source.shape[-1]) for index in indices])
    with np.errstate(over="ignore", invalid="ignore"):
        scale = scales[np.searchsorted(indices, numbers)]
        return _finite((source.astype(np.float64) * scale).astype(np.float32))


def pinhole(camera: Any) -> list[list[float]] | None:
    """Return the direction to the corner (0, 0) of the image and the steps to the next column and row, (3, 3).

    `camera` is the camera of a scene file. None if it describes no view.
    """
    try:
        eye, target, up = (np.array([float(v) for v in camera[name]]) for name in ("eye", "target", "up"))
        width, height, fovy = int(camera["width"]), int(camera["height"]), float(camera["fovy"])
    except (KeyError, TypeError, ValueError):
        return None
    with np.errstate(all="ignore"):
        right, above, forward = frame(eye, target, up)
        step = 2 * np.tan(np.radians(fovy) / 2) / height
        across, down = step * right, -step * above
        corner = forward - width / 2 * across - height / 2 * down
    directions = np.stack([corner, across, down])
    return directions.tolist() if directions.shape == (3, 3) and np.isfinite(directions).all() else None


def through(rays: list[list[float]], height: int, width: int) -> np.ndarray:
    """Return the unit directions through the pixel centres, read-only, computed in float64, rounded once to float32."""
    return _through(tuple(map(tuple, rays)), height, width)


@lru_cache(maxsize=4)  # the renderers of a case share its camera
def _through(rays: tuple[tuple[float, ...], ...], height: int, width: int) -> np.ndarray:
    corner, across, down = np.asarray(rays, np.float64)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    # In this order of operations the browser rounds alike.
    d = [(corner[i] + x * across[i]) + y * down[i] for i in range(3)]
    with np.errstate(all="ignore"):
        length = np.sqrt((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2])
        directions = _finite(np.stack([component / length for component in d], axis=-1).astype(np.float32))
    directions.setflags(write=False)
    return directions


def along(ray: np.ndarray, distance: np.ndarray, eye: Any) -> np.ndarray:
    """Return eye + t d, computed in float64, rounded once to float32; 0 where the ray hits nothing."""
    with np.errstate(over="ignore", invalid="ignore"):
        point = np.asarray(eye, np.float64) + distance.astype(np.float64) * ray.astype(np.float64)
        return _finite(point.astype(np.float32))


def intensities(scene: Any) -> list[list[float]] | None:
    """Return each light's position [m] and intensity per channel [W/sr] (6 numbers) in a scene file.

    None if the file has no valid lights or its lights do not follow the inverse square law.
    """
    try:
        if scene.get("shading", "inverse_square") != "inverse_square":
            return None
        lights = [
            (*map(float, light["position"]), *(float(f) / (4 * math.pi) for f in light["flux"]))
            for light in scene["lights"]
        ]
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        return None
    return [[*light] for light in lights] if all(len(x) == 6 and np.isfinite(x).all() for x in lights) else None


def lit(own: Images, lights: list[list[float]]) -> np.ndarray:
    """Return the sum of I cos / d^2 over the visible lights, computed in float64, rounded once to float32."""
    point, normal = (np.moveaxis(own[stage].astype(np.float64), -1, 0) for stage in BY_LIGHTS[:2])
    total = np.zeros((3, *point.shape[1:]))
    with np.errstate(all="ignore"):
        for number, light in enumerate(lights):
            d = [light[i] - point[i] for i in range(3)]
            squared = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]
            cosine = ((normal[0] * d[0] + normal[1] * d[1]) + normal[2] * d[2]) / np.sqrt(squared)
            share = np.where((own[Stage.VISIBILITY][..., number] > 0) & (cosine > 0), cosine / squared, 0.0)
            for channel in range(3):
                total[channel] = total[channel] + light[3 + channel] * share
        return _finite(np.stack([*total], axis=-1).astype(np.float32))


def _finite(image: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(image), image, np.float32(0))


def _key(index: float) -> str:
    """Return an object index as text, equal to JavaScript's text of the number; "other" if it is no integer."""
    return str(int(index)) if np.isfinite(index) and index == int(index) else "other"


LEVEL = 6  # of zlib

Draft = tuple[int, EncodedImage, np.ndarray]  # estimated size [bytes], method of prediction, residual


def encode(image: np.ndarray, predictions: Iterable[tuple[EncodedImage, np.ndarray]]) -> EncodedImage:
    """Return a float32 image (height, width, channels) as plain JSON data, by the prediction with the least residual.

    Raises:
        ValueError: the image is not float32, or a prediction has another shape or type.

    """
    if image.dtype != np.float32:
        raise ValueError(f"images to embed must be float32, got {image.dtype}")
    how, residual = _least(_drafts(image, predictions))
    return {"channels": image.shape[-1], **how, "data": pack(_planes(residual))}


def _drafts(image: np.ndarray, predictions: Iterable[tuple[EncodedImage, np.ndarray]]) -> Iterator[Draft]:
    """Yield drafts of the encoded image: estimated size [bytes], method and residual; the cheapest to compute first."""
    bits = _bits(image)
    waiting: list[tuple[EncodedImage, np.ndarray]] = []
    for how, prediction in predictions:
        if prediction.shape != image.shape or prediction.dtype != np.float32:
            raise ValueError(f"an image of shape {image.shape} cannot be stored against {prediction.shape}")
        residual = bits - _bits(prediction)
        if how["by"] == "nothing" and residual.any():
            waiting.append((how, residual))
        else:
            # The residual of a good prediction is rounding; its second difference is not smaller.
            yield _bytes_left(residual), {**how, "curved": False}, residual
    for how, residual in waiting:
        slope = _slope(residual)
        # A residual that repeats along the rows deflates to about the size of its differences.
        yield min(_bytes_left(residual), 2 * _bytes_left(slope)), {**how, "curved": False}, residual
        bend = _slope(slope)
        yield _bytes_left(bend), {**how, "curved": True}, bend


def _least(drafts: Iterable[Draft]) -> tuple[EncodedImage, np.ndarray]:
    """Return method and residual of the smallest draft; a draft without residual ends the search."""
    made: list[Draft] = []
    for bytes_left, how, residual in drafts:
        if not bytes_left:
            return how, residual
        made.append((bytes_left, how, residual))
    if not made:
        raise ValueError("an image needs a prediction, be it nothing")
    _, how, residual = min(made, key=lambda draft: draft[0])
    return how, residual


def decode(stored: EncodedImage, height: int, width: int, prediction: np.ndarray | None) -> np.ndarray:
    """Undo `encode`: return the float32 image (height, width, channels).

    Raises:
        ValueError: the data cannot be decoded to an image of this size.

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
    """Return the content of `data`, `size` bytes; no more is inflated.

    Raises:
        ValueError: the content has another size, or `data` cannot be decoded.

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
    """Deflate bytes and encode them in base64."""
    return base64.b64encode(zlib.compress(content, LEVEL)).decode("ascii")


def pack_text(text: str) -> str:
    """Deflate a text and encode it in base64."""
    return pack(text.encode("utf-8", errors="replace"))


def pack_json(content: Any) -> str:
    """Return data as JSON without control characters in its texts, deflated and in base64."""
    return pack_text(legible_json(as_json(content)))


def _bits(image: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(image).view(np.uint32)


def _slope(residual: np.ndarray) -> np.ndarray:
    """Return the differences along each row, modulo 2^32; the first is to 0."""
    slope = residual.copy()
    slope[:, 1:] -= residual[:, :-1]
    return slope


def _bytes_left(residual: np.ndarray) -> int:
    """Return the number of bytes that the zigzag code needs: an estimate of the deflated size."""
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
    """Return the zigzag code of signed differences (small for small differences of either sign), as byte planes."""
    signed = residual.view(np.int32)
    code = ((signed << 1) ^ (signed >> 31)).astype("<i4", copy=False)
    return code.view(np.uint8).reshape(-1, residual.shape[-1], 4).transpose(2, 1, 0)[::-1].tobytes()
