"""What pixel classes need of a scene before anybody rounds: computed once, whoever is judged and however precisely."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rayproof.cases.scene import Cube, PointLight, Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.tolerance.channels import dot, length
from rayproof.reports.judge.tolerance.conditioning import Conditioning, error_at_eye, facing, surface_error
from rayproof.reports.judge.tolerance.edge_sides import widest_near
from rayproof.reports.judge.tolerance.edges import Edges

MOST_FACES = 64  # of a mesh near the eye, whose planes are looked at one by one


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """One light at every pixel (height, width)."""

    distance: np.ndarray  # m
    cosine: np.ndarray  # |n.l|
    throw: np.ndarray  # how many times as large a blocker's own error may be on the receiver
    brim: np.ndarray  # m: how high the way to the light is above a cube's seen face where that ends; elsewhere infinite


@dataclass(frozen=True, kw_only=True)
class Unrounded:
    """A scene, what the oracle answers, and what follows from them alone."""

    scene: Scene
    truth: StageImages
    edges: Edges
    conditioning: Conditioning

    @cached_property
    def seen(self) -> np.ndarray:
        """Return the angle [rad per roundoff] (height, width) by which points may seem off from the eye.

        Of the surfaces that meet at an outline the worst counts: what is seen within two pixels, or for something
        thinner the scene's middling one.
        """
        c = self.conditioning
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = widest_near(np.where(c.hit, c.point / c.distance, 0.0))
            return np.maximum(seen, float(np.median(seen[c.hit])) if np.any(c.hit) else 0.0)

    @cached_property
    def pixel(self) -> np.ndarray:
        """Return the length [m] (height, width) that a pixel spans across the ray, where it hits."""
        return self.conditioning.distance * self.conditioning.pixel_angle

    @cached_property
    def behind(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Return for each surface behind what is hit where that is (height, width), and its error [m per roundoff]."""
        c, found = self.conditioning, []
        eye = np.asarray(self.scene.camera.eye, dtype=np.float64)
        for index in np.unique(self.edges.behind[c.hit & (self.edges.behind >= 0)]):
            here = c.hit & (self.edges.behind == index)
            other = surface_error(self.scene.shapes[int(index)], eye, self.truth[Stage.POSITION][here])
            # Where the two come so near each other, they look along one normal, or an outline between them is near.
            found.append((here, other / c.cosine[here] + c.distance[here]))
        return tuple(found)

    @cached_property
    def at_eye(self) -> tuple[float, ...]:
        """Return how far off [m per roundoff] each shape may seem at the eye; below 0 where clipping hides that."""
        if self.scene.clip != "none":
            return (-1.0,) * len(self.scene.shapes)
        eye = np.asarray(self.scene.camera.eye, dtype=np.float64)
        return tuple(error_at_eye(shape, eye) for shape in self.scene.shapes)

    @cached_property
    def cut(self) -> tuple[tuple[float, np.ndarray], ...]:
        """Return by what angle [rad per roundoff] each surface closer to the eye than clipping begins may seem off.

        Where clipping lets it begin, the eye sees it at that distance. Beside it how much [rad] (height, width) each
        ray leans away from the surface more than one that meets it there: a ray at that angle from the surface's plane
        has left it by then, and no part of it is seen.
        """
        near = self.scene.camera.near
        if self.scene.clip == "none":
            return ()
        eye, rays = np.asarray(self.scene.camera.eye, dtype=np.float64), self.truth[Stage.RAY]
        found = []
        for shape, gap in zip(self.scene.shapes, self.edges.eye_gaps, strict=True):
            if gap < near:
                normals, offsets, bends = facing(shape, eye)
                close = offsets < near
                leaning = np.full(rays.shape[:2], np.inf)
                for normal, offset, bend in zip(normals[close], offsets[close], bends[close], strict=True):
                    leaning = np.minimum(leaning, np.abs(rays @ normal) - offset / near - near * bend)
                # Too many to tell apart, or none that is flat enough to have a plane: it may be seen anywhere.
                told = 0 < np.count_nonzero(close) <= MOST_FACES
                found.append((error_at_eye(shape, eye) / near, leaning if told else np.zeros(rays.shape[:2])))
        return tuple(found)

    @cached_property
    def blocker(self) -> float:
        """Return the point error [m per roundoff] of the worst shape, each by the median of what is seen of it.

        Not the largest: an infinite plane's error grows towards its horizon, where it blocks nothing.
        """
        c, objects = self.conditioning, self.truth[Stage.OBJECT][..., 0]
        return max((float(np.median(c.point[objects == one])) for one in np.unique(objects[c.hit])), default=0.0)

    @cached_property
    def lamps(self) -> tuple[Lamp, ...]:
        """Return every light, none where no light is asked about."""
        if Stage.VISIBILITY not in self.truth:
            return ()
        return tuple(self._lamp(light) for light in self.scene.lights)

    def _lamp(self, light: PointLight) -> Lamp:
        toward = np.asarray(light.position) - self.truth[Stage.POSITION]
        r = length(toward)
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.abs(dot(toward, self.truth[Stage.NORMAL])) / r
            # A blocker's own error, thrown from near the light onto the receiver, grows with the distances' ratio.
            throw = np.maximum(1.0, r / np.min(r[self.conditioning.hit], initial=np.inf))
        return Lamp(distance=r, cosine=cosine, throw=throw, brim=self._brim(toward, r * cosine))

    def _brim(self, toward: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Return for a light [m] (height, width, 3) away, and so high above a cube's face, its way's height at the end.

        A hit that rounding sinks deeper than that into the cube has the next face before the light.
        """
        brim, objects = np.full(height.shape, np.inf), self.truth[Stage.OBJECT][..., 0]
        for index, shape in enumerate(self.scene.shapes):
            here = objects == index
            if not isinstance(shape, Cube) or not here.any():
                continue
            matrix = np.asarray(shape.to_world, dtype=np.float64)
            inverse = np.linalg.inv(matrix[:3, :3])
            local, way = (self.truth[Stage.POSITION][here] - matrix[:3, 3]) @ inverse.T, toward[here] @ inverse.T
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = (0.5 * np.sign(way) - local) / way  # of the way to the light, along each axis
            ends[np.arange(len(ends)), np.abs(local).argmax(axis=1)] = np.inf
            ends = np.where(np.isfinite(ends), ends, np.inf).min(axis=1)
            brim[here] = height[here] * np.clip(ends, 0.0, 1.0)
        return brim

    @cached_property
    def ends(self) -> tuple[np.ndarray, ...]:
        """Return for each light near a surface how far off [m per roundoff] (height, width) the surface may seem."""
        if not self.lamps:
            return ()
        found = []
        for end in self.edges.light_ends:
            position = np.asarray(self.scene.lights[end.light].position, dtype=np.float64)
            shape = self.scene.shapes[end.shape]
            found.append(surface_error(shape, self.truth[Stage.POSITION], position, face=end.face))
        return tuple(found)
