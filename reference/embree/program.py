"""Calls of Embree in float32, and each hit made again in float64 from the plane of its triangle."""

from collections.abc import Collection
from typing import Any

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.embree.scene import Facets, directions, facets, interval

# How often a feeler may be asked again beyond what float32 wrongly took for a blocker.
ATTEMPTS = 16
# A ray's start and a hit's distance are off by some roundings of their size in float32; beyond is what lies this many
# times farther than they are large.
BEYOND = 16 * 2.0**-24


class World:
    """Triangles as Embree holds them."""

    def __init__(self, facets: Facets) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.facets = facets
        # A power of two near the largest coordinate, by which lengths are divided: float32 has room for its squares.
        self._unit = float(2.0 ** np.frexp(np.abs(facets.corners).max(initial=0.0))[1])
        # Robust: rays do not pass between triangles that share an edge.
        self._scene: Any = EmbreeScene(robust=True)
        vertices, uses = np.unique(facets.corners.reshape(-1, 3), axis=0, return_inverse=True)
        if len(facets.shape):
            TriangleMesh(self._scene, (vertices / self._unit).astype(np.float32), uses.reshape(-1, 3).astype(np.int32))

    def nearest(self, direction: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the triangle that each ray from the eye meets first between start and end [m], -1 for none, and t [m].

        `direction` is (n, 3) and unit; the other shapes are (n,).
        """
        hit, _ = self._ask(start[:, np.newaxis] * direction, direction, end - start)
        distance = self.distances(hit, np.zeros(3), direction)
        # float32 may take a triangle for hit whose plane the ray runs along.
        met = np.isfinite(distance)
        return np.where(met, hit, -1), np.where(met, distance, np.inf)

    def distances(self, hit: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Return t in float64 at which rays meet the planes of the triangles `hit` (n,), inf where that is -1."""
        hits = np.flatnonzero(hit >= 0)
        corners = self.facets.corners[hit[hits]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        starts = np.broadcast_to(origin, direction.shape)[hits]
        above = np.einsum("ij,ij->i", normal, corners[:, 0] - starts)
        t = np.full(len(hit), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            t[hits] = above / np.einsum("ij,ij->i", normal, direction[hits])
        return t

    def blocked(self, origin: np.ndarray, target: np.ndarray, least: np.ndarray) -> np.ndarray:
        """Return whether a triangle lies between origins (n, 3) and the point `target`, relative to the eye, (n,) bool.

        What is nearer to an origin than `least` [m] (n,) along the feeler does not count. A blocker that float64 does
        not find ahead of the origin, such as the surface that the feeler leaves, is passed over.
        """
        toward = target - origin
        length = np.linalg.norm(toward, axis=1)
        direction = toward / length[:, np.newaxis]
        blocked = np.zeros(len(origin), dtype=bool)
        left, start = np.arange(len(origin)), least.copy()
        for _ in range(ATTEMPTS):
            ahead = length[left] - start[left]
            left = left[ahead > 0]
            if not len(left):
                break
            begin = origin[left] + start[left, np.newaxis] * direction[left]
            hit, t = self._ask(begin, direction[left], length[left] - start[left])
            exact = self.distances(hit, origin[left], direction[left])
            # Written so that a NaN, of a plane along the ray, is no blocker.
            real = (hit >= 0) & (exact > least[left]) & (exact < length[left])
            blocked[left[real]] = True
            again = (hit >= 0) & ~real
            size = np.abs(begin).max(axis=1) + t
            left, step = left[again], (t + BEYOND * size)[again]
            start[left] += step
        return blocked

    def _ask(self, origin: np.ndarray, direction: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest triangle, -1 for none, and Embree's own t, in float64."""
        if not len(self.facets.shape) or not len(origin):
            return np.full(len(origin), -1), np.zeros(len(origin))
        # Embree takes no infinity for a length, and writes its t into what it is given.
        far = np.minimum(length / self._unit, np.finfo(np.float32).max).astype(np.float32)
        begin = (origin / self._unit).astype(np.float32)
        found = self._scene.run(begin, direction.astype(np.float32), far, output=True)
        t = np.where(found["primID"] >= 0, found["tfar"], 0.0).astype(np.float64)
        return found["primID"].astype(int), t * self._unit


# From Embree's hits to the specification's stages.


# A feeler starts this fraction of its hit's distance from the eye ahead: 32 roundings of the hit point to float32,
# which is how far Embree may see a surface from where it is.
CLEARANCE = 32 * 2.0**-24


def rays(scene: Scene) -> np.ndarray:
    """Return the unit directions through the pixel centres, (height, width, 3)."""
    return directions(scene.camera)[0].reshape(scene.camera.height, scene.camera.width, 3)


def answers(scene: Scene, stages: Collection[Stage]) -> StageImages:
    """Return those stages from object to visibility that are among `stages`, (height, width, channels), float64."""
    direction, depth = directions(scene.camera)
    world = World(facets(scene))
    hit, distance = world.nearest(direction, *interval(scene, depth))
    hits = np.flatnonzero(hit >= 0)
    objects, position, normal = np.full((len(hit), 2), -1.0), np.zeros((len(hit), 3)), np.zeros((len(hit), 3))
    objects[hits] = np.column_stack([world.facets.shape[hit[hits]], world.facets.face[hit[hits]]])
    # Relative to the eye, as everything that is traced here.
    position[hits] = distance[hits, np.newaxis] * direction[hits]
    normal[hits] = _shading_normals(scene, world, hit[hits], direction[hits])
    visibility = np.zeros((len(hit), len(scene.lights)))
    if Stage.VISIBILITY in stages:
        visibility[hits] = _visible(scene, world, position[hits], normal[hits], distance[hits])
    found = {
        Stage.OBJECT: objects,
        Stage.DISTANCE: distance[:, np.newaxis],
        Stage.POSITION: np.where((hit >= 0)[:, np.newaxis], position + scene.camera.eye, 0.0),
        Stage.NORMAL: normal,
        Stage.VISIBILITY: visibility,
    }
    size = (scene.camera.height, scene.camera.width)
    return {stage: rows.reshape(*size, rows.shape[1]) for stage, rows in found.items() if stage in stages}


def _shading_normals(scene: Scene, world: World, hit: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the specification's N (n, 3): outward, and on two-sided shapes towards the viewer."""
    outward = world.facets.normal[hit]
    two_sided = np.array([shape.two_sided for shape in scene.shapes], dtype=bool)[world.facets.shape[hit]]
    away = np.einsum("ij,ij->i", outward, direction) > 0
    return np.where((two_sided & away)[:, np.newaxis], -outward, outward)


def _visible(scene: Scene, world: World, position: np.ndarray, normal: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Return 1 per light above the horizon and unobstructed, else 0, (n, lights); positions relative to the eye."""
    visible = np.zeros((len(position), len(scene.lights)))
    for number, light in enumerate(scene.lights):
        place = np.subtract(light.position, scene.camera.eye)
        above = np.flatnonzero(np.einsum("ij,ij->i", normal, place - position) > 0)
        free = ~world.blocked(position[above], place, CLEARANCE * distance[above])
        visible[above[free], number] = 1.0
    return visible
