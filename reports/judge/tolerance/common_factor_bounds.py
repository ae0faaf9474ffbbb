"""Groups of pixels that share a factor if anything does, and what such a factor may be of a correct renderer.

What pixels share is a constant, a datum of the scene, or made of these once for many pixels. Constants are rounded
once each and once more where two are put together. A datum is rounded as such, and where it is carried into the frame
in which it is used; the derivatives by which that moves light are those of the limits. docs/judging.md derives it.
"""

from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.tolerance.channels import dot, length
from rayproof.reports.judge.tolerance.limits import Roundoff, continued_light_limit
from rayproof.reports.judge.tolerance.output_resolution import Coarseness, irradiance_moved
from rayproof.reports.judge.tolerance.pair_limits import Terms, roundoff
from rayproof.reports.results.ratios import LEAST_DISTINCT

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


def floor(terms: Terms) -> float:
    """Return the value below which a rounding is no longer small beside it."""
    numbers = np.finfo(terms.candidate.precision)
    return float(numbers.tiny / numbers.eps)


def stage_bounds(terms: Terms, stage: Stage, *, continued: bool) -> StageBounds:
    """Return the bounds of every group at one stage, end to end or given the candidate's own previous stages."""
    key = ("bias bounds", stage, terms.rules, continued)
    return terms.ground.once(key, lambda: _stage_bounds(terms, stage, continued=continued))


def _stage_bounds(terms: Terms, stage: Stage, *, continued: bool) -> StageBounds:
    truth, candidate = terms.truth, terms.candidate
    constants = sum(Roundoff(party.precision)(CONSTANTS[stage]) for party in (candidate, terms.witness))
    (shared_own, whole_own), (shared, whole) = terms.ground.once(
        ("bias light", terms.rules), lambda: _light_bounds(terms)
    )
    if continued:
        # Passes of their own are each off by their own end-to-end error, and so is what they are continued from.
        own, passes = float(stage is Stage.IRRADIANCE), 0.0 if candidate.chained else 2.0
        with np.errstate(invalid="ignore"):  # 0 times infinity, where no light arrives and no group is
            shared, whole = own * shared_own + passes * shared, own * whole_own + passes * whole
    steps = _steps(terms, stage, continued=continued)
    values = truth[stage].reshape(-1, truth[stage].shape[-1])
    pixels = wide_pixels(terms)
    with np.errstate(divide="ignore", invalid="ignore"):  # the back of a surface is black
        wide = constants + shared[pixels] + (0.0 if steps is None else steps[pixels] / values[pixels])
    found, share = [], []
    for group in groups(terms):
        here = np.ix_(group.pixels, group.channels)
        theirs = values[here]
        stepped = 0.0 if steps is None else np.divide(steps[here], theirs, out=np.zeros_like(theirs), where=theirs > 0)
        limits = constants + whole[here] + stepped
        usual = np.median(limits, axis=0)
        found.append(Bounds(shared=constants + shared[here] + stepped, whole=limits, usual=usual))
        if not group.wide:
            share.append(float(np.median(stepped)))
    return StageBounds(groups=tuple(found), wide=wide, allowance=constants + max(share, default=0.0))


def _steps(terms: Terms, stage: Stage, *, continued: bool) -> np.ndarray | None:
    """Return what the steps of the parties' outputs add, (n, 3) in the stage's unit, or None where there are none."""
    parties = terms.candidate, terms.witness
    if not any(party.resolutions for party in parties):
        return None
    mine, other = (Coarseness(resolutions=party.resolutions) for party in parties)
    value = terms.truth[stage]
    steps = np.zeros_like(value) + mine.step(stage, value) + other.step(stage, value)
    if continued:
        steps = steps + mine.handed_down(terms.scene, stage, terms.truth, terms.conditioning)
    return steps.reshape(-1, value.shape[-1])


def _light_bounds(terms: Terms) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return what is shared and all of what light may be off by, relative (n, 3): on its own, and end to end.

    Constants are not in it. Albedo and pi are such: what is relative to irradiance is so to exitance and radiance.
    """
    scene, truth, parties, c = terms.scene, terms.truth, (terms.candidate, terms.witness), terms.conditioning
    irradiance, roundoffs = truth[Stage.IRRADIANCE], tuple(map(roundoff, parties))
    limits = terms.ground.together(*roundoffs, by_matrices=(parties[0].by_matrices, parties[1].by_matrices))
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


def wide_pixels(terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    """Return the interior pixels that receive light and are held to a limit of more than `WIDE` of it.

    As flat indices (n,) and each one's brightest channel (n,).
    """
    return terms.ground.once(("wide pixels", terms.rules), lambda: _wide_pixels(terms))


def _wide_pixels(terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    value = terms.truth[Stage.IRRADIANCE].reshape(-1, terms.truth[Stage.IRRADIANCE].shape[-1])
    pixels = _receiving(terms)
    limit = terms.limits.end_to_end[Stage.IRRADIANCE].reshape(value.shape)[pixels]
    pixels = pixels[(limit > WIDE * value[pixels]).any(axis=1)]
    return pixels, value[pixels].argmax(axis=1)


def groups(terms: Terms) -> tuple[Group, ...]:
    """Return the groups of interior pixels that receive light, of `LEAST_DISTINCT` pixels at least."""
    return terms.ground.once(("bias groups", terms.rules), lambda: _groups(terms))


def _lit(terms: Terms) -> np.ndarray:
    """Return the channels (pixels, 3) that receive light of a size at which a rounding is small."""
    value = terms.truth[Stage.IRRADIANCE].reshape(-1, terms.truth[Stage.IRRADIANCE].shape[-1])
    return (value > floor(terms)) & np.isfinite(value)


def _receiving(terms: Terms) -> np.ndarray:
    """Return the interior pixels that receive light, as flat indices."""
    interior = terms.conditioning.hit & ~terms.classes.edge(Stage.IRRADIANCE) & ~terms.near
    return np.flatnonzero(interior.ravel() & _lit(terms).any(axis=1))


def _groups(terms: Terms) -> tuple[Group, ...]:
    truth, lit, candidates = terms.truth, _lit(terms), _receiving(terms)
    value = truth[Stage.IRRADIANCE].reshape(-1, truth[Stage.IRRADIANCE].shape[-1])
    seen = truth[Stage.VISIBILITY].reshape(len(value), -1)[candidates] > 0
    shapes = truth[Stage.OBJECT][..., 0].ravel()[candidates]
    kinds = np.unique(shapes, return_inverse=True)[1]
    for light in range(seen.shape[1]):
        kinds = np.unique(2 * kinds + seen[:, light], return_inverse=True)[1]
    found = []
    for kind in np.flatnonzero(np.bincount(kinds) >= LEAST_DISTINCT):
        here = kinds == kind
        first = int(np.argmax(here))
        lights = tuple(int(light) for light in np.flatnonzero(seen[first]))
        pixels = candidates[here]
        channels = np.flatnonzero(lit[pixels].any(axis=0))
        weights = _weights(terms, truth, pixels, channels, lights) if len(lights) > 1 else None
        group = Group(shape=int(shapes[first]), lights=lights, pixels=pixels, channels=channels, weights=weights)
        found.append(group)
        wide = pixels[np.isin(pixels, wide_pixels(terms)[0])]
        if LEAST_DISTINCT <= len(wide) < len(pixels):
            found.append(replace(group, pixels=wide, weights=None, wide=True))
    return tuple(found)


def _weights(
    terms: Terms, truth: StageImages, pixels: np.ndarray, channels: np.ndarray, lights: tuple[int, ...]
) -> np.ndarray:
    """Return each light's share of the irradiance, (n, channels, lights)."""
    position, normal = (truth[stage].reshape(-1, 3)[pixels] for stage in (Stage.POSITION, Stage.NORMAL))
    parts = np.zeros((len(pixels), len(channels), len(lights)))
    for place, number in enumerate(lights):
        light = terms.scene.lights[number]
        towards = np.asarray(light.position, dtype=np.float64) - position
        r = length(towards)
        arriving = np.maximum(dot(normal, towards), 0.0) / r
        if terms.scene.shading == "inverse_square":
            arriving = arriving / r**2
        parts[..., place] = arriving[:, np.newaxis] * np.asarray(light.flux)[channels]
    total = parts.sum(axis=-1, keepdims=True)
    return np.divide(parts, total, out=np.zeros_like(parts), where=total > 0)
