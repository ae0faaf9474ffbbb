"""Mistakes of light: falloff, cosine, sums of lights, albedo, exitance and radiance."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rayproof.cases.scene import PointLight, Scene, Shading
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.vectors import dot, length
from rayproof.reports.mistakes import Family, Mistake, family, known, variant

FALLOFF, COSINE, SUM, SURFACE = ("RAD-1",), ("RAD-2",), ("RAD-5", "LIT-1"), ("RAD-4",)
Curve = Callable[[np.ndarray], np.ndarray]


class Share(Mistake):
    """Each light's share of irradiance is wrong by a factor that depends on the distance and the cosine."""

    simplified = False  # whether the factor also applies to the simplified light

    def factor(self, r: np.ndarray, cosine: np.ndarray) -> np.ndarray | float:
        """Return the factor at distances r [m] (N,) and cosines (N,)."""
        raise NotImplementedError

    def irradiance_of(self, scene: Scene, light: PointLight, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return the share (N, 3) times the factor."""
        share = super().irradiance_of(scene, light, positions, normals)
        if scene.shading == "simplified" and not self.simplified:
            return share
        offset = np.asarray(light.position) - positions
        r = length(offset)
        with np.errstate(all="ignore"):
            factor = np.broadcast_to(self.factor(r, dot(normals, offset) / r), r.shape)
            return np.where(share > 0, share * factor[:, np.newaxis], 0.0)


def _share(
    name: str, sentence: str, items: Sequence[str], factor: Callable[..., np.ndarray | float], *, simplified=False
) -> None:
    steps = {"factor": lambda _, r, cosine: factor(r, cosine), "simplified": simplified}
    known(name, sentence, *items)(type(name, (Share,), steps))


def _window(r: np.ndarray, reach: float, inner: int, outer: int) -> np.ndarray:
    return np.clip(1 - (r / reach) ** inner, 0, None) ** outer


for _name, _sentence, _factor in (
    ("no_four_pi", "leaves out the 4 pi of a point light (takes its flux for its intensity)", lambda r, c: 4 * math.pi),
    ("two_pi", "spreads a light's flux over a half sphere, 2 pi instead of 4 pi", lambda r, c: 2.0),
    ("pi_for_four_pi", "divides a light's flux by pi instead of 4 pi", lambda r, c: 4.0),
    ("no_falloff", "leaves out the falloff 1/r^2", lambda r, c: r**2),
    ("neither_falloff_nor_four_pi", "leaves out 1/(4 pi r^2) but not 1/pi", lambda r, c: 4 * math.pi * r**2),
    ("linear_falloff", "lets light fall off with 1/r instead of 1/r^2", lambda r, c: r),
    (
        "linear_falloff_without_four_pi",
        "lets light fall off with 1/r and leaves out 4 pi",
        lambda r, c: 4 * math.pi * r,
    ),
    ("cubic_falloff", "lets light fall off with 1/r^3 instead of 1/r^2", lambda r, c: 1 / r),
    ("softened_falloff", "lets light fall off with 1/(1 + r^2)", lambda r, c: r**2 / (1 + r**2)),
    ("clamped_distance", "lets light fall off with 1/max(r, 1)^2", lambda r, c: (r / np.maximum(r, 1)) ** 2),
    ("one_plus_r", "lets light fall off with 1/(1 + r)^2", lambda r, c: (r / (1 + r)) ** 2),
):
    _share(_name, _sentence, FALLOFF, _factor)
_share("no_cosine", "leaves out the cosine between normal and light", COSINE, lambda r, c: 1 / c, simplified=True)
_share("cosine_squared", "multiplies by the cosine twice", COSINE, lambda r, c: c, simplified=True)
_share("smooth_cosine", "takes the smooth step of the cosine", COSINE, lambda r, c: c * (3 - 2 * c), simplified=True)
_share(
    "sine_for_cosine",
    "takes the sine for the cosine",
    COSINE,
    lambda r, c: np.sqrt(np.clip(1 - c * c, 0, None)) / c,
    simplified=True,
)


@family(
    "falloff_exponent",
    "lets light fall off with the distance to the power of -{0} instead of -2",
    *FALLOFF,
    starts=[(0.25, 0.75, 1.5, 2.5, 3.5)],
)
class FalloffExponent(Family, Share):
    """1/r^p, where the parameter is p."""

    def factor(self, r: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Return r^(2 - p)."""
        return r ** (2 - self.numbers[0])


@family("softened", "lets light fall off with 1/(r^2 + {0})", *FALLOFF, starts=[(0.001, 0.01, 0.1, 1.0, 10.0)])
class Softened(Family, Share):
    """1/(r^2 + s), where the parameter is s."""

    def factor(self, r: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Return r^2/(r^2 + s)."""
        return r**2 / (r**2 + abs(self.numbers[0]))


@family(
    "attenuation",
    "lets light fall off with 1/(1 + {0} r + {1} r^2)",
    *FALLOFF,
    starts=[(0.0, 0.1, 0.5), (0.01, 0.1, 0.5)],
)
class Attenuation(Family, Share):
    """1/(1 + a r + b r^2), where the parameters are a and b."""

    def factor(self, r: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Return r^2/(1 + a r + b r^2)."""
        linear, square = self.numbers
        return r**2 / (1 + linear * r + square * r**2)


@family(
    "absorption", "lets light be absorbed by exp(-{0} r) beside the falloff", *FALLOFF, starts=[(0.01, 0.05, 0.2, 0.5)]
)
class Absorption(Family, Share):
    """exp(-a r)/r^2, where the parameter is a."""

    def factor(self, r: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Return exp(-a r)."""
        return np.exp(-self.numbers[0] * r)


for _number, (_form, _inner, _outer) in enumerate(
    (("(1 - (r/R)^4)^2", 4, 2), ("(1 - (r/R)^2)^2", 2, 2), ("(1 - r/R)^2", 1, 2), ("1 - r/R", 1, 1))
):
    _factor = {"factor": lambda self, r, c, i=_inner, o=_outer: _window(r, max(self.numbers[0], 1e-3), i, o)}
    family(
        f"light_range_{_number + 1}",
        f"lets lights end at R = {{0}} m, by a window {_form} beside the falloff",
        *FALLOFF,
        starts=[(3.0, 6.0, 10.0, 20.0, 50.0)],
    )(type(f"light_range_{_number + 1}", (Family, Share), _factor))


@family("cosine_power", "takes the cosine to the power of {0}", *COSINE, starts=[(0.5, 0.75, 1.5, 2.5, 4.0)])
class CosinePower(Family, Share):
    """cos^p, where the parameter is p."""

    simplified = True

    def factor(self, r: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Return cos^(p - 1)."""
        return np.clip(cosine, 0, None) ** (self.numbers[0] - 1)


# Sums of lights.


class Sum(Mistake):
    """The sum over the lights is weighted."""

    def weight(self, place: int, count: int) -> float:
        """Return the weight of the light at index `place` of `count` lights."""
        raise NotImplementedError

    def irradiance(self, scene: Scene, objects: np.ndarray, shares: np.ndarray, visible: np.ndarray) -> np.ndarray:
        """Return the weighted sum."""
        weights = np.array([self.weight(place, len(scene.lights)) for place in range(len(scene.lights))])
        return super().irradiance(scene, objects, shares * weights[:, np.newaxis], visible)


def _sum(name: str, sentence: str, weight: Callable[[int, int], float]) -> None:
    known(name, sentence, *SUM)(type(name, (Sum,), {"weight": lambda _, place, count: weight(place, count)}))


_sum("first_light", "adds up the first light alone", lambda i, n: float(i == 0))
_sum("last_light", "keeps the last light alone", lambda i, n: float(i == n - 1))
_sum("last_light_left_out", "leaves the last light out", lambda i, n: float(i < n - 1))
_sum("last_of_several_left_out", "leaves the last of several lights out", lambda i, n: float(i < n - 1 or n == 1))
_sum("first_light_left_out", "leaves the first light out", lambda i, n: float(i > 0))
_sum("mean_of_lights", "takes the mean of the lights instead of their sum", lambda i, n: 1 / n)
_sum("root_of_lights", "divides the sum of the lights by the square root of their number", lambda i, n: n**-0.5)
for _most in (2, 3, 4, 8, 16, 32):
    _sum(
        f"at_most_{_most}_lights",
        f"takes the first {_most} lights of a scene, and no more",
        lambda i, n, most=_most: float(i < most),
    )
    _cut = {
        "visibility": lambda self, scene, rows, freedom=None, most=_most: (
            Analytic.visibility(self, scene, rows, freedom) * (np.arange(len(scene.lights)) < most)
        )
    }
    variant(f"at_most_{_most}_lights")(type("cut", (Mistake,), _cut))


@known("lights_clamped", "clamps the sum of the lights to 1", "RAD-5", "RAD-3")
class LightsClamped(Mistake):
    """Irradiance is at most 1."""

    def irradiance(self, scene: Scene, objects: np.ndarray, shares: np.ndarray, visible: np.ndarray) -> np.ndarray:
        """Return the clamped sum."""
        return np.minimum(super().irradiance(scene, objects, shares, visible), 1.0)


# Models of light.


class Model(Mistake):
    """The light is computed with the wrong model."""

    model: Shading = "simplified"

    def irradiance_of(self, scene: Scene, light: PointLight, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return the light's share of irradiance (N, 3) in that model."""
        return super().irradiance_of(replace(scene, shading=self.model), light, positions, normals)

    def leaving(self, scene: Scene, exitance: np.ndarray) -> np.ndarray:
        """Return the radiance (N, 3) in that model."""
        return super().leaving(replace(scene, shading=self.model), exitance)


known(
    "simplified_for_physical",
    "uses the lecture's simplified light where the physical one is asked for (no falloff, no 1/pi)",
    "RAD-3",
    "RAD-1",
)(Model)
known("physical_for_simplified", "uses the physical light where the lecture's simplified one is asked for", "RAD-3")(
    type("Physical", (Model,), {"model": "inverse_square"})
)


# Surfaces.


def _albedo(name: str, sentence: str, change: Callable[[Scene, np.ndarray, np.ndarray], np.ndarray]) -> None:
    def albedo(self: Mistake, scene: Scene, objects: np.ndarray) -> np.ndarray:
        return change(scene, objects, Analytic.albedo(self, scene, objects))

    known(name, sentence, *SURFACE)(type(name, (Mistake,), {"albedo": albedo}))


def linear_of_srgb(coded: np.ndarray) -> np.ndarray:
    """Return linear values from sRGB values. Source: IEC 61966-2-1."""
    return np.where(coded <= 0.04045, coded / 12.92, ((np.maximum(coded, 0) + 0.055) / 1.055) ** 2.4)


def srgb(linear: np.ndarray) -> np.ndarray:
    """Return sRGB values from linear values. Source: IEC 61966-2-1."""
    curved = 1.055 * np.power(np.maximum(linear, 0), 1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curved)


def _of_first(scene: Scene, objects: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    return Analytic().albedo(scene, np.where(objects >= 0, 0.0, -1.0))


_albedo("no_albedo", "leaves the albedo out", lambda scene, objects, a: np.where(objects[:, :1] >= 0, 1.0, 0.0))
_albedo("albedo_squared", "multiplies by the albedo twice", lambda scene, objects, a: a * a)
_albedo("albedo_bgr", "takes the albedo's channels in the order blue, green, red", lambda scene, objects, a: a[:, ::-1])
_albedo("albedo_of_first", "takes the first shape's albedo for all", _of_first)
_albedo("srgb_albedo", "takes albedos for sRGB and makes them linear", lambda scene, objects, a: linear_of_srgb(a))
_albedo("albedo_to_srgb", "writes albedos in sRGB before it uses them", lambda scene, objects, a: srgb(a))
_albedo(
    "albedo_mean",
    "takes the mean of the albedo's channels",
    lambda scene, objects, a: a.mean(axis=1, keepdims=True) * np.ones(3),
)


@family("albedo_power", "takes albedos to the power of {0}", *SURFACE, starts=[(0.4, 0.7, 1.5, 2.2)])
class AlbedoPower(Family):
    """albedo^p, where the parameter is p."""

    def albedo(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        """Return the albedo (N, 3) to the power p."""
        return np.maximum(super().albedo(scene, objects), 0) ** self.numbers[0]


class OnRadiance(Mistake):
    """The radiance that leaves a lit surface is wrong."""

    simplified = True  # whether the change also applies to the simplified light

    def change(self, value: np.ndarray) -> np.ndarray:
        """Return the wrong radiance from the right one."""
        raise NotImplementedError

    def leaving(self, scene: Scene, exitance: np.ndarray) -> np.ndarray:
        """Return the wrong radiance (N, 3)."""
        right = super().leaving(scene, exitance)
        return right if scene.shading == "simplified" and not self.simplified else self.change(right)


def _leaving(name: str, sentence: str, change: Curve, *, simplified: bool = True) -> None:
    steps = {"change": lambda _, value: change(value), "simplified": simplified}
    known(name, sentence, *SURFACE)(type(name, (OnRadiance,), steps))


_leaving("no_pi", "leaves out 1/pi between exitance and radiance", lambda L: math.pi * L, simplified=False)
_leaving("two_for_pi", "divides exitance by 2 instead of pi", lambda L: math.pi / 2 * L, simplified=False)
_leaving("two_pi_for_pi", "divides exitance by 2 pi instead of pi", lambda L: L / 2, simplified=False)
_leaving("pi_twice", "divides by pi once too often", lambda L: L / math.pi)
_leaving(
    "pi_twice_physical",
    "divides by pi once too often under the physical light",
    lambda L: L / math.pi,
    simplified=False,
)


@known("pi_in_simplified", "divides by pi under the simplified light, too", "RAD-4", "RAD-3")
class PiInSimplified(Mistake):
    """The radiance is M / pi in both models."""

    def leaving(self, scene: Scene, exitance: np.ndarray) -> np.ndarray:
        """Return M / pi."""
        return exitance / math.pi


@known("four_pi_in_simplified", "divides by 4 pi under the simplified light, too", "RAD-3")
class FourPiInSimplified(Mistake):
    """The flux is divided by 4 pi in both models."""

    def irradiance_of(self, scene: Scene, light: PointLight, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return the light's share, divided by 4 pi in the simplified model."""
        share = super().irradiance_of(scene, light, positions, normals)
        return share / (4 * math.pi) if scene.shading == "simplified" else share


PHRASES = {
    math.pi: "pi", 1 / math.pi: "1/pi", 4 * math.pi: "4 pi", 1 / (4 * math.pi): "1/(4 pi)", 2 * math.pi: "2 pi",
    1 / (2 * math.pi): "1/(2 pi)", math.pi / 2: "pi/2", 2 / math.pi: "2/pi", math.pi**2: "pi^2",
    1 / math.pi**2: "1/pi^2",
    2.0: "2", 0.5: "1/2", 4.0: "4", 0.25: "1/4", 3.0: "3", 1 / 3: "1/3", 10.0: "10", 0.1: "1/10",
}  # fmt: skip
FACTORS = (0.01, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 100.0)


class LightFactor(Family):
    """The light is wrong by a factor, the parameter, at one of its stages."""

    scaled = Stage.RADIANCE
    simplified = True

    def _times(self, scene: Scene, value: np.ndarray, stage: Stage) -> np.ndarray:
        off = stage is self.scaled and (self.simplified or scene.shading != "simplified")
        return value * self.numbers[0] if off else value

    def irradiance(self, scene: Scene, objects: np.ndarray, shares: np.ndarray, visible: np.ndarray) -> np.ndarray:
        """Return the irradiance, times the factor if that is the wrong stage."""
        return self._times(scene, super().irradiance(scene, objects, shares, visible), Stage.IRRADIANCE)

    def exitance(self, scene: Scene, objects: np.ndarray, arriving: np.ndarray) -> np.ndarray:
        """Return the exitance, times the factor if that is the wrong stage."""
        return self._times(scene, super().exitance(scene, objects, arriving), Stage.EXITANCE)

    def leaving(self, scene: Scene, exitance: np.ndarray) -> np.ndarray:
        """Return the radiance, times the factor if that is the wrong stage."""
        return self._times(scene, super().leaving(scene, exitance), Stage.RADIANCE)


for _stage, _item in ((Stage.RADIANCE, "RAD-4"), (Stage.EXITANCE, "RAD-4"), (Stage.IRRADIANCE, "RAD-1")):
    for _both in (True, False):
        _name = f"factor_of_{_stage}{'' if _both else '_physical'}"
        _where = "" if _both else " of the physical light"
        family(_name, f"has its {_stage}{_where} off by a factor {{0}}", _item, starts=[FACTORS], named=PHRASES)(
            type(_name, (LightFactor,), {"scaled": _stage, "simplified": _both})
        )
