"""Mistakes of shadow rays: their start and end, their blockers, and the test of the horizon."""

from collections.abc import Callable

import numpy as np

from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, Freedom, RaysToLight, Rows
from rayproof.reference.analytic.surfaces import Between, surface_of
from rayproof.reference.analytic.vectors import dot, length
from rayproof.reports.mistakes import Family, Mistake, family, known, variant

OWN = 1e-7  # as a share of the shadow ray's length: a nearer crossing with the same shape is the start itself


class AlongShadowRays(Mistake):
    """Shadow rays are traced from their start, where s = 0, to the light, where s = 1."""

    def interval(self, light: PointLight, starts: np.ndarray) -> Between:
        """Return the open interval of s in which blockers count."""
        return 0.0, 1.0

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return a mask (N,) of the shadow rays that cross the shape in this interval."""
        low, high = (np.broadcast_to(end, len(rays.starts)) for end in self.interval(rays.light, rays.starts))
        own, blocked = rays.objects[:, 0] == index, np.zeros(len(rays.starts), dtype=bool)
        for chunk, _, crossing in surface_of(scene.shapes[index]).meetings(rays.source, rays.segments):
            s = 1 - crossing
            inside = (s > low[chunk, np.newaxis]) & (s < high[chunk, np.newaxis])
            inside &= ~own[chunk, np.newaxis] | (np.abs(s) > OWN)
            blocked[chunk] |= inside.any(axis=1)
        return blocked


def _along(name: str, sentence: str, *items: str, interval: Callable[[PointLight, np.ndarray], Between]) -> None:
    known(name, sentence, *items)(
        type(name, (AlongShadowRays,), {"interval": lambda _, light, starts: interval(light, starts)})
    )


def _metres(light: PointLight, starts: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return 1 / length(np.asarray(light.position) - starts)


_along("beyond_the_light", "lets shapes behind a light cast shadows", "LIT-1", interval=lambda light, p: (0.0, np.inf))
_along(
    "blockers_behind",
    "counts blockers behind the point from which a shadow ray starts, too",
    "LIT-1",
    interval=lambda light, p: (-np.inf, 1.0),
)
_along(
    "whole_line",
    "counts blockers behind the light and behind the point",
    "LIT-1",
    interval=lambda light, p: (-np.inf, np.inf),
)
_along(
    "unit_shadow_rays",
    "gives shadow rays length 1 but compares their t with 1, so that blockers farther than 1 m are missed",
    "LIT-1",
    interval=lambda light, p: (0.0, _metres(light, p)),
)
_along(
    "half_way",
    "lets only the nearer half of the way to a light be blocked",
    "LIT-1",
    interval=lambda light, p: (0.0, 0.5),
)


@family(
    "shadow_ray_length",
    "lets its shadow rays end at {0} times the way to the light",
    "LIT-1",
    starts=[(0.5, 0.8, 0.9, 1.1, 1.3, 2.0)],
)
class ShadowRayLength(Family, AlongShadowRays):
    """The interval ends before or behind the light."""

    jumps = True

    def interval(self, light: PointLight, starts: np.ndarray) -> Between:
        """Return the interval up to the parameter."""
        return 0.0, self.numbers[0]


OFFSETS = (1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2)


@family(
    "shadow_ray_offset",
    "starts its shadow rays {0} m above the surface, so that nearer blockers are missed",
    "LIT-5",
    "LIT-3",
    starts=[OFFSETS],
)
class ShadowRayOffset(Family):
    """Shadow rays start above the surface; the horizon is tested at the surface."""

    jumps = True

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return the visibility (N, lights) from the moved points, where every crossing blocks."""
        objects, points = rows[Stage.OBJECT], rows[Stage.POSITION]
        starts = points + self.numbers[0] * rows[Stage.NORMAL]
        nobody = np.where(objects >= 0, len(scene.shapes), -1.0)
        answer = np.zeros((len(objects), len(scene.lights)))
        for column, light in enumerate(scene.lights):
            free = (objects[:, 0] >= 0) & self.above_horizon(scene, light, points, rows)
            for index in range(len(scene.shapes)):
                free &= ~self.blocked(scene, index, RaysToLight(light, nobody, starts))
            answer[:, column] = free
        return answer


@family(
    "shadow_ray_skip",
    "does not see blockers nearer than {0} m to the point from which a shadow ray starts",
    "LIT-5",
    "LIT-2",
    starts=[OFFSETS],
)
class ShadowRaySkip(Family, AlongShadowRays):
    """Crossings count only from some distance to the start of the shadow ray."""

    jumps = True

    def interval(self, light: PointLight, starts: np.ndarray) -> Between:
        """Return the interval from this distance."""
        return self.numbers[0] * _metres(light, starts), 1.0


@known("no_shadows", "casts no shadows", "LIT-1")
class NoShadows(Mistake):
    """Nothing blocks."""

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return False."""
        return np.zeros(len(rays.starts), dtype=bool)


@known("own_shape_passes", "lets no shape cast a shadow on itself", "LIT-1", "LIT-5")
class OwnShapePasses(Mistake):
    """A shape does not block the light of its own points."""

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return a mask (N,) of the shadow rays that start on another shape and are blocked by this one."""
        return super().blocked(scene, index, rays) & (rays.objects[:, 0] != index)


@known("shadows_inverted", "takes what is blocked for visible", "LIT-1")
class Inverted(Mistake):
    """Lights above the horizon are visible if they are blocked."""

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return the inverted visibility (N, lights) of lights above the horizon."""
        visible, hit = super().visibility(scene, rows, freedom), rows[Stage.OBJECT][:, 0] >= 0
        for column, light in enumerate(scene.lights):
            above = hit & self.above_horizon(scene, light, rows[Stage.POSITION], rows)
            visible[:, column] = above & (visible[:, column] == 0)
        return visible


def _side(self: Mistake, scene: Scene, rows: Rows) -> np.ndarray:
    """Return the outward normals (N, 3) of hits, not turned towards the viewer."""
    objects, outward = rows[Stage.OBJECT], np.zeros((len(rows[Stage.OBJECT]), 3))
    for index in range(len(scene.shapes)):
        here = objects[:, 0] == index
        if here.any():
            outward[here] = self.outward_normals(scene, index, rows[Stage.POSITION][here], objects[here, 1])
    return outward


@known(
    "shadow_rays_from_the_front",
    "starts its shadow rays on the front side of two-sided surfaces, even where these are seen from behind",
    "LIT-5",
)
class FromTheFront(Mistake):
    """The surface itself blocks the light if it is seen from behind."""

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return the visibility (N, lights), zero if the normal was turned."""
        turned = dot(_side(self, scene, rows), rows[Stage.NORMAL]) < 0
        return super().visibility(scene, rows, freedom) * ~turned[:, np.newaxis]


@known("shadow_rays_from_below", "starts its shadow rays below the surface", "LIT-5")
class FromBelow(Mistake):
    """The surface itself blocks every light above its horizon."""

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return zeros (N, lights)."""
        return np.zeros((len(rows[Stage.OBJECT]), len(scene.lights)))


@known("horizon_reversed", "asks the wrong way round whether a light is above the horizon", "LIT-1")
class HorizonReversed(Mistake):
    """Shadow rays are sent to lights below the horizon."""

    def above_horizon(self, scene: Scene, light: PointLight, starts: np.ndarray, rows: Rows) -> np.ndarray:
        """Return a mask (N,) of the hits with the light below their horizon."""
        return dot(rows[Stage.NORMAL], np.asarray(light.position) - rows[Stage.POSITION]) < 0


class NoHorizon(Mistake):
    """Shadow rays are sent to lights on both sides of a surface, and start on the light's side."""

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return visibility from the light's side of each surface."""
        above = super().visibility(scene, rows, freedom)
        below = super().visibility(scene, {**rows, Stage.NORMAL: -rows[Stage.NORMAL]}, freedom)
        return np.maximum(above, below)

    def signed(self, cosine: np.ndarray) -> np.ndarray:
        """Return the factor that replaces the cosine, which may be negative."""
        return cosine

    def irradiance_of(self, scene: Scene, light: PointLight, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return the light's share of irradiance with this factor instead of the cosine."""
        offset = np.asarray(light.position) - positions
        with np.errstate(all="ignore"):
            cosine = dot(normals, offset) / length(offset)
            toward = offset / length(offset)[:, np.newaxis]
            full = super().irradiance_of(scene, light, positions, toward)
            return full * np.nan_to_num(self.signed(cosine))[:, np.newaxis]


RAD2 = ("RAD-2", "LIT-1")
for _name, _sentence, _signed in (
    (
        "cosine_not_clamped",
        "neither clamps the cosine to zero nor asks whether the light is above the horizon",
        lambda _, c: c,
    ),
    (
        "cosine_absolute",
        "takes the absolute value of the cosine, so that surfaces are lit from behind",
        lambda _, c: np.abs(c),
    ),
    ("wrapped_cosine", "takes (1 + cosine) / 2 for the cosine", lambda _, c: (1 + c) / 2),
):
    known(_name, _sentence, *RAD2)(type(_name, (NoHorizon,), {"signed": _signed}))


class Unblocked(NoHorizon):
    """Lights below the horizon count even if they are blocked."""

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return the visibility (N, lights), one for every light below the horizon."""
        return np.maximum(Analytic.visibility(self, scene, rows, freedom), _below(scene, rows))


def _below(scene: Scene, rows: Rows) -> np.ndarray:
    """Return a mask (N, lights) of the lights below each hit's horizon."""
    below_horizon = np.zeros((len(rows[Stage.OBJECT]), len(scene.lights)))
    for column, light in enumerate(scene.lights):
        below = dot(rows[Stage.NORMAL], np.asarray(light.position) - rows[Stage.POSITION]) < 0
        below_horizon[:, column] = below & (rows[Stage.OBJECT][:, 0] >= 0)
    return below_horizon


variant("cosine_not_clamped")(Unblocked)
