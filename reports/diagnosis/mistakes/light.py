"""Mistakes of falloff, cosine, sums over lights, albedo, exitance and written radiance (gamma, bytes): RAD-1 to RAD-5.

A mistake of light is a wrong sum over the lights that a point sees.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.diagnosis import MISTAKES, Fit, Given, Mistake, Way, Wrong
from rayproof.reports.judge.answers import dot

# From the squared distance [m^2], the cosine and the parameter to a number.
Strength = Callable[[np.ndarray, np.ndarray, float], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Share:
    """By how much more than it ought to a mistake lets each light bring."""

    physical: Strength | None = None
    simplified: Strength | None = None
    of: Callable[[int, int], float] | None = None  # from the light's place and how many there are
    cosine: Callable[[np.ndarray], np.ndarray] | None = None  # instead of what is clamped to zero
    parameter: float = 0.0


@dataclass(frozen=True)
class Lights:
    """Irradiance as a wrong sum over the lights that a point sees."""

    shares: tuple[Share, ...]

    def __call__(self, given: Given) -> np.ndarray:
        """Return irradiance, (height, width, 3)."""
        plain = given.scene.shading == "simplified"
        strengths = [
            (strength, share.parameter or given.parameter)
            for share in self.shares
            if (strength := share.simplified if plain else share.physical) is not None
        ]
        places = [share.of for share in self.shares if share.of is not None]
        cosines = [share.cosine for share in self.shares if share.cosine is not None]
        if not strengths and not places and not cosines:
            return given.right
        total, count = np.zeros_like(given.right), len(given.scene.lights)
        for column, light in enumerate(given.scene.lights):
            offset = np.asarray(light.position) - given.answers[Stage.POSITION]
            squared = dot(offset, offset)
            with np.errstate(all="ignore"):
                cosine = dot(given.answers[Stage.NORMAL], offset) / np.sqrt(squared)
                cosine = cosines[0](cosine) if cosines else np.clip(cosine, 0, None)
                value = cosine if plain else cosine / (4 * np.pi * squared)
                for strength, parameter in strengths:
                    value = value * strength(squared, cosine, parameter)
            lit = given.answers[Stage.VISIBILITY][..., column] > 0
            if not cosines:
                lit &= cosine > 0
            flux = math.prod(place(column, count) for place in places) * np.asarray(light.flux)
            total += np.where(lit, value, 0.0)[..., np.newaxis] * flux
        return total

    def followed_by(self, other: Wrong) -> Wrong | None:
        """Return both mistakes at once; None where the other is of another kind."""
        return Lights(self.shares + other.shares) if isinstance(other, Lights) else None

    def at(self, parameter: float) -> "Lights":
        """Return them with a parameter."""
        return Lights(tuple(replace(share, parameter=parameter) for share in self.shares))


def _sum(physical: Strength, *, simplified: Strength | None = None) -> Wrong:
    """Return irradiance with another strength of each light; the simplified light's stays, unless it is given."""
    return Lights((Share(physical=physical, simplified=simplified),))


def _irradiance(name: str, says: str, items: tuple[str, ...], wrong: Wrong, fit: Fit | None = None) -> None:
    MISTAKES.register(name)(Mistake(says=says, items=items, ways=(Way(stages={Stage.IRRADIANCE: wrong}),), fit=fit))


def lit_by_one(scene: Scene, right: StageImages) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the pixels that exactly one light lights, with its distance and its cosine there."""
    visible = right[Stage.VISIBILITY] > 0
    which = np.argmax(visible, axis=-1)
    sources = np.array([light.position for light in scene.lights], dtype=np.float64)[which]
    offset = sources - right[Stage.POSITION]
    distance = np.sqrt(dot(offset, offset))
    with np.errstate(all="ignore"):
        cosine = dot(right[Stage.NORMAL], offset) / distance
    return (np.count_nonzero(visible, axis=-1) == 1) & (cosine > 0.05), distance, cosine


def brightened(right: StageImages, ours: StageImages) -> np.ndarray:
    """Return by what factor each pixel is brighter than it ought to be, at the first stage of light that is given."""
    stage = next(one for one in (Stage.IRRADIANCE, Stage.RADIANCE) if one in ours)
    mine, theirs = ours[stage], right[stage]
    channel = np.argmax(theirs, axis=-1)[..., np.newaxis]
    mine, theirs = (np.take_along_axis(image, channel, axis=-1)[..., 0] for image in (mine, theirs))
    with np.errstate(all="ignore"):
        return np.where(theirs > 0, mine / theirs, np.nan)


def _exponents(scene: Scene, right: StageImages, ours: StageImages) -> np.ndarray:
    if scene.shading == "simplified":
        return np.zeros(0)
    one, distance, _ = lit_by_one(scene, right)
    with np.errstate(all="ignore"):  # of a pixel that hits nothing, or where the light itself is hit
        length = np.log(distance)
        found = 2 - np.log(brightened(right, ours)) / length
    return found[one & (np.abs(length) > 0.1) & np.isfinite(found)]


def _powers(scene: Scene, right: StageImages, ours: StageImages) -> np.ndarray:
    one, _, cosine = lit_by_one(scene, right)
    with np.errstate(all="ignore"):
        found = 1 + np.log(brightened(right, ours)) / np.log(cosine)
    return found[one & (cosine < 0.9) & np.isfinite(found)]


def _reaches(inner: int, outer: int) -> Callable[[Scene, StageImages, StageImages], np.ndarray]:
    """Return the samples of the distance [m] at which a window (1 - (r/R)^inner)^outer ends."""

    def samples(scene: Scene, right: StageImages, ours: StageImages) -> np.ndarray:
        if scene.shading == "simplified":
            return np.zeros(0)
        alone, distance, _ = lit_by_one(scene, right)
        with np.errstate(all="ignore"):
            rest = 1 - brightened(right, ours) ** (1 / outer)
            found = distance / rest ** (1 / inner)
        # So near to the light that the window is 1 to a hundredth, rounding says where it ends.
        return found[alone & (rest > 0.01) & (rest < 0.999) & np.isfinite(found)]

    return samples


def _first(scene: Scene) -> Scene:
    return replace(scene, lights=scene.lights[:1])


def _over_lights(change: Callable[[int, int], float]) -> Wrong:
    """Return irradiance with each light's flux times a factor that depends on its place among all."""
    return Lights((Share(of=change),))


def _shaded(model: str) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, shading=model)  # type: ignore[arg-type]


MISTAKES.register("simplified_for_physical")(
    Mistake(
        says="uses the lecture's simplified light where the physical one is asked for (no falloff, no 1/pi)",
        items=("RAD-3", "RAD-1"),
        ways=(Way(asked=_shaded("simplified")),),
    )
)
MISTAKES.register("physical_for_simplified")(
    Mistake(
        says="uses the physical light where the lecture's simplified one is asked for",
        items=("RAD-3",),
        ways=(Way(asked=_shaded("inverse_square")),),
    )
)
_irradiance(
    "no_four_pi",
    "leaves out the 4 pi of a point light (takes its flux for its intensity)",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: np.full_like(squared, 4 * np.pi)),
)
_irradiance(
    "two_pi",
    "spreads a light's flux over a half sphere, 2 pi instead of 4 pi",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: np.full_like(squared, 2.0)),
)
_irradiance(
    "pi_for_four_pi",
    "divides a light's flux by pi instead of 4 pi",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: np.full_like(squared, 4.0)),
)
_irradiance(
    "no_falloff",
    "leaves out the falloff 1/r^2",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: squared),
)
_irradiance(
    "neither_falloff_nor_four_pi",
    "leaves out 1/(4 pi r^2) but not 1/pi",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: 4 * np.pi * squared),
)
_irradiance(
    "linear_falloff",
    "lets light fall off with 1/r instead of 1/r^2",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: np.sqrt(squared)),
)
_irradiance(
    "linear_falloff_without_four_pi",
    "lets light fall off with 1/r and leaves out 4 pi",
    ("RAD-1",),
    _sum(lambda squared, cosine, _: 4 * np.pi * np.sqrt(squared)),
)
_irradiance(
    "falloff_exponent",
    "lets light fall off with the distance to the power of -{0} instead of -2",
    ("RAD-1",),
    _sum(lambda squared, cosine, power: squared ** (1 - power / 2)),
    Fit(samples=_exponents, nothing=2.0),
)
_WINDOWS = (("(1 - (r/R)^4)^2", 4, 2), ("(1 - (r/R)^2)^2", 2, 2), ("(1 - r/R)^2", 1, 2), ("1 - r/R", 1, 1))
for _number, (_form, _inner, _outer) in enumerate(_WINDOWS):
    _irradiance(
        f"light_range_{_number + 1}",
        f"lets lights end at R = {{0}} m, by a window {_form} beside the falloff",
        ("RAD-1",),
        _sum(
            lambda squared, cosine, reach, inner=_inner, outer=_outer: (
                np.clip(1 - (np.sqrt(squared) / reach) ** inner, 0, None) ** outer
            )
        ),
        Fit(samples=_reaches(_inner, _outer), nothing=math.inf),
    )
_irradiance(
    "no_cosine",
    "leaves out the cosine between normal and light",
    ("RAD-2",),
    _sum(lambda squared, cosine, _: 1 / cosine, simplified=lambda squared, cosine, _: 1 / cosine),
)
_irradiance(
    "cosine_squared",
    "multiplies by the cosine twice",
    ("RAD-2",),
    _sum(lambda squared, cosine, _: cosine, simplified=lambda squared, cosine, _: cosine),
)
_irradiance(
    "cosine_power",
    "takes the cosine to the power of {0}",
    ("RAD-2",),
    _sum(
        lambda squared, cosine, power: cosine ** (power - 1),
        simplified=lambda squared, cosine, power: cosine ** (power - 1),
    ),
    Fit(samples=_powers, nothing=1.0),
)
_irradiance(
    "first_light", "adds up the first light alone", ("RAD-5", "LIT-1"), _over_lights(lambda i, n: float(i == 0))
)
_irradiance(
    "last_light", "keeps the last light alone", ("RAD-5", "LIT-1"), _over_lights(lambda i, n: float(i == n - 1))
)
_irradiance(
    "last_light_left_out",
    "leaves the last light out",
    ("RAD-5", "LIT-1"),
    _over_lights(lambda i, n: float(i < n - 1)),
)
_irradiance(
    "last_of_several_left_out",
    "leaves the last of several lights out",
    ("RAD-5", "LIT-1"),
    _over_lights(lambda i, n: float(i < n - 1 or n == 1)),
)
_irradiance(
    "mean_of_lights", "takes the mean of the lights instead of their sum", ("RAD-5",), _over_lights(lambda i, n: 1 / n)
)
_irradiance(
    "lights_clamped",
    "clamps the sum of the lights to 1",
    ("RAD-5", "RAD-3"),
    lambda given: np.minimum(given.right, 1.0),
)

PHRASES = {
    math.pi: "pi",
    1 / math.pi: "1/pi",
    4 * math.pi: "4 pi",
    1 / (4 * math.pi): "1/(4 pi)",
    2 * math.pi: "2 pi",
    1 / (2 * math.pi): "1/(2 pi)",
    math.pi / 2: "pi/2",
    2 / math.pi: "2/pi",
    math.pi**2: "pi^2",
    1 / math.pi**2: "1/pi^2",
    2.0: "2",
    0.5: "1/2",
    4.0: "4",
    0.25: "1/4",
    3.0: "3",
    1 / 3: "1/3",
    10.0: "10",
    0.1: "1/10",
}


def _factors(stage: Stage, *, physical: bool) -> Fit:
    def samples(scene: Scene, right: StageImages, ours: StageImages) -> np.ndarray:
        if physical and scene.shading == "simplified":
            return np.zeros(0)
        at = stage if stage in ours else Stage.RADIANCE
        if at not in ours:
            return np.zeros(0)
        with np.errstate(all="ignore"):
            found = ours[at] / right[at]
        return found[np.isfinite(found) & (found > 0)]

    return Fit(samples=samples, nothing=1.0)


def _scaled(*, physical: bool) -> Wrong:
    return lambda given: (
        given.right if physical and given.scene.shading == "simplified" else given.parameter * given.right
    )


for _stage, _item, _what in (
    (Stage.IRRADIANCE, "RAD-1", "irradiance"),
    (Stage.EXITANCE, "RAD-4", "exitance"),
    (Stage.RADIANCE, "RAD-4", "radiance"),
):
    for _physical_only in (False, True):
        _where = " of the physical light" if _physical_only else ""
        MISTAKES.register(f"factor_of_{_what}{'_physical' if _physical_only else ''}")(
            Mistake(
                says=f"has its {_what}{_where} off by a factor {{0}}",
                items=(_item,),
                ways=(Way(stages={_stage: _scaled(physical=_physical_only)}),),
                fit=_factors(_stage, physical=_physical_only),
                named={value: f"has its {_what}{_where} off by a factor {words}" for value, words in PHRASES.items()},
            )
        )


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
