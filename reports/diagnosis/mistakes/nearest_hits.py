"""Which hit counts, HIT-9: the last, first or farthest of a mesh's faces or of all shapes, or near ones alone."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reference.analytic.stages import clip_interval
from rayproof.reference.analytic.surfaces import Polygons, Surface, surface_of
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way
from rayproof.reports.diagnosis.fits import Fitting, rounded

RULES = ("nearest", "first", "last", "farthest")
MOST_DISTANCES = 9  # that are tried
LEAST_HIDDEN = 30  # pixels whose hits are missing, from which a greatest distance is estimated


@dataclass(frozen=True, kw_only=True)
class Counting:
    """Which hit counts."""

    of_faces: str = "nearest"  # one of RULES, among the faces of one mesh
    of_shapes: str = "nearest"
    below: float = np.inf  # m: hits this far away or farther do not count

    def hits(self, given: Given) -> tuple[np.ndarray, np.ndarray]:
        """Return objects (height, width, 2) and distances (height, width, 1)."""
        rays = given.answers[Stage.RAY]
        flat, eye = rays.reshape(-1, 3), np.asarray(given.scene.camera.eye, dtype=np.float64)
        low, high = clip_interval(given.scene, flat)
        high = np.minimum(high, self.below)
        distances, objects = np.full(len(flat), np.inf), np.full((len(flat), 2), -1.0)
        for index, shape in enumerate(given.scene.shapes):
            surface = surface_of(shape)
            crossing, face = self._of(surface, eye, flat, low, high)
            taken = np.isfinite(crossing) & _goes_before(self.of_shapes, crossing, distances)
            distances = np.where(taken, crossing, distances)
            objects[taken, 0], objects[taken, 1] = index, face[taken]
        return objects.reshape(*rays.shape[:2], 2), distances.reshape(*rays.shape[:2], 1)

    def _of(
        self, surface: Surface, eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        # A cube is six faces to the oracle; to others it is one shape.
        if self.of_faces == "nearest" or not isinstance(surface, Polygons) or not surface.numbers.any():
            return surface.first(eye, rays, low, high)
        found, number = np.full(len(rays), np.inf), np.zeros(len(rays))
        for some, faces, crossing in surface.meetings(eye, rays):
            inside = (crossing > low[some, np.newaxis]) & (crossing < high[some, np.newaxis])
            order = {"first": -faces, "last": faces}.get(self.of_faces, crossing)  # the greatest counts
            best = np.argmax(np.where(inside, order, -np.inf), axis=1)
            here = inside[np.arange(len(some)), best]
            some, best, crossing = some[here], best[here], crossing[here]
            value, face = crossing[np.arange(len(some)), best], surface.numbers[faces[best]]
            # Later faces of the same ray come later.
            taken = _goes_before(self.of_faces, value, found[some])
            found[some[taken]], number[some[taken]] = value[taken], face[taken]
        return found, number

    @property
    def way(self) -> Way:
        """Return the way of a renderer for which this hit counts."""
        return Way(
            stages={
                Stage.OBJECT: lambda given: self.hits(given)[0],
                Stage.DISTANCE: lambda given: self.hits(given)[1],
            },
            says=self.phrase,
        )

    @property
    def phrase(self) -> str:
        """Return what a renderer does, as a verb phrase."""
        if np.isfinite(self.below):
            return f"sees nothing that is {self.below:.4g} m away or farther"
        of_shapes = f"the {self.of_shapes} of all shapes" if self.of_shapes != "nearest" else ""
        of_faces = f"the {self.of_faces} face that a ray meets in a mesh" if self.of_faces != "nearest" else ""
        return f"takes {' and '.join(filter(None, (of_faces, of_shapes)))}, not the nearest"


def _goes_before(rule: str, new: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return whether a hit that is met later takes the place of one met before; an infinite one is none."""
    if rule == "nearest":
        return new < kept
    if rule == "farthest":
        return ~np.isfinite(kept) | (new > kept)
    return np.full(new.shape, True) if rule == "last" else ~np.isfinite(kept)


def _fitted(cases: Sequence[Fitting]) -> Iterator[Way]:
    known = {("nearest", "nearest"), ("nearest", "first"), ("nearest", "last")}
    for of_shapes in RULES:
        for of_faces in RULES:
            if (of_faces, of_shapes) not in known:
                yield Counting(of_faces=of_faces, of_shapes=of_shapes).way
    for below in _greatest_distances(cases):
        yield Counting(below=below).way


def _greatest_distances(cases: Sequence[Fitting]) -> list[float]:
    """Return distances [m] below which hits may count and beyond which they do not, those of few digits."""
    seen, missed = 0.0, []
    for case in cases:
        stage = Stage.OBJECT if case.staged else Stage.RADIANCE
        if stage not in case.ours:
            continue
        distance = case.evidence.right.answers[Stage.DISTANCE][..., 0]
        there = np.isfinite(distance) & case.plain
        ours, right = case.ours[stage], case.evidence.right.answers[stage]
        same = np.all(np.isclose(ours, right, rtol=1e-4, atol=0), axis=-1)
        gone = np.all(ours <= 0, axis=-1) if stage is Stage.RADIANCE else ours[..., 0] < 0
        shown = there & same & (np.any(right != 0, axis=-1) if stage is Stage.RADIANCE else True)
        seen = max(seen, float(np.max(distance[shown], initial=0.0)))
        missed.append(distance[there & gone & ~same])
    hidden = np.concatenate(missed) if missed else np.zeros(0)
    if len(hidden) < LEAST_HIDDEN or not seen < hidden.min():
        return []
    # Between the farthest hit that is seen and the nearest that is not any distance explains these cases.
    low, high = seen, float(hidden.min())
    for digits in range(6):
        step = 10.0 ** (np.floor(np.log10(high)) - digits)
        numbers = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
        numbers = numbers[(numbers > low) & (numbers <= high)]
        if len(numbers):
            return [rounded(float(number)) for number in numbers[:MOST_DISTANCES]]
    return [(low + high) / 2]


MISTAKES.register("another_hit")(
    Mistake(
        says="takes another hit than the nearest",
        items=("HIT-9",),
        ways=(Counting(of_shapes="farthest", of_faces="farthest").way,),
        fitted=_fitted,
    )
)
