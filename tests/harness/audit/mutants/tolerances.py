"""Mutants of tolerances: intersections and shadow rays with one number put where none belongs.

Every formula looks at the oracle's crossings and takes some away, or adds some: what a textbook formula with `epsilon`
in its test does to them. A crossing is t along a ray of the camera (unit length) or along a shadow ray from the light
(0) to the point (1). An absolute tolerance has the unit of what it is compared with; a relative one is a share of it.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

import numpy as np

from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.surfaces import Ellipsoid, Flat, Polygons, surface_of
from rayproof.reference.analytic.vectors import cross, dot, length
from tests.harness.audit.faults import altered as patched
from tests.harness.audit.mutants import ORACLE, PREFIX, Mutant, Rows, Step, hits

SIZES = (1e-2, 1e-4, 1e-6, 1e-8)
# Crossings (rays, faces), from (surface, apex, directions (rays, 3), faces, crossings, tolerance).
Cut = Callable[[Any, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]


def _lost(crossings: np.ndarray, where: np.ndarray) -> np.ndarray:
    return np.where(where, np.nan, crossings)


# Faces: triangles have three corners, squares four, cubes six faces of four.


def _parallel(
    surface: Polygons, _apex: Any, rays: np.ndarray, faces: Any, t: Any, size: float, *, relative: bool
) -> Any:
    """Call rays parallel whose determinant, an area, is below the size."""
    normals = surface.normals[faces]
    scale = length(rays)[:, np.newaxis] * length(normals) if relative else 1.0
    return _lost(t, np.abs(rays @ normals.T) < size * scale)


def _within(
    surface: Polygons,
    apex: np.ndarray,
    rays: np.ndarray,
    faces: Any,
    *,
    relative: bool,
    precision: type[np.floating] = np.float64,
) -> tuple[np.ndarray, np.ndarray]:
    """Return each ray's crossing of each face's plane, and how far inside of the nearest edge it lies, -: outside.

    As a share of the face's height over the edge (a barycentric coordinate), or in metres.
    """
    corners = surface.corners[faces].astype(precision)
    start, apex, rays = corners[:, 0], apex.astype(precision), rays.astype(precision)
    first, second = corners[:, 1] - start, corners[:, -1] - start
    normals = cross(first, second).astype(precision)
    area = dot(normals, normals)[:, np.newaxis]
    along = (cross(second, normals).astype(precision) / area, cross(normals, first).astype(precision) / area)
    t = dot(start - apex, normals) / (rays @ normals.T)
    u, v = (dot(apex - start, slope) + t * (rays @ slope.T) for slope in along)
    if corners.shape[1] == 3:
        shares = [(u, along[0]), (v, along[1]), (1 - u - v, along[0] + along[1])]
    else:
        shares = [(u, along[0]), (1 - u, along[0]), (v, along[1]), (1 - v, along[1])]
    return t, np.min([share if relative else share / length(slope) for share, slope in shares], axis=0)


def _shrunk(surface: Polygons, apex: Any, rays: np.ndarray, faces: Any, t: Any, size: float, *, relative: bool) -> Any:
    return _lost(t, ~(_within(surface, apex, rays, faces, relative=relative)[1] >= size))


def _grown(surface: Polygons, apex: Any, rays: np.ndarray, faces: Any, t: Any, size: float, *, relative: bool) -> Any:
    plane, inside = _within(surface, apex, rays, faces, relative=relative)
    return np.where(np.isnan(t) & (inside >= -size), plane, t)


def _strict(surface: Polygons, apex: Any, rays: np.ndarray, faces: Any, t: Any, _size: float, *, precision: Any) -> Any:
    """Lose what lies on an edge to the last bit of a precision."""
    return _lost(t, ~(_within(surface, apex, rays, faces, relative=True, precision=precision)[1] > 0))


def _small_faces(surface: Polygons, _apex: Any, _rays: Any, faces: Any, t: Any, size: float, *, relative: bool) -> Any:
    areas = length(surface.normals) / 2
    return _lost(t, areas[faces] < size * (areas.max() if relative else 1.0))


def _outside_box(surface: Any, apex: Any, rays: np.ndarray, _faces: Any, t: Any, size: float, *, relative: bool) -> Any:
    """Lose what lies outside a bounding box that is too small on all sides."""
    low, high = _box(surface)
    margin = size * (high - low) if relative else np.full(3, size)
    points = apex + t[..., np.newaxis] * rays[:, np.newaxis]
    return _lost(t, np.any((points < low + margin) | (points > high - margin), axis=-1))


def _box(surface: Any) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(surface, Ellipsoid):
        reach = length(surface.axes)
        return surface.center - reach, surface.center + reach
    return surface.corners.min(axis=(0, 1)), surface.corners.max(axis=(0, 1))


def _beside_box(surface: Any, apex: Any, rays: np.ndarray, _faces: Any, t: Any, size: float, *, relative: bool) -> Any:
    """Take rays for parallel to slabs of the bounding box, so that they must start between them."""
    low, high = _box(surface)
    parallel = np.abs(rays) < size * (length(rays)[:, np.newaxis] if relative else 1.0)
    return _lost(t, np.any(parallel & ((apex < low) | (apex > high)), axis=1)[:, np.newaxis])


def _cube_parallel(
    surface: Polygons, apex: Any, rays: np.ndarray, faces: Any, t: Any, size: float, *, relative: bool
) -> Any:
    """Take rays for parallel to a cube's slabs in object space."""
    corners = surface.corners
    axes = np.stack([corners[2 * axis + 1].mean(axis=0) - corners[2 * axis].mean(axis=0) for axis in range(3)], axis=1)
    local, start = rays @ np.linalg.inv(axes).T, np.linalg.inv(axes) @ (apex - corners.mean(axis=(0, 1)))
    parallel = np.abs(local) < size * (length(local)[:, np.newaxis] if relative else 1.0)
    missed = np.any(parallel & (np.abs(start) > 0.5), axis=1)
    return _lost(t, missed[:, np.newaxis] | parallel[:, np.asarray(faces) // 2])


def _grazing(
    surface: Ellipsoid, _apex: Any, rays: np.ndarray, _faces: Any, t: Any, size: float, *, relative: bool
) -> Any:
    """Lose a sphere where the square of half the chord, which is the discriminant over A, is below the size."""
    speed = length(rays @ surface.to_unit.T) if relative else length(rays)
    return _lost(t, (np.square((t[:, 1] - t[:, 0]) / 2 * speed) < size)[:, np.newaxis])


def _plane_parallel(
    surface: Flat, _apex: Any, rays: np.ndarray, _faces: Any, t: Any, size: float, *, relative: bool
) -> Any:
    return _lost(t, (np.abs(rays @ surface.normal) < size * (length(rays) if relative else 1.0))[:, np.newaxis])


def _anywhere(_surface: Any) -> bool:
    return True


def _faces_of(corners: int, least: int = 1, most: float = np.inf) -> Callable[[Any], bool]:
    return lambda surface: (
        isinstance(surface, Polygons) and surface.corners.shape[1] == corners and least <= len(surface.corners) <= most
    )


TRIANGLES, SQUARE, CUBE = _faces_of(3), _faces_of(4, most=1), _faces_of(4, least=6)
MESH = _faces_of(3, least=2)
SPHERE: Callable[[Any], bool] = lambda surface: isinstance(surface, Ellipsoid)  # noqa: E731
PLANE: Callable[[Any], bool] = lambda surface: isinstance(surface, Flat)  # noqa: E731
BOTH = (False, True)  # absolute and relative

# formula -> what is done with the tolerance, to which surfaces, and how
CUTS: Mapping[str, tuple[str, Callable[[Any], bool], Callable[..., np.ndarray]]] = {
    "triangle.parallel": ("calls rays parallel to a triangle", TRIANGLES, _parallel),
    "triangle.edges_inside": ("wants hits of triangles so far inside of the edges", TRIANGLES, _shrunk),
    "triangle.edges_outside": ("takes hits so far outside of a triangle's edges", TRIANGLES, _grown),
    "triangle.area": ("drops triangles of so small an area", TRIANGLES, _small_faces),
    "square.parallel": ("calls rays parallel to a square", SQUARE, _parallel),
    "square.edges_inside": ("wants hits of squares so far inside of the edges", SQUARE, _shrunk),
    "square.edges_outside": ("takes hits so far outside of a square's edges", SQUARE, _grown),
    "cube.parallel": ("calls rays parallel to a cube's slabs", CUBE, _cube_parallel),
    "cube.edges_inside": ("wants hits of cubes so far inside of the edges", CUBE, _shrunk),
    "cube.edges_outside": ("takes hits so far outside of a cube's edges", CUBE, _grown),
    "plane.parallel": ("calls rays parallel to a plane", PLANE, _plane_parallel),
    "sphere.discriminant": ("misses spheres whose discriminant is so small", SPHERE, _grazing),
    "sphere.box": ("has boxes around spheres that are so much too small", SPHERE, _outside_box),
    "mesh.box": ("has boxes around meshes that are so much too small", MESH, _outside_box),
    "mesh.box_parallel": ("calls rays parallel to the slabs of a mesh's box", MESH, _beside_box),
}


class _Cutting(AbstractContextManager[None]):
    """The oracle's crossings, cut until the block ends."""

    def __init__(self, where: Callable[[Any], bool], cut: Callable[..., np.ndarray]) -> None:
        self._where, self._cut = where, cut
        self._patches: list[AbstractContextManager[None]] = []

    def __enter__(self) -> None:
        where, cut = self._where, self._cut
        meetings, crossings, plane = Polygons.meetings, Ellipsoid.crossings, Flat.meetings

        def cut_meetings(self: Polygons, apex: np.ndarray, directions: np.ndarray) -> Iterator[Any]:
            for rays, faces, t in meetings(self, apex, directions):
                yield rays, faces, cut(self, apex, directions[rays], faces, t) if where(self) else t

        def cut_crossings(self: Ellipsoid, apex: np.ndarray, directions: np.ndarray) -> np.ndarray:
            t = crossings(self, apex, directions)
            return cut(self, apex, directions, np.zeros(1, dtype=int), t) if where(self) else t

        def cut_plane(self: Flat, apex: np.ndarray, directions: np.ndarray) -> Iterator[Any]:
            for rays, pieces, t in plane(self, apex, directions):
                yield rays, pieces, cut(self, apex, directions[rays], pieces, t) if where(self) else t

        self._patches = [
            patched(Polygons, "meetings", cut_meetings),
            patched(Ellipsoid, "crossings", cut_crossings),
            patched(Flat, "meetings", cut_plane),
        ]
        for patch in self._patches:
            patch.__enter__()

    def __exit__(self, *_: object) -> None:
        for patch in reversed(self._patches):
            patch.__exit__(None, None, None)


def _cut_hits(where: Callable[[Any], bool], cut: Callable[..., np.ndarray], scene: Scene, rows: Rows) -> np.ndarray:
    with _Cutting(where, cut):
        return hits(scene, rows)


def _cut_shadow_rays(
    where: Callable[[Any], bool], cut: Callable[..., np.ndarray], scene: Scene, rows: Rows
) -> np.ndarray:
    with _Cutting(where, cut):
        return ORACLE.continued(scene, Stage.VISIBILITY, rows)


def _shadow_ray_cut(kind: str, size: float, relative: bool) -> Callable[..., np.ndarray]:
    """Return the cut of shadow rays that begin after the point, end before the light, or end behind it."""

    def cut(_surface: Any, _apex: Any, segments: np.ndarray, _faces: Any, t: np.ndarray) -> np.ndarray:
        share = size if relative else size / length(segments)[:, np.newaxis]
        if kind == "shadow_ray.start":
            return _lost(t, t > 1 - share)
        if kind == "shadow_ray.end_before":
            return _lost(t, t < share)
        return np.where((t <= 0) & (t > -share), 0.25, t)  # counts as if it lay between

    return cut


def _clipped(kind: str, size: float, relative: bool, scene: Scene, rows: Rows) -> np.ndarray:
    """Return hits in an interval whose near end begins, or whose far end ends, too late or too early."""
    interval = Analytic.clip_interval
    sign = -1.0 if kind.endswith("early") else 1.0

    def moved(self: Analytic, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        low, high = interval(self, scene, directions)
        if kind.startswith("near"):
            return (low * (1 + sign * size) if relative else low + sign * size), high
        return low, (high * (1 + sign * size) if relative else high + sign * size)

    with patched(Analytic, "clip_interval", moved):
        return hits(scene, rows)


def _nearest(kind: str, size: float, relative: bool, scene: Scene, rows: Rows) -> np.ndarray:
    """Return hits where a later shape must be nearer by so much, or may be farther by so much, to count."""
    rays, eye = rows[Stage.RAY], np.asarray(scene.camera.eye, dtype=np.float64)
    low, high = ORACLE.clip_interval(scene, rays)
    sign = 1.0 if kind == "nearest.later" else -1.0
    found = np.full((len(rays), 3), -1.0)
    found[:, 2] = np.inf
    for index, shape in enumerate(scene.shapes):
        crossing, face, _ = surface_of(shape).first(eye, rays, low, high)
        best = found[:, 2]
        limit = best * (1 + sign * size) if relative else best + sign * size
        better = np.isfinite(crossing) & (crossing < limit)
        found[better] = np.column_stack([np.full(better.sum(), index), face[better], crossing[better]])
    return found


def _horizon(size: float, scene: Scene, rows: Rows) -> np.ndarray:
    """Return visibility where a light must be so far above the horizon, by its cosine."""

    def above(self: Analytic, scene: Scene, light: PointLight, starts: np.ndarray, rows: Rows) -> np.ndarray:
        offset = np.asarray(light.position) - starts
        return dot(rows[Stage.NORMAL], offset) > size * length(offset)

    with patched(Analytic, "above_horizon", above):
        return ORACLE.continued(scene, Stage.VISIBILITY, rows)


def _moved_start(size: float, relative: bool, scene: Scene, rows: Rows) -> np.ndarray:
    """Return visibility if shadow rays start off the hit, by metres or by a share of the coordinates."""
    positions, normals = rows[Stage.POSITION], rows[Stage.NORMAL]
    reach = size * (np.abs(positions).max(axis=1, keepdims=True) if relative else 1.0)
    return ORACLE.continued(scene, Stage.VISIBILITY, {**rows, Stage.POSITION: positions + reach * normals})


def _near_lights(kind: str, size: float, scene: Scene, rows: Rows) -> np.ndarray:
    """Return irradiance by distances to the light that are at least the size, or are longer by it."""
    total = np.zeros((len(rows[Stage.POSITION]), 3))
    for column, lamp in enumerate(scene.lights):
        seen = rows[Stage.VISIBILITY][:, column : column + 1] > 0
        arriving = np.where(seen, ORACLE.irradiance_of(scene, lamp, rows[Stage.POSITION], rows[Stage.NORMAL]), 0)
        distance = length(np.asarray(lamp.position) - rows[Stage.POSITION])[:, np.newaxis]
        if kind == "light.least_distance":
            factor = np.square(distance / np.maximum(distance, size))
        else:
            factor = distance / (distance + size)
        total += np.where(arriving > 0, arriving * factor, 0)
    return np.where(rows[Stage.OBJECT][:, :1] >= 0, total, 0)


def mutants() -> Iterator[Mutant]:
    """Yield every formula with every tolerance, absolute and relative."""
    for size in SIZES:
        for relative in BOTH:
            for formula, (what, where, cut) in CUTS.items():
                changed = _fixed(cut, size, relative)
                steps: dict[Stage, Step] = {
                    Stage.OBJECT: partial(_cut_hits, where, changed),
                    Stage.VISIBILITY: partial(_cut_shadow_rays, where, changed),
                }
                yield _mutant(formula, size, relative, what, steps)
            for kind, what in SHADOW_RAYS.items():
                cut = _shadow_ray_cut(kind, size, relative)
                yield _mutant(kind, size, relative, what, {Stage.VISIBILITY: partial(_cut_shadow_rays, _anywhere, cut)})
            moved = partial(_moved_start, size, relative)
            yield _mutant(
                "shadow_ray.offset", size, relative, "moves shadow rays along the normal", {Stage.VISIBILITY: moved}
            )
            for kind, what in CLIPS.items():
                clipped = partial(_clipped, kind.removeprefix("clip."), size, relative)
                yield _mutant(kind, size, relative, what, {Stage.OBJECT: clipped})
            for kind, what in NEAREST.items():
                chosen = partial(_nearest, kind, size, relative)
                yield _mutant(kind, size, relative, what, {Stage.OBJECT: chosen})
        horizon = partial(_horizon, size)
        yield _mutant(
            "shadow_ray.horizon", size, None, "wants lights so far above the horizon", {Stage.VISIBILITY: horizon}
        )
        for kind, what in LIGHTS.items():
            arriving = partial(_near_lights, kind, size)
            yield _mutant(kind, size, None, what, {Stage.IRRADIANCE: arriving})
    for name, precision in (("float32", np.float32), ("float64", np.float64)):
        strict = partial(_without_size, partial(_strict, precision=precision))
        steps = {
            Stage.OBJECT: partial(_cut_hits, TRIANGLES, strict),
            Stage.VISIBILITY: partial(_cut_shadow_rays, TRIANGLES, strict),
        }
        what = f"misses triangles on their edges, in {name}"
        yield Mutant(
            name=f"{PREFIX}triangle.strict/{name}",
            field="triangle.strict",
            what=what,
            steps=lambda _, steps=steps: steps,
        )


SHADOW_RAYS = {
    "shadow_ray.start": "ignores blockers so close to the point",
    "shadow_ray.end_before": "ignores blockers so close to the light",
    "shadow_ray.end_behind": "counts blockers so close behind the light",
}
CLIPS = {
    "clip.near_late": "clips so much behind the near plane",
    "clip.near_early": "clips so much before the near plane",
    "clip.far_late": "clips so much behind the far plane",
    "clip.far_early": "clips so much before the far plane",
}
NEAREST = {
    "nearest.earlier": "wants a later shape to be nearer by so much",
    "nearest.later": "takes a later shape that is farther by so much",
}
LIGHTS = {
    "light.least_distance": "takes lights to be at least so far away",
    "light.longer_distance": "adds so much to the length by which it divides the direction to a light",
}


def _fixed(cut: Callable[..., np.ndarray], size: float, relative: bool) -> Callable[..., np.ndarray]:
    return lambda surface, apex, rays, faces, t: cut(surface, apex, rays, faces, t, size, relative=relative)


def _without_size(cut: Callable[..., np.ndarray], surface: Any, apex: Any, rays: Any, faces: Any, t: Any) -> np.ndarray:
    return cut(surface, apex, rays, faces, t, 0.0)


def _mutant(formula: str, size: float, relative: bool | None, what: str, steps: Mapping[Stage, Step]) -> Mutant:
    """Return a formula's mutant; `relative` is None where the number has no unit, or one sense only."""
    kind = "" if relative is None else "relative_" if relative else "absolute_"
    words = f"{size:.0e}".replace("e-0", "e-")
    scale = "" if relative is None else " as a share" if relative else " in its unit"
    return Mutant(
        name=f"{PREFIX}{formula}/{kind}{words}",
        field=formula,
        what=f"{what} ({words}{scale})",
        steps=lambda _: steps,
    )
