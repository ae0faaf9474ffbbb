"""Groups of pixels that share a factor if anything does, and what such a factor may be of a correct renderer.

What pixels share is a constant, a datum of the scene, or made of these once for many pixels. Constants are rounded
once each and once more where two are put together. A datum is rounded as such, and where it is carried into the frame
in which it is used; the derivatives by which that moves light are those of the limits. docs/judging.md derives it.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from msgspec import structs

from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import dot, length
from rayproof.reports.judge.comparison import Comparison, roundoff
from rayproof.reports.judge.forward.limits import Coarseness, Roundoff, continued_light_limit, irradiance_moved
from rayproof.reports.results.case_records import CHANCE, LEAST_DISTINCT, Bias, FactorGroup, Leaning, least_share

# Roundings of what all pixels under one light share: flux, 4 pi and their quotient; then albedo and its product with
# these; then pi, the quotient by it and the product with the constants before it.
CONSTANTS = {Stage.IRRADIANCE: 3, Stage.EXITANCE: 5, Stage.RADIANCE: 8}
# Of sixteen roundings on the longest path to a ray, a hit or a curved normal two are of what pixels share: a datum's
# own, and one where it is carried into the frame in which it is used. Limits weigh both with all data's magnitudes.
SHARED = 2 / 16
# Half of those that are made of the eye's own place, of a flat shape's one normal, and of the direction to a light: the
# light's own place is one of two, and where normals are alike so are the products that they enter.
HALF = 1 / 2
WIDE = 0.01  # of the light: pixels with a larger limit are tested together


@dataclass(frozen=True, kw_only=True)
class Group:
    """The interior pixels of one shape that see the same lights, in the channels in which they are lit.

    Those of them whose limits are `wide` are a group of their own: among others they would be outvoted.
    """

    shape: int
    lights: tuple[int, ...]
    pixels: np.ndarray  # (n,) flat indices
    channels: np.ndarray  # their numbers
    weights: np.ndarray | None  # (n, channels, lights): each light's share of the irradiance; None with one light
    wide: bool = False


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """What one stage of a group's pixels may be off by, relative, (n, channels)."""

    shared: np.ndarray  # for what comes of numbers that pixels share
    whole: np.ndarray  # for all: the pixel's own limit
    usual: np.ndarray  # (channels,): the middle one of the pixels' own limits


@dataclass(frozen=True, kw_only=True)
class StageBounds:
    """The bounds of all groups at one stage, and of what a whole run may share."""

    groups: tuple[Bounds, ...]
    wide: np.ndarray  # (n,): `shared` of each of the `wide_pixels`
    allowance: float


def floor(pair: Comparison) -> float:
    """Return the value below which a rounding is no longer small beside it."""
    numbers = np.finfo(pair.subject.precision)
    return float(numbers.tiny / numbers.eps)


def stage_bounds(pair: Comparison, stage: Stage, *, continued: bool) -> StageBounds:
    """Return the bounds of every group at one stage, end to end or given the subject's own previous stages."""
    key = ("bias bounds", stage, pair.rules, continued)
    return pair.base.once(key, lambda: _stage_bounds(pair, stage, continued=continued))


def _stage_bounds(pair: Comparison, stage: Stage, *, continued: bool) -> StageBounds:
    truth, subject = pair.truth, pair.subject
    constants = sum(Roundoff(renderer.precision)(CONSTANTS[stage]) for renderer in (subject, pair.reference))
    (shared_own, whole_own), (shared, whole) = pair.base.once(("bias light", pair.rules), lambda: _light_bounds(pair))
    if continued:
        # Passes of their own are each off by their own end-to-end error, and so is what they are continued from.
        own, passes = float(stage is Stage.IRRADIANCE), 0.0 if subject.chained else 2.0
        with np.errstate(invalid="ignore"):  # 0 times infinity, where no light arrives and no group is
            shared, whole = own * shared_own + passes * shared, own * whole_own + passes * whole
    steps = _steps(pair, stage, continued=continued)
    values = truth[stage].reshape(-1, truth[stage].shape[-1])
    pixels = wide_pixels(pair)
    with np.errstate(divide="ignore", invalid="ignore"):  # the back of a surface is black
        wide = constants + shared[pixels] + (0.0 if steps is None else steps[pixels] / values[pixels])
    found, share = [], []
    for group in groups(pair):
        here = np.ix_(group.pixels, group.channels)
        theirs = values[here]
        stepped = 0.0 if steps is None else np.divide(steps[here], theirs, out=np.zeros_like(theirs), where=theirs > 0)
        limits = constants + whole[here] + stepped
        usual = np.median(limits, axis=0)
        found.append(Bounds(shared=constants + shared[here] + stepped, whole=limits, usual=usual))
        if not group.wide:
            share.append(float(np.median(stepped)))
    return StageBounds(groups=tuple(found), wide=wide, allowance=constants + max(share, default=0.0))


def _steps(pair: Comparison, stage: Stage, *, continued: bool) -> np.ndarray | None:
    """Return what the steps of the renderers' outputs add, (n, 3) in the stage's unit, or None where there are none."""
    renderers = pair.subject, pair.reference
    if not any(renderer.resolutions for renderer in renderers):
        return None
    mine, other = (Coarseness(resolutions=renderer.resolutions) for renderer in renderers)
    value = pair.truth[stage]
    steps = np.zeros_like(value) + mine.step(stage, value) + other.step(stage, value)
    if continued:
        steps = steps + mine.handed_down(pair.scene, stage, pair.truth, pair.conditioning)
    return steps.reshape(-1, value.shape[-1])


def _light_bounds(pair: Comparison) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return what is shared and all of what light may be off by, relative (n, 3): on its own, and end to end.

    Constants are not in it. Albedo and pi are such: what is relative to irradiance is so to exitance and radiance.
    """
    scene, truth, renderers, c = pair.scene, pair.truth, (pair.subject, pair.reference), pair.conditioning
    irradiance, roundoffs = truth[Stage.IRRADIANCE], tuple(map(roundoff, renderers))
    limits = pair.base.together(*roundoffs, by_matrices=(renderers[0].by_matrices, renderers[1].by_matrices))
    own = sum(
        (continued_light_limit(scene, Stage.IRRADIANCE, truth, irradiance, g) for g in roundoffs),
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


def wide_pixels(pair: Comparison) -> tuple[np.ndarray, np.ndarray]:
    """Return the interior pixels that receive light and are held to a limit of more than `WIDE` of it.

    As flat indices (n,) and each one's brightest channel (n,).
    """
    return pair.base.once(("wide pixels", pair.rules), lambda: _wide_pixels(pair))


def _wide_pixels(pair: Comparison) -> tuple[np.ndarray, np.ndarray]:
    value = pair.truth[Stage.IRRADIANCE].reshape(-1, pair.truth[Stage.IRRADIANCE].shape[-1])
    pixels = _receiving(pair)
    limit = pair.limits.end_to_end[Stage.IRRADIANCE].reshape(value.shape)[pixels]
    pixels = pixels[(limit > WIDE * value[pixels]).any(axis=1)]
    return pixels, value[pixels].argmax(axis=1)


def groups(pair: Comparison) -> tuple[Group, ...]:
    """Return the groups of interior pixels that receive light, of `LEAST_DISTINCT` pixels at least."""
    return pair.base.once(("bias groups", pair.rules), lambda: _groups(pair))


def _lit(pair: Comparison) -> np.ndarray:
    """Return the channels (pixels, 3) that receive light of a size at which a rounding is small."""
    value = pair.truth[Stage.IRRADIANCE].reshape(-1, pair.truth[Stage.IRRADIANCE].shape[-1])
    return (value > floor(pair)) & np.isfinite(value)


def _receiving(pair: Comparison) -> np.ndarray:
    """Return the interior pixels that receive light, as flat indices."""
    interior = pair.conditioning.hit & ~pair.classes.edge(Stage.IRRADIANCE) & ~pair.near
    return np.flatnonzero(interior.ravel() & _lit(pair).any(axis=1))


def _groups(pair: Comparison) -> tuple[Group, ...]:
    truth, lit, receiving = pair.truth, _lit(pair), _receiving(pair)
    value = truth[Stage.IRRADIANCE].reshape(-1, truth[Stage.IRRADIANCE].shape[-1])
    seen = truth[Stage.VISIBILITY].reshape(len(value), -1)[receiving] > 0
    shapes = truth[Stage.OBJECT][..., 0].ravel()[receiving]
    kinds = np.unique(shapes, return_inverse=True)[1]
    for light in range(seen.shape[1]):
        kinds = np.unique(2 * kinds + seen[:, light], return_inverse=True)[1]
    found = []
    for kind in np.flatnonzero(np.bincount(kinds) >= LEAST_DISTINCT):
        here = kinds == kind
        first = int(np.argmax(here))
        lights = tuple(int(light) for light in np.flatnonzero(seen[first]))
        pixels = receiving[here]
        channels = np.flatnonzero(lit[pixels].any(axis=0))
        weights = _weights(pair, truth, pixels, channels, lights) if len(lights) > 1 else None
        group = Group(shape=int(shapes[first]), lights=lights, pixels=pixels, channels=channels, weights=weights)
        found.append(group)
        wide = pixels[np.isin(pixels, wide_pixels(pair)[0])]
        if LEAST_DISTINCT <= len(wide) < len(pixels):
            found.append(replace(group, pixels=wide, weights=None, wide=True))
    return tuple(found)


def _weights(
    pair: Comparison, truth: StageImages, pixels: np.ndarray, channels: np.ndarray, lights: tuple[int, ...]
) -> np.ndarray:
    """Return each light's share of the irradiance, (n, channels, lights)."""
    position, normal = (truth[stage].reshape(-1, 3)[pixels] for stage in (Stage.POSITION, Stage.NORMAL))
    parts = np.zeros((len(pixels), len(channels), len(lights)))
    for place, number in enumerate(lights):
        light = pair.scene.lights[number]
        towards = np.asarray(light.position, dtype=np.float64) - position
        r = length(towards)
        arriving = np.maximum(dot(normal, towards), 0.0) / r
        if pair.scene.shading == "inverse_square":
            arriving = arriving / r**2
        parts[..., place] = arriving[:, np.newaxis] * np.asarray(light.flux)[channels]
    total = parts.sum(axis=-1, keepdims=True)
    return np.divide(parts, total, out=np.zeros_like(parts), where=total > 0)


# Factors that many pixels share: a wrong flux, albedo, pi or 4 moves them all alike, and rounding does not.
#
# Of a correct renderer each interior pixel's ours / theirs - 1 is s + e. The part s comes of what pixels share:
# constants, the scene's data, and what is made of them once; `bias_bounds.py` bounds it. The part e comes of
# roundings of numbers that differ from pixel to pixel. Its sign is as likely one as the other, so that s + e is
# beyond the bound of s in one direction with probability 1/2 at most. A group fails if more of its pixels are than
# chance allows: the sign test, which asks nothing of the distribution of e (Conover, Practical Nonparametric
# Statistics, 3rd ed., 1999, 3.4).


CHANNELS = "RGB"
TINY = 2.0**-126  # the smallest normal float32: what an output resolves below it is no step of its own


@dataclass(frozen=True, kw_only=True)
class Factor:
    """The factor that the pixels of one group share in one channel."""

    shape: int
    lights: tuple[int, ...]  # all that the group's pixels see
    fitted: int | None  # the light whose own factor it is, out of several that overlap; None: all of them together
    channel: int
    pixels: int
    value: float  # ours / theirs
    limit: float  # the largest |value - 1| of a correct renderer, and so the smallest factor that can be seen
    distinct: bool  # enough different values for the sign test; without them the limit is a pixel's
    wide: bool  # of pixels alone whose limits are wide

    @property
    def group(self) -> tuple[int, tuple[int, ...], int | None, bool]:
        """Return what tells its group from others of the same case."""
        return self.shape, self.lights, self.fitted, self.wide

    @property
    def ratio(self) -> float:
        """Return how far it is off over its limit."""
        off = abs(self.value - 1)
        return 0.0 if off == 0 else off / self.limit if self.limit > 0 else math.inf

    def sentence(self, stage: Stage, reference: str) -> str:
        """Return what is wrong where it is over its limit."""
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
        """Return the middle one of the groups' factors, as this case's word on what the whole run shares."""
        values = [one.value for one in self.factors if one.distinct and one.fitted is None and not one.wide]
        return float(np.median(values)) if values else None

    def recorded(self, own: "Factors | None" = None) -> Bias:
        """Return them by four digits, with those given the subject's `own` previous stages.

        Where all groups are within their limits, the one that is nearest to its limit stands for them; of the own ones
        groups are told only where one is over its limit.
        """
        ratio = _short(self.ratio)
        continued = None if own is None else own.recorded()
        if continued is not None and continued.ratio <= 1:
            continued = structs.replace(continued, groups=None)
        return Bias(
            ratio=1.001 if ratio == 1 < self.ratio else ratio,  # what is over its limit stays so
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


def bias(pair: Comparison, stage: Stage, ours: np.ndarray, value: np.ndarray | None) -> Factors:
    """Return the factors of `ours` (height, width, 3) over the oracle's stage, or over `value`.

    `value` is what the oracle continued from the subject's own stages.
    """
    bounds = stage_bounds(pair, stage, continued=value is not None)
    mine = ours.reshape(-1, ours.shape[-1])
    theirs = np.asarray(pair.truth[stage] if value is None else value, dtype=np.float64).reshape(mine.shape)
    # Where an output has steps it has a last one, and what is beyond is clamped to it.
    coarse = pair.subject.resolutions.get(stage)
    top = float(ours.max(initial=0.0)) if coarse is not None and coarse.absolute > TINY else math.inf
    top = min(top, _ceiling(pair))
    factors: list[Factor] = []
    for group, bound in zip(groups(pair), bounds.groups, strict=True):
        if group.wide and value is not None:
            continue  # given the stages before, these pixels have no wide limits
        here = np.ix_(group.pixels, group.channels)
        factors += _factors(group, bound, mine[here], theirs[here], top, floor(pair))
    wide = None
    if value is None:
        pixels = wide_pixels(pair)
        good = (theirs[pixels] > floor(pair)) & (theirs[pixels] < top) & np.isfinite(mine[pixels])
        wide = _leaning(mine[pixels][good], theirs[pixels][good], bounds.wide[good])
    return Factors(factors=tuple(factors), allowance=bounds.allowance, wide=wide)


def _leaning(ours: np.ndarray, theirs: np.ndarray, shared: np.ndarray) -> Leaning:
    """Return to which side values (n,) are off by more than what they share with others."""
    off, first = np.unique((ours - theirs) / theirs, return_index=True)
    shared = shared[first]
    return Leaning(pixels=len(off), above=int(np.sum(off > shared)), below=int(np.sum(-off > shared)))


def _ceiling(pair: Comparison) -> float:
    return float(np.finfo(pair.subject.precision).max)


def _factors(
    group: Group, bound: Bounds, ours: np.ndarray, theirs: np.ndarray, ceiling: float, floor: float
) -> list[Factor]:
    """Return a group's factors: of all its lights together, and of each where they are several."""
    good = (theirs > floor) & (theirs < ceiling) & (ours > 0) & (ours < ceiling)
    lit = np.flatnonzero(good.any(axis=0))
    weights = group.weights
    if not good.all():
        kept = np.flatnonzero(good[:, lit].all(axis=1)) if len(lit) else lit
        if len(kept) < LEAST_DISTINCT:
            return []
        here = np.ix_(kept, lit)
        ours, theirs, whole = ours[here], theirs[here], bound.whole[here]
        bound = Bounds(shared=bound.shared[here], whole=whole, usual=np.median(whole, axis=0))
        weights = None if weights is None else weights[here]
    off = (ours - theirs) / theirs  # ours / theirs - 1 would be off by a rounding of 1
    ordered = np.sort(off, axis=0)
    count = len(off)
    middle = (ordered[(count - 1) // 2] + ordered[count // 2]) / 2
    distinct = 1 + np.count_nonzero(np.diff(ordered, axis=0), axis=0)
    beyond = np.sort(np.where(middle >= 0, off, -off) - bound.shared, axis=0)
    found = []
    for place, channel in enumerate(int(group.channels[each]) for each in lit):
        value, limit, enough = float(middle[place]), float(bound.usual[place]), distinct[place] >= LEAST_DISTINCT
        if enough:
            # Moved by this much more, so many pixels would be beyond the bound that chance cannot have done it.
            rank = int(count * least_share(int(distinct[place])))
            limit = min(limit, abs(value) - float(beyond[rank, place]))
        about = _About(group=group, channel=channel, pixels=count)
        found.append(about.factor(value, limit, distinct=bool(enough)))
        if weights is not None and enough:
            found += _fitted(about, weights[:, place], off[:, place], bound, place)
    return found


@dataclass(frozen=True, kw_only=True)
class _About:
    """What a group's factors in one channel have in common."""

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

    The fit is linear in `off`, so that it carries bounds over as they are: what pixels share by the absolute values of
    its coefficients, what they do not by Hoeffding's inequality (1963) with the largest residual for its range. A fit
    so badly conditioned that a single pixel says more of that light is left out.
    """
    seen = np.flatnonzero((weights > 0).any(axis=0))
    shares = weights[:, seen]
    solution = np.linalg.pinv(shares)  # (lights, n)
    values = solution @ off
    left = float(np.abs(off - shares @ values).max())
    spread = left * math.sqrt(2 * math.log(2 / CHANCE)) * np.sqrt((solution**2).sum(axis=1))
    limits = np.abs(solution) @ bound.shared[:, place] + spread
    with np.errstate(divide="ignore"):
        pixel = np.median(bound.whole[:, place, np.newaxis] / shares, axis=0)
    return [
        about.factor(float(value), float(limit), distinct=True, fitted=about.group.lights[light])
        for light, value, limit, worst in zip(seen, values, limits, pixel, strict=True)
        if limit < worst
    ]


def _short(number: float) -> float:
    """Return a number in the four digits that anybody reads."""
    return float(f"{number:.4g}") if math.isfinite(number) else number
