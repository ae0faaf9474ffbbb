"""Groups of pixels that may share a wrong factor, and the bound of such a factor for a correct renderer.

Pixels share constants, data of the scene, and numbers that are computed from these once for many pixels. Each constant
has one rounding error, and each product or sum of two constants adds another. Data of the scene are rounded when they
are read, and again when they are transformed into another frame; the limits contain the derivatives of light with
respect to these errors. docs/judging.md derives them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import structs

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers, dot, length
from rayproof.reports.judge.forward.limits import Coarseness, Limits, Roundoff, continued_light_limit, irradiance_moved
from rayproof.reports.judge.measurement import StagePixels
from rayproof.reports.results.case_records import CHANCE, LEAST_DISTINCT, Bias, FactorGroup, Leaning, least_share

# Roundings of the numbers that all pixels under one light share: flux, 4 pi and their quotient; then albedo and its
# product with these; then pi, the quotient by it and the product with the constants before it.
CONSTANTS = {Stage.IRRADIANCE: 3, Stage.EXITANCE: 5, Stage.RADIANCE: 8}
# The longest path to a ray, a hit or a curved normal has sixteen roundings. Pixels share two of them: the rounding of a
# datum, and the rounding of its transform into the frame of its use. Limits weigh both with the magnitudes of all data.
SHARED = 2 / 16
# Half of the roundings in numbers that depend on the eye's position, on the single normal of a flat shape, and on the
# direction to a light: the light's position is one of two inputs, and equal normals give equal products.
HALF = 1 / 2
WIDE = 0.01  # of the light: pixels with a larger limit are tested together


@dataclass(frozen=True, kw_only=True)
class Group:
    """The interior pixels of one shape with the same visible lights, in the channels that these light.

    Pixels with `wide` limits are a group of their own, since the others would outvote them.
    """

    shape: int
    lights: tuple[int, ...]
    pixels: np.ndarray  # (n,) flat indices
    channels: np.ndarray  # their numbers
    weights: np.ndarray | None  # (n, channels, lights): each light's share of the irradiance; None with one light
    wide: bool = False


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """The relative error bounds of one stage at a group's pixels, (n, channels)."""

    shared: np.ndarray  # of the errors of numbers that pixels share
    whole: np.ndarray  # for all: the pixel's own limit
    usual: np.ndarray  # (channels,): the median of the pixels' own limits


@dataclass(frozen=True, kw_only=True)
class StageBounds:
    """The bounds of all groups at one stage, and the bound of a factor that the whole run may share."""

    groups: tuple[Bounds, ...]
    wide: np.ndarray  # (n,): `shared` of each of the `wide_pixels`
    allowance: float


ORACLES = Roundoff("float64")


@dataclass(frozen=True, eq=False)
class CommonFactors:
    """The groups of a scene's pixels, and the factors that they share in a renderer's light over the oracle's.

    Groups are made by the truth of the scene, so that no renderer decides which of its pixels are tested together;
    pixels over their limits that a nearby problem explains have another surface's light and are left out.
    """

    base: Any  # the SceneTruth
    renderer: Answers
    roundoff: Roundoff
    limits: Limits  # of the renderer's rounding and the oracle's
    explained: Mapping[Stage, np.ndarray]  # (height, width), by stage

    @cached_property
    def floor(self) -> float:
        """Return the value below which a rounding error is no longer relatively small."""
        numbers = np.finfo(self.renderer.precision)
        return float(numbers.tiny / numbers.eps)

    @cached_property
    def _coarseness(self) -> Coarseness:
        return Coarseness(resolutions=self.renderer.resolutions)

    def of(self, stage: Stage, continued: StagePixels | None = None) -> "Factors":
        """Return the factors of a stage end to end, or relative to the oracle continued from the renderer's stages."""
        image = self.renderer.answers[stage]
        explained = self.explained.get(stage) if continued is None else continued.explained
        return bias(self, stage, image, None if continued is None else continued.value, explained)

    def stage_bounds(self, stage: Stage, *, continued: bool) -> StageBounds:
        """Return the bounds of every group at one stage, end to end or given the renderer's own previous stages."""
        truth = self.base.truth
        constants = Roundoff(self.renderer.precision)(CONSTANTS[stage]) + ORACLES(CONSTANTS[stage])
        (shared_own, whole_own), (shared, whole) = self._light_bounds
        if continued:
            # Separate passes have their own end-to-end error each, and so have the stages before them.
            own, passes = float(stage is Stage.IRRADIANCE), 0.0 if self.renderer.chained else 2.0
            with np.errstate(invalid="ignore"):  # 0 times infinity, in pixels without light or group
                shared, whole = own * shared_own + passes * shared, own * whole_own + passes * whole
        steps = self._steps(stage, continued=continued)
        values = truth[stage].reshape(-1, truth[stage].shape[-1])
        pixels = self.wide_pixels
        with np.errstate(divide="ignore", invalid="ignore"):  # the back of a surface is black
            wide = constants + shared[pixels] + (0.0 if steps is None else steps[pixels] / values[pixels])
        bounds, share = [], []
        for group in self.groups:
            here = np.ix_(group.pixels, group.channels)
            expected = values[here]
            stepped = 0.0
            if steps is not None:
                stepped = np.divide(steps[here], expected, out=np.zeros_like(expected), where=expected > 0)
            limits = constants + whole[here] + stepped
            usual = np.median(limits, axis=0)
            bounds.append(Bounds(shared=constants + shared[here] + stepped, whole=limits, usual=usual))
            if not group.wide:
                share.append(float(np.median(stepped)))
        return StageBounds(groups=tuple(bounds), wide=wide, allowance=constants + max(share, default=0.0))

    def _steps(self, stage: Stage, *, continued: bool) -> np.ndarray | None:
        """Return the error of the renderer's output steps, (n, 3) in the stage's unit, or None if it has no steps."""
        if not self.renderer.resolutions:
            return None
        value = self.base.truth[stage]
        steps = np.zeros_like(value) + self._coarseness.step(stage, value)
        if continued:
            base = self.base
            steps = steps + self._coarseness.handed_down(base.scene, stage, base.truth, base.conditioning)
        return steps.reshape(-1, value.shape[-1])

    @cached_property
    def _light_bounds(self) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Return the shared part and the whole of light's relative error bound (n, 3): continued, and end to end.

        Constants such as albedo and pi are not included: the relative bound of irradiance is that of exitance and
        radiance.
        """
        scene, truth, c, limits = self.base.scene, self.base.truth, self.base.conditioning, self.limits
        irradiance = truth[Stage.IRRADIANCE]
        own = sum(
            (continued_light_limit(scene, Stage.IRRADIANCE, truth, irradiance, g) for g in (self.roundoff, ORACLES)),
            np.zeros_like(irradiance),
        )
        point, turned = limits.continued[Stage.POSITION], limits.continued[Stage.NORMAL]
        moved = SHARED * (limits.position - limits.aimed) + (HALF - SHARED) * point + limits.aimed
        turned = np.where(c.curvature > 0, SHARED, HALF) * turned + c.turned(moved)
        shared = HALF * own + irradiance_moved(scene, truth, moved, turned)
        images = HALF * own, own, shared, limits.end_to_end[Stage.IRRADIANCE]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            relative = [(image / irradiance).reshape(-1, irradiance.shape[-1]) for image in images]
        return (relative[0], relative[1]), (relative[2], relative[3])

    @cached_property
    def wide_pixels(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pixels that receive light and have a limit of more than `WIDE` of it.

        They are flat indices (n,), with each pixel's brightest channel (n,).
        """
        value, pixels = self._irradiance, self._receiving
        limit = self.limits.end_to_end[Stage.IRRADIANCE].reshape(value.shape)[pixels]
        pixels = pixels[(limit > WIDE * value[pixels]).any(axis=1)]
        return pixels, value[pixels].argmax(axis=1)

    @cached_property
    def _irradiance(self) -> np.ndarray:
        image = self.base.truth[Stage.IRRADIANCE]
        return image.reshape(-1, image.shape[-1])

    @cached_property
    def _lit(self) -> np.ndarray:
        """Return the channels (pixels, 3) that receive light of a size at which a rounding is small."""
        return (self._irradiance > self.floor) & np.isfinite(self._irradiance)

    @cached_property
    def _receiving(self) -> np.ndarray:
        """Return the pixels that receive light, as flat indices."""
        return np.flatnonzero(self.base.conditioning.hit.ravel() & self._lit.any(axis=1))

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Return the groups of pixels that receive light, of `LEAST_DISTINCT` pixels at least."""
        truth, receiving = self.base.truth, self._receiving
        visible = truth[Stage.VISIBILITY].reshape(len(self._irradiance), -1)[receiving] > 0
        shapes = truth[Stage.OBJECT][..., 0].ravel()[receiving]
        kinds = np.unique(shapes, return_inverse=True)[1]
        for light in range(visible.shape[1]):
            kinds = np.unique(2 * kinds + visible[:, light], return_inverse=True)[1]
        groups = []
        for kind in np.flatnonzero(np.bincount(kinds) >= LEAST_DISTINCT):
            here = kinds == kind
            first = int(np.argmax(here))
            lights = tuple(int(light) for light in np.flatnonzero(visible[first]))
            pixels = receiving[here]
            channels = np.flatnonzero(self._lit[pixels].any(axis=0))
            weights = _weights(self.base.scene, truth, pixels, channels, lights) if len(lights) > 1 else None
            group = Group(shape=int(shapes[first]), lights=lights, pixels=pixels, channels=channels, weights=weights)
            groups.append(group)
            wide = pixels[np.isin(pixels, self.wide_pixels[0])]
            if LEAST_DISTINCT <= len(wide) < len(pixels):
                groups.append(replace(group, pixels=wide, weights=None, wide=True))
        return tuple(groups)


def _weights(
    scene: Scene, truth: StageImages, pixels: np.ndarray, channels: np.ndarray, lights: tuple[int, ...]
) -> np.ndarray:
    """Return each light's share of the irradiance, (n, channels, lights)."""
    position, normal = (truth[stage].reshape(-1, 3)[pixels] for stage in (Stage.POSITION, Stage.NORMAL))
    parts = np.zeros((len(pixels), len(channels), len(lights)))
    for place, number in enumerate(lights):
        light = scene.lights[number]
        towards = np.asarray(light.position, dtype=np.float64) - position
        r = length(towards)
        arriving = np.maximum(dot(normal, towards), 0.0) / r
        if scene.shading == "inverse_square":
            arriving = arriving / r**2
        parts[..., place] = arriving[:, np.newaxis] * np.asarray(light.flux)[channels]
    total = parts.sum(axis=-1, keepdims=True)
    return np.divide(parts, total, out=np.zeros_like(parts), where=total > 0)


# Factors that many pixels share: a wrong flux, albedo, pi or 4 changes all of them alike, unlike rounding.
#
# For a correct renderer, the relative error value / expected - 1 of each pixel is s + e. The part s is due to shared
# numbers: constants, the scene's data, and numbers computed from them once; `Bounds` has its bound. The part e is due
# to roundings of numbers that differ from pixel to pixel. Both signs of e are equally likely, so that s + e exceeds the
# bound of s in one direction with probability 1/2 at most. A group fails if more of its pixels exceed it than chance
# allows: this is the sign test, which assumes nothing about the distribution of e (Conover, Practical Nonparametric
# Statistics, 3rd ed., 1999, 3.4).


CHANNELS = "RGB"
TINY = 2.0**-126  # the smallest normal float32; below it the resolution of an output is not a step of the format


@dataclass(frozen=True, kw_only=True)
class Factor:
    """The factor that the pixels of one group share in one channel."""

    shape: int
    lights: tuple[int, ...]  # all lights that are visible from the group's pixels
    fitted: int | None  # the light with this factor, out of several that overlap; None: all of them together
    channel: int
    pixels: int
    value: float  # the renderer's value over the expected value
    limit: float  # the largest |value - 1| of a correct renderer, and so the smallest factor that can be seen
    distinct: bool  # enough different values for the sign test; without them the limit is a pixel's
    wide: bool  # of only the pixels with wide limits

    @property
    def group(self) -> tuple[int, tuple[int, ...], int | None, bool]:
        """Return the key of its group within the case."""
        return self.shape, self.lights, self.fitted, self.wide

    @property
    def ratio(self) -> float:
        """Return its distance from 1 over its limit."""
        off = abs(self.value - 1)
        return 0.0 if off == 0 else off / self.limit if self.limit > 0 else math.inf

    def sentence(self, stage: Stage, reference: str) -> str:
        """Return a sentence about the error if it is over its limit."""
        numbers = self.lights if self.fitted is None else (self.fitted,)
        lights = ("light " if len(numbers) == 1 else "lights ") + ", ".join(map(str, numbers))
        held = "pixels with wide limits" if self.wide else "pixels"
        return (
            f"{stage} of shape {self.shape} under {lights} is {self.value:.9g} times {reference}'s in {self.pixels} "
            f"{held} ({CHANNELS[self.channel]}), a factor that they share; limit {self.limit:.3g}"
        )


@dataclass(frozen=True, kw_only=True)
class Factors:
    """The factors of one image stage, group by group."""

    factors: tuple[Factor, ...]
    allowance: float  # of a factor that a whole run may share: the constants' roundings and the output's step
    wide: Leaning | None = None  # of the pixels with wide limits; None given the subject's own previous stages

    @cached_property
    def worst(self) -> Factor | None:
        """Return the factor that is farthest over its limit, or nearest to it; None without any group."""
        return max(self.factors, key=lambda factor: factor.ratio, default=None)

    @property
    def ratio(self) -> float:
        """Return the worst factor's distance from 1 over its limit."""
        return self.worst.ratio if self.worst is not None else 0.0

    @property
    def common(self) -> float | None:
        """Return the median of the groups' factors: this case's estimate of a factor that the whole run shares."""
        values = [
            factor.value for factor in self.factors if factor.distinct and factor.fitted is None and not factor.wide
        ]
        return float(np.median(values)) if values else None

    def recorded(self, own: "Factors | None" = None) -> Bias:
        """Return the factors with four digits, with those given the subject's `own` previous stages.

        If all groups are within their limits, only the group nearest to its limit is recorded; groups of `own` are
        recorded only if one is over its limit.
        """
        ratio = _short(self.ratio)
        continued = None if own is None else own.recorded()
        if continued is not None and continued.ratio <= 1:
            continued = structs.replace(continued, groups=None)
        return Bias(
            ratio=1.001 if ratio == 1 < self.ratio else ratio,  # a ratio over its limit stays over it
            sees=_short(min((factor.limit for factor in self.factors), default=math.inf)),
            common=None if self.common is None else _short(self.common - 1),
            allowance=_short(self.allowance),
            groups=self._groups(),
            wide=self.wide if self.wide is not None and self.wide.pixels else None,
            continued=continued,
        )

    def _groups(self) -> list[FactorGroup]:
        groups: dict[tuple, FactorGroup] = {}
        nearest = None if self.worst is None or self.ratio > 1 else self.worst.group
        for factor in self.factors:
            if nearest not in (None, factor.group):
                continue
            shape, lights, fitted, wide = factor.group
            off: list[float | None] = [None] * len(CHANNELS)
            group = FactorGroup(
                shape=shape, lights=lights, pixels=factor.pixels, off=off, sees=[*off], fitted=fitted, wide=wide
            )
            group = groups.setdefault(factor.group, group)
            group.off[factor.channel] = _short(factor.value - 1)
            group.sees[factor.channel] = _short(factor.limit)
        return list(groups.values())


def bias(
    factors: CommonFactors, stage: Stage, image: np.ndarray, value: np.ndarray | None, explained: np.ndarray | None
) -> Factors:
    """Return the factors of `image` (height, width, 3) over the oracle's stage, or over `value`.

    `value` is the oracle's value from the renderer's own stages; `explained` are the pixels (height, width) that have
    another surface's light.
    """
    bounds = factors.stage_bounds(stage, continued=value is not None)
    flat = image.reshape(-1, image.shape[-1])
    expected = np.asarray(factors.base.truth[stage] if value is None else value, dtype=np.float64).reshape(flat.shape)
    if explained is not None and explained.any():
        expected = np.where(explained.reshape(-1, 1), 0.0, expected)  # below every floor
    # An output with steps has a largest value and clamps larger values.
    coarse = factors.renderer.resolutions.get(stage)
    top = float(image.max(initial=0.0)) if coarse is not None and coarse.absolute > TINY else math.inf
    top = min(top, float(np.finfo(factors.renderer.precision).max))
    shared: list[Factor] = []
    for group, bound in zip(factors.groups, bounds.groups, strict=True):
        if group.wide and value is not None:
            continue  # given the stages before, these pixels have no wide limits
        here = np.ix_(group.pixels, group.channels)
        shared += _factors(group, bound, flat[here], expected[here], top, factors.floor)
    wide = None
    if value is None:
        pixels = factors.wide_pixels
        good = (expected[pixels] > factors.floor) & (expected[pixels] < top) & np.isfinite(flat[pixels])
        wide = _leaning(flat[pixels][good], expected[pixels][good], bounds.wide[good])
    return Factors(factors=tuple(shared), allowance=bounds.allowance, wide=wide)


def _leaning(values: np.ndarray, expected: np.ndarray, shared: np.ndarray) -> Leaning:
    """Return the direction in which values (n,) deviate by more than their shared part allows."""
    off, first = np.unique((values - expected) / expected, return_index=True)
    shared = shared[first]
    return Leaning(pixels=len(off), above=int(np.sum(off > shared)), below=int(np.sum(-off > shared)))


def _factors(
    group: Group, bound: Bounds, values: np.ndarray, expected: np.ndarray, ceiling: float, floor: float
) -> list[Factor]:
    """Return a group's factors: of all its lights together, and of each light if there are several."""
    good = (expected > floor) & (expected < ceiling) & (values > 0) & (values < ceiling)
    lit = np.flatnonzero(good.any(axis=0))
    weights = group.weights
    if not good.all():
        kept = np.flatnonzero(good[:, lit].all(axis=1)) if len(lit) else lit
        if len(kept) < LEAST_DISTINCT:
            return []
        here = np.ix_(kept, lit)
        values, expected, whole = values[here], expected[here], bound.whole[here]
        bound = Bounds(shared=bound.shared[here], whole=whole, usual=np.median(whole, axis=0))
        weights = None if weights is None else weights[here]
    off = (values - expected) / expected  # values / expected - 1 would have a rounding error of 1
    ordered = np.sort(off, axis=0)
    count = len(off)
    middle = (ordered[(count - 1) // 2] + ordered[count // 2]) / 2
    distinct = 1 + np.count_nonzero(np.diff(ordered, axis=0), axis=0)
    beyond = np.sort(np.where(middle >= 0, off, -off) - bound.shared, axis=0)
    factors = []
    for place, channel in enumerate(int(group.channels[index]) for index in lit):
        value, limit, enough = float(middle[place]), float(bound.usual[place]), distinct[place] >= LEAST_DISTINCT
        if enough:
            # If moved by this much more, too many pixels would exceed the bound to be explained by chance.
            rank = int(count * least_share(int(distinct[place])))
            limit = min(limit, abs(value) - float(beyond[rank, place]))
        about = _About(group=group, channel=channel, pixels=count)
        factors.append(about.factor(value, limit, distinct=bool(enough)))
        if weights is not None and enough:
            factors += _fitted(about, weights[:, place], off[:, place], bound, place)
    return factors


@dataclass(frozen=True, kw_only=True)
class _About:
    """The common attributes of a group's factors in one channel."""

    group: Group
    channel: int
    pixels: int

    def factor(self, off: float, limit: float, *, distinct: bool, fitted: int | None = None) -> Factor:
        """Return a factor that is `off` from 1."""
        return Factor(
            shape=self.group.shape,
            lights=self.group.lights,
            fitted=fitted,
            channel=self.channel,
            pixels=self.pixels,
            value=1 + off,
            limit=limit,
            distinct=distinct,
            wide=self.group.wide,
        )


def _fitted(about: _About, weights: np.ndarray, off: np.ndarray, bound: Bounds, place: int) -> list[Factor]:
    """Return each light's factor by least squares over the shares (n, lights) that the lights have in a pixel.

    The fit is linear in `off`, so that bounds can be propagated: the shared part by the absolute values of its
    coefficients, the other part by Hoeffding's inequality (1963) with the largest residual as its range. A fit that is
    so ill-conditioned that a single pixel determines the light better is left out.
    """
    visible = np.flatnonzero((weights > 0).any(axis=0))
    shares = weights[:, visible]
    solution = np.linalg.pinv(shares)  # (lights, n)
    values = solution @ off
    left = float(np.abs(off - shares @ values).max())
    spread = left * math.sqrt(2 * math.log(2 / CHANCE)) * np.sqrt((solution**2).sum(axis=1))
    limits = np.abs(solution) @ bound.shared[:, place] + spread
    with np.errstate(divide="ignore"):
        pixel = np.median(bound.whole[:, place, np.newaxis] / shares, axis=0)
    return [
        about.factor(float(value), float(limit), distinct=True, fitted=about.group.lights[light])
        for light, value, limit, worst in zip(visible, values, limits, pixel, strict=True)
        if limit < worst
    ]


def _short(number: float) -> float:
    """Return a number rounded to four digits for the reader."""
    return float(f"{number:.4g}") if math.isfinite(number) else number
