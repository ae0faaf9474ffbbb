"""Mistakes of surfaces and of how radiance is written: RAD-4."""

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.diagnosis import MISTAKES, Fit, Given, Mistake, Way, Wrong
from rayproof.reports.judge.answers import dot


def _radiance(name: str, says: str, *wrong: Wrong, item: str = "RAD-4", fit: Fit | None = None) -> None:
    ways = tuple(Way(stages={Stage.RADIANCE: one}) for one in wrong)
    MISTAKES.register(name)(Mistake(says=says, items=(item,), ways=ways, fit=fit))


def _written(name: str, says: str, *wrong: Wrong, fit: Fit | None = None) -> None:
    """Register right radiance that is written by a curve or in other numbers."""
    _radiance(name, says, *wrong, item="IMG-1", fit=fit)


def _exitance(name: str, says: str, wrong: Wrong) -> None:
    MISTAKES.register(name)(Mistake(says=says, items=("RAD-4",), ways=(Way(stages={Stage.EXITANCE: wrong}),)))


def _albedo(given: Given) -> np.ndarray:
    table = np.array([*(shape.albedo for shape in given.scene.shapes), (0.0, 0.0, 0.0)])
    return table[given.answers[Stage.OBJECT][..., 0].astype(int)]


def srgb(linear: np.ndarray) -> np.ndarray:
    """Return the sRGB curve of linear values. Source: IEC 61966-2-1."""
    with np.errstate(invalid="ignore"):
        curved = 1.055 * np.power(np.maximum(linear, 0), 1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curved)


def _bytes(value: np.ndarray) -> np.ndarray:
    return np.floor(255 * np.clip(value, 0, 1) + 0.5) / 255


def _cut(value: np.ndarray) -> np.ndarray:
    return np.floor(255 * np.clip(value, 0, 1)) / 255


def _wrapped(steps: int, *, half: float, written: float) -> Wrong:
    """Return whole numbers of so many steps without those that the type does not hold, as `written` has one of 1."""
    return lambda given: np.mod(np.floor(steps * given.right + half), steps + 1) * (written / steps)


def _gammas(scene: Scene, right: StageImages, ours: StageImages) -> np.ndarray:
    if Stage.RADIANCE not in ours:
        return np.zeros(0)
    with np.errstate(all="ignore"):
        curve = np.log(right[Stage.RADIANCE]) / np.log(ours[Stage.RADIANCE])
    usable = np.isfinite(curve) & (np.abs(np.log(np.maximum(right[Stage.RADIANCE], 1e-300))) > 0.2)
    return curve[usable]


def _gamma(given: Given) -> np.ndarray:
    return np.power(np.maximum(given.right, 0), 1 / given.parameter)


def _seen_from_behind(given: Given) -> np.ndarray:
    scale = 1.0 if given.scene.shading == "simplified" else 1 / np.pi
    return given.answers[Stage.EXITANCE] * scale


def _hidden_in_front(given: Given) -> np.ndarray:
    hidden = dot(given.answers[Stage.NORMAL], given.answers[Stage.RAY]) < 0
    return np.where(hidden[..., np.newaxis], 0.0, _seen_from_behind(given))


_radiance(
    "no_pi",
    "leaves out 1/pi between exitance and radiance",
    lambda given: given.right if given.scene.shading == "simplified" else np.pi * given.right,
)
_radiance(
    "pi_in_simplified",
    "divides by pi under the simplified light, too",
    lambda given: given.right / np.pi if given.scene.shading == "simplified" else given.right,
)
_radiance("back_seen", "shows one-sided surfaces from behind", _seen_from_behind)
_radiance("front_hidden", "shows one-sided surfaces from behind and hides their front", _hidden_in_front)
_written(
    "gamma",
    "writes radiance with a gamma of {0} instead of linearly",
    _gamma,
    fit=Fit(samples=_gammas, nothing=1.0),
)
_written("srgb", "writes radiance in sRGB instead of linearly", lambda given: srgb(given.right))
_written("clamped", "clamps radiance to 1", lambda given: np.minimum(given.right, 1.0))
_written("srgb_clamped", "writes radiance in sRGB, clamped to 1", lambda given: srgb(np.clip(given.right, 0, 1)))
_written("eight_bits", "rounds radiance to 8 bits, between 0 and 1", lambda given: _bytes(given.right))
_written("eight_bits_cut", "cuts radiance off to 8 bits, between 0 and 1", lambda given: _cut(given.right))
_written("srgb_eight_bits", "writes radiance as sRGB of 8 bits", lambda given: _bytes(srgb(np.clip(given.right, 0, 1))))
_radiance(
    "srgb_eight_bits_cut",
    "writes radiance as sRGB, cut off to 8 bits",
    lambda given: _cut(srgb(np.clip(given.right, 0, 1))),
)
_written(
    "wrapped",
    "writes radiance in whole numbers that begin again at 0 beyond the largest of their type",
    *(_wrapped(steps, half=half, written=1.0) for steps in (255, 65535) for half in (0.5, 0.0)),
    *(_wrapped(255, half=half, written=255.0) for half in (0.5, 0.0)),
)
MISTAKES.register("bgr")(
    Mistake(
        says="writes blue for red and red for blue",
        items=("IMG-1",),
        ways=tuple(
            Way(stages={stage: lambda given: given.right[..., ::-1]}) for stage in (Stage.RADIANCE, Stage.EXITANCE)
        ),
    )
)
_exitance("no_albedo", "leaves the albedo out", lambda given: given.answers[Stage.IRRADIANCE])
_exitance("albedo_squared", "multiplies by the albedo twice", lambda given: _albedo(given) * given.right)
_exitance(
    "albedo_bgr",
    "takes the albedo's channels in the order blue, green, red",
    lambda given: _albedo(given)[..., ::-1] * given.answers[Stage.IRRADIANCE],
)
_exitance(
    "albedo_of_first",
    "takes the first shape's albedo for all",
    lambda given: np.where(
        given.answers[Stage.OBJECT][..., :1] >= 0,
        np.asarray(given.scene.shapes[0].albedo) * given.answers[Stage.IRRADIANCE] if given.scene.shapes else 0.0,
        0.0,
    ),
)
