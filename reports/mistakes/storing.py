"""Mistakes of storing: right values in wrong places, with a wrong curve, in too few bits, or not at all (IMG-1)."""

from collections.abc import Callable

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.analytic import Freedom, Samples
from rayproof.reports.mistakes import Family, Mistake, family, known, variant
from rayproof.reports.mistakes.light import srgb

NOTHING = -1  # the source of a place to which no value is written
IMG = "IMG-1"
Source = Callable[[int, int], np.ndarray]  # (height, width) -> index of the pixel at each place, (height, width)


class Placed(Mistake):
    """Pixels are stored in wrong places of the file."""

    def source(self, height: int, width: int) -> np.ndarray:
        """Return the index of the pixel that is stored at each place, (height, width); `NOTHING` for none."""
        raise NotImplementedError

    def _at(self, scene: Scene, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        width, height = scene.camera.width, scene.camera.height
        pixel = np.clip(np.floor(points).astype(int), 0, (width - 1, height - 1))
        return self.source(height, width)[pixel[:, 1], pixel[:, 0]], points - pixel

    def image_points(self, scene: Scene, points: np.ndarray) -> np.ndarray:
        """Return the image points (N, 2) [px] of the pixels that are stored at the points' places."""
        source, within = self._at(scene, points)
        row, column = np.divmod(np.maximum(source, 0), scene.camera.width)
        return within + np.stack([column, row], axis=1)

    def image(self, scene: Scene, stage: Stage, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the values, 0 for pixels without a stored value."""
        lost = self._at(scene, points)[0] == NOTHING
        return np.where(lost[:, np.newaxis], 0.0, super().image(scene, stage, values, points))


def _places(height: int, width: int) -> np.ndarray:
    return np.arange(height * width).reshape(height, width)


def _inside(pixels: np.ndarray) -> np.ndarray:
    return np.where((pixels >= 0) & (pixels < pixels.size), pixels, NOTHING)


def _late(by: Callable[[int], int], *, around: bool) -> Source:
    return lambda h, w: (_places(h, w) - by(w)) % (h * w) if around else _inside(_places(h, w) - by(w))


Stride = Callable[[int, int], int]


def _written_by(stride: Stride) -> Source:
    """Return the map of an image whose rows are written at a stride, and read at its width; later rows overwrite."""

    def source(height: int, width: int) -> np.ndarray:
        pixels = np.full(height * width, NOTHING)
        for row in range(height):
            there = row * stride(height, width) + np.arange(width)
            pixels[there[there < height * width]] = row * width + np.flatnonzero(there < height * width)
        return pixels.reshape(height, width)

    return source


def _read_by(stride: Stride) -> Source:
    """Return the map of an image whose rows are written at its width, and read at a stride."""
    return lambda h, w: _inside(np.arange(h)[:, np.newaxis] * stride(h, w) + np.arange(w))


def _padded(to: int) -> Stride:
    return lambda _, width: -(-width // to) * to


STRIDES: tuple[Stride, ...] = (
    lambda height, _: height,
    *(_padded(to) for to in (4, 8, 16, 32, 64)),
    lambda _, width: width + 1,
    lambda _, width: width - 1,
    lambda _, width: width + 2,
)


def _placed(name: str, sentence: str, *sources: Source) -> None:
    for number, source in enumerate(sources):
        made = type(f"{name}_{number}", (Placed,), {"source": lambda _, h, w, source=source: source(h, w)})
        (variant(name) if number else known(name, sentence, IMG))(made)


_placed(
    "columns_first",
    "writes its image column by column",
    lambda h, w: _places(h, w) % h * w + _places(h, w) // h,
    lambda h, w: _places(h, w) % w * h + _places(h, w) // w,
)
_placed(
    "row_stride",
    "takes another distance between its image's rows in memory than there is",
    *(way(stride) for way in (_written_by, _read_by) for stride in STRIDES),
)
_placed(
    "one_place_off",
    "writes each pixel of its image one place too early or too late",
    *(
        _late(by, around=around)
        for around in (False, True)
        for by in (lambda _: 1, lambda _: -1, lambda w: w, lambda w: -w)
    ),
)


class RadianceElsewhere(Mistake):
    """Radiance is stored in wrong places, the other stages in the right ones."""

    of_several_stages = True

    def moved(self, width: int, height: int, points: np.ndarray) -> np.ndarray:
        """Return the image points (N, 2) [px] whose radiance is stored at `points` (N, 2)."""
        raise NotImplementedError

    def samples(
        self, scene: Scene, points: np.ndarray, last: Stage, freedom: Freedom | None = None, *, by_light: bool = False
    ) -> Samples:
        """Return the samples, with the radiance of the moved points."""
        samples = super().samples(scene, points, last, freedom, by_light=by_light)
        if last is Stage.RADIANCE:
            there = self.moved(scene.camera.width, scene.camera.height, np.asarray(points, dtype=np.float64))
            samples.rows[last] = super().samples(scene, there, last, freedom).rows[last]
        return samples


for _name, _sentence, _moved in (
    (
        "stages_mirrored",
        "writes radiance with each row from right to left, other stages rightly",
        lambda _, w, h, p: p * (-1, 1) + (w, 0),
    ),
    (
        "stages_upside_down",
        "writes radiance with the bottom row first, other stages rightly",
        lambda _, w, h, p: p * (1, -1) + (0, h),
    ),
    (
        "stages_turned_half",
        "writes radiance turned by 180 degrees, other stages rightly",
        lambda _, w, h, p: (w, h) - p,
    ),
):
    known(_name, _sentence, IMG)(type(_name, (RadianceElsewhere,), {"moved": _moved}))


class Coded(Mistake):
    """Values of some stages are stored with a curve, or in another type of numbers."""

    stages: tuple[Stage, ...] = (Stage.RADIANCE,)

    def coded(self, values: np.ndarray) -> np.ndarray:
        """Return the stored values."""
        raise NotImplementedError

    def image(self, scene: Scene, stage: Stage, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the stored values of a stage."""
        right = super().image(scene, stage, values, points)
        if stage not in self.stages:
            return right
        with np.errstate(all="ignore"):
            return self.coded(right)


def _coded(
    name: str, sentence: str, *curves: Callable[[np.ndarray], np.ndarray], stages: tuple[Stage, ...] = (Stage.RADIANCE,)
) -> None:
    for number, curve in enumerate(curves):
        steps = {"coded": lambda _, values, curve=curve: curve(values), "stages": stages}
        (variant(name) if number else known(name, sentence, IMG))(type(f"{name}_{number}", (Coded,), steps))


def _bytes(values: np.ndarray) -> np.ndarray:
    return np.floor(255 * np.clip(values, 0, 1) + 0.5) / 255


def _cut(values: np.ndarray) -> np.ndarray:
    return np.floor(255 * np.clip(values, 0, 1)) / 255


def _swapped(values: np.ndarray) -> np.ndarray:
    return np.asarray(values, dtype=np.float32).byteswap().astype(np.float64)


def _half(values: np.ndarray) -> np.ndarray:
    return np.asarray(values).astype(np.float16).astype(np.float64)


def _wrapped(steps: int, *, half: float, one: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: np.mod(np.floor(steps * values + half), steps + 1) * (one / steps)


_coded("srgb", "writes radiance in sRGB instead of linearly", srgb)
_coded("clamped", "clamps radiance to 1", lambda values: np.minimum(values, 1.0))
_coded("srgb_clamped", "writes radiance in sRGB, clamped to 1", lambda values: srgb(np.clip(values, 0, 1)))
_coded("eight_bits", "rounds radiance to 8 bits, between 0 and 1", _bytes)
_coded("eight_bits_cut", "cuts radiance off to 8 bits, between 0 and 1", _cut)
_coded("srgb_eight_bits", "writes radiance as sRGB of 8 bits", lambda values: _bytes(srgb(np.clip(values, 0, 1))))
_coded(
    "srgb_eight_bits_cut",
    "writes radiance as sRGB, cut off to 8 bits",
    lambda values: _cut(srgb(np.clip(values, 0, 1))),
)
_coded(
    "wrapped",
    "writes radiance in whole numbers that begin again at 0 beyond the largest of their type",
    *(_wrapped(steps, half=half, one=1.0) for steps in (255, 65535) for half in (0.5, 0.0)),
    *(_wrapped(255, half=half, one=255.0) for half in (0.5, 0.0)),
)
_coded("exposed", "maps radiance to 1 - exp(-L)", lambda values: 1 - np.exp(-values))
_coded("bgr", "writes blue for red and red for blue", lambda values: values[:, ::-1])
_coded("grb", "writes green for red and red for green", lambda values: values[:, [1, 0, 2]])
_coded("red_alone", "writes the red channel into all", lambda values: values[:, :1] * np.ones(3))
_coded(
    "radiance_mean", "writes the mean of the channels", lambda values: values.mean(axis=1, keepdims=True) * np.ones(3)
)
_coded("bytes_swapped", "writes the bytes of its floats in the other order", _swapped, stages=IMAGE_STAGES)
_coded("half_floats", "writes 16-bit floats, of which what is larger than 65504 is none", _half, stages=IMAGE_STAGES)
_coded(
    "shapes_from_1",
    "counts shapes from 1",
    lambda values: np.where(values >= 0, np.add(values, (1, 0)), values),
    stages=(Stage.OBJECT,),
)


@family("gamma", "writes radiance with a gamma of {0} instead of linearly", IMG, starts=[(0.4, 0.7, 1.4, 1.8, 2.4)])
class Gamma(Family, Coded):
    """L^(1/g), where the parameter is g."""

    def coded(self, values: np.ndarray) -> np.ndarray:
        """Return the values to the power 1/g."""
        return np.maximum(values, 0) ** (1 / self.numbers[0])


def wrapped_ids(bits: int, *, of: int, signed: bool) -> Callable[[np.ndarray], np.ndarray]:
    """Return the storing of ids (N, 2) as integers of `bits` bits; `of` is 0 for the ids of shapes and 1 for faces."""
    count = 1 << bits

    def coded(values: np.ndarray) -> np.ndarray:
        stored = values.copy()
        low = -count // 2 if signed else 0
        stored[:, of] = np.where(values[:, of] >= 0, (values[:, of] - low) % count + low, values[:, of])
        return stored

    return coded


for _bits in (8, 15, 16):
    _coded(
        f"ids_in_{_bits}_bits",
        f"stores the numbers of shapes or faces in {_bits} bits, so that greater ones wrap around",
        *(wrapped_ids(_bits, of=of, signed=signed) for of in (0, 1) for signed in (False, True)),
        stages=(Stage.OBJECT,),
    )


@known("black", "writes a black image", IMG)
class Black(Mistake):
    """Radiance is 0."""

    def leaving(self, scene: Scene, exitance: np.ndarray) -> np.ndarray:
        """Return 0."""
        return 0 * np.nan_to_num(exitance)


def undrawn(parts: dict[tuple[int, int], np.ndarray], blank: dict[Stage, np.ndarray], words: str) -> type[Mistake]:
    """Return the mistake of leaving parts of images at their initial values.

    `parts` maps the size (height, width) of an image to a mask of its undrawn pixels, and `blank` a stage to their
    value. `words` names the parts in the mistake's sentence.
    """

    def image(self: Mistake, scene: Scene, stage: Stage, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        where = parts.get((scene.camera.height, scene.camera.width))
        if where is None:
            return values
        column, row = np.clip(np.floor(points).astype(int), 0, np.subtract(where.shape[::-1], 1)).T
        return np.where(where[row, column, np.newaxis], blank.get(stage, 0.0), values)

    made = type("Undrawn", (Mistake,), {"image": image})
    made.name, made.items = "undrawn", (IMG,)
    made.sentence = f"leaves {words} of its images undrawn"
    return made


known("undrawn", "leaves whole strips or tiles of its images undrawn", IMG)(
    type(
        "UndrawnQuarter",
        (Placed,),
        {"source": lambda _, h, w: np.where(_places(h, w) < 3 * h * w // 4, _places(h, w), NOTHING)},
    )
)
