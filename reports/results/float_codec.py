"""Float images as text for a browser, bit for bit: predictions, zigzag differences, byte planes, deflate, base64.

What is stored is the difference of bits to a prediction from what the reader has already, zigzag-coded, and where that
is smaller its second difference along the rows: smooth images are near a parabola. Channel by channel, in byte planes
from the highest byte down, deflated and in base64; `DecompressionStream` undoes the deflating and html/floats.js the
rest. Each prediction is float32, computed by IEEE operations that Python and JavaScript round alike (html/floats.js is
the same code for browsers), so that adding the stored difference gives back every bit. Where a prediction is not finite
it is 0: a NaN made by arithmetic has no bits of its own that both would agree on.
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
Factors = dict[str, list[float]]  # by object, of each channel

# A stage that is an earlier one times a constant per object: M = albedo E, L = M / pi.
TIMES = {Stage.EXITANCE: Stage.IRRADIANCE, Stage.RADIANCE: Stage.EXITANCE}

BY_LIGHTS = (Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY)  # that E takes, beside the scene's lights


class Prediction(TypedDict, total=False):
    """How an image is foretold, and what that takes; the rest is left out."""

    by: Required[str]  # "nothing", "base", "factors", "pinhole", "ray" or "lights"
    of: str  # the stage that is multiplied
    factors: Factors
    rays: list[list[float]]
    eye: list[float]
    lights: list[list[float]]


class Drafted(Prediction):
    """A prediction, and whether its residual is stored as its second difference along the rows."""

    curved: bool


class Encoded(Drafted):
    """An image: how it is foretold, and the deflated residual in base64."""

    channels: int
    data: str


class Stored(Encoded):
    """An image with its size."""

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
) -> Iterator[tuple[Prediction, np.ndarray]]:
    """Yield each way to foretell `own[stage]`: how, as plain JSON data, and the float32 prediction.

    `own` holds the renderer's stages, `base` those of the renderer that all are compared with, if it is another one.
    `eye` is the camera's (3), m; `rays` its `pinhole`, where the camera is known; `lights` are the scene's
    `intensities`. `tables` keeps the factors that were found, for the other renderers of the same scene.
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
        shapes = [own[one].shape for one in BY_LIGHTS if one in own]
        if shapes == [image.shape, image.shape, (*image.shape[:2], len(lights))]:
            yield {"by": "lights", "lights": lights}, lit(own, lights)


def predicted(how: Stored, stage: Stage, own: Images, base: Images | None) -> np.ndarray | None:
    """Return the prediction that `how` names, or None where it is 0 everywhere."""
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
    """Return what the renderer that all are compared with found, which finds the same albedos; without it, the own."""
    known = own if base is None else base
    if any(one not in known or known[one].shape != own[one].shape for one in (stage, source, Stage.OBJECT)):
        return factors(own[stage], own[source], own[Stage.OBJECT])
    if stage not in tables:
        tables[stage] = factors(known[stage], known[source], known[Stage.OBJECT])
    return tables[stage]


def factors(image: np.ndarray, source: np.ndarray, objects: np.ndarray) -> Factors:
    """Return the median of image / source of each object by channel, float32: the albedo, or 1 / pi."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.ascontiguousarray((image.astype(np.float64) / source).reshape(-1, image.shape[-1]).T)
    known, numbers = np.isfinite(ratio), objects[..., 0].ravel()
    table: Factors = {}
    for index in np.unique(numbers):
        here = numbers == index
        medians = _medians(ratio[:, here], known[:, here])
        with np.errstate(over="ignore"):
            rounded = np.nan_to_num(medians.astype(np.float32), posinf=0.0, neginf=0.0)
        table[_key(index)] = [float(value) for value in rounded]
    return table


def _medians(rows: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return each row's median of what is `known` in it, 0 where nothing is."""
    if known.any() and (known == known[0]).all():
        return np.median(rows[:, known[0]], axis=1)
    return np.asarray([np.median(row[there]) if there.any() else 0.0 for row, there in zip(rows, known, strict=True)])


def times(source: np.ndarray, objects: np.ndarray, table: Mapping[str, list[float]]) -> np.ndarray:
    """Return source times its object's factors, rounded to float32 once."""
    numbers = objects[..., 0]
    found = np.unique(numbers)
    scales = np.array([table.get(_key(index), [0.0] * source.shape[-1]) for index in found])
    with np.errstate(over="ignore", invalid="ignore"):
        scale = scales[np.searchsorted(found, numbers)]
        return _finite((source.astype(np.float64) * scale).astype(np.float32))


def pinhole(camera: Any) -> list[list[float]] | None:
    """Return the direction to the corner (0, 0) of an image and the steps to the next column and row.

    `camera` is a scene file's. None where it describes no view.
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
    found = np.stack([corner, across, down])
    return found.tolist() if found.shape == (3, 3) and np.isfinite(found).all() else None


def through(rays: list[list[float]], height: int, width: int) -> np.ndarray:
    """Return the unit directions through the pixel centres, in float64 rounded to float32 once; not to be changed."""
    return _through(tuple(map(tuple, rays)), height, width)


@lru_cache(maxsize=4)  # the renderers of a case share its camera
def _through(rays: tuple[tuple[float, ...], ...], height: int, width: int) -> np.ndarray:
    corner, across, down = np.asarray(rays, np.float64)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    # Term by term and product by product: the order in which the browser will round.
    d = [(corner[i] + x * across[i]) + y * down[i] for i in range(3)]
    with np.errstate(all="ignore"):
        length = np.sqrt((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2])
        directions = _finite(np.stack([one / length for one in d], axis=-1).astype(np.float32))
    directions.setflags(write=False)
    return directions


def along(ray: np.ndarray, distance: np.ndarray, eye: Any) -> np.ndarray:
    """Return eye + t d, in float64 rounded to float32 once; 0 where the ray hits nothing."""
    with np.errstate(over="ignore", invalid="ignore"):
        point = np.asarray(eye, np.float64) + distance.astype(np.float64) * ray.astype(np.float64)
        return _finite(point.astype(np.float32))


def intensities(scene: Any) -> list[list[float]] | None:
    """Return each light's position [m] and intensity by channel [W/sr] of a scene file; None where it tells none."""
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
    """Return the sum of I cos / d^2 over the lights that are seen, in float64 rounded to float32 once."""
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
    """Return an object index as text: JavaScript's text of the same number, where it is one."""
    return str(int(index)) if np.isfinite(index) and index == int(index) else "other"


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
