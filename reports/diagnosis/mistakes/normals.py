"""Mistakes of normals: NRM-1 to NRM-3.

A wrong normal also decides on which side of a surface a feeler starts. The oracle never lets a flat face block itself;
a renderer that starts its feelers along the wrong normal does, where the light is on the other side of the true face.
So each of these mistakes has both ways.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.scene import Cube, Mesh, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way, Wrong
from rayproof.reports.judge.answers import dot, length

# From a shape, points on it and its outward unit normals in the world (n, 3) to the wrong outward normals.
Turned = Callable[[Shape, np.ndarray, np.ndarray], np.ndarray]


IN_THE_FACE = 1e-6  # of a normal's length: so little of it stands off a face that a float's rounding turns it over


def _unit(vectors: np.ndarray) -> np.ndarray:
    size = length(vectors)[..., np.newaxis]
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0)


def _matrix(shape: Shape) -> np.ndarray:
    return np.asarray(shape.to_world, dtype=np.float64)[:3, :3]


def _local(shape: Shape, outward: np.ndarray) -> np.ndarray:
    """Return the unit normals of object space: the inverse transpose's inverse is the transpose."""
    return _unit(outward @ _matrix(shape))


def _world(shape: Shape, local: np.ndarray) -> np.ndarray:
    return local @ np.linalg.inv(_matrix(shape))


def _points(shape: Shape, positions: np.ndarray) -> np.ndarray:
    offset = np.asarray(shape.to_world, dtype=np.float64)[:3, 3]
    return (positions - offset) @ np.linalg.inv(_matrix(shape)).T


@dataclass(frozen=True, kw_only=True)
class Normals:
    """Normals that follow from wrong outward ones, turned towards the viewer as the renderer does it."""

    turned: tuple[Turned, ...] = ()  # one after the other
    facing: str = "viewer"
    # Whether normals of triangles' faces are as long as the cross product of two edges, which is twice the area.
    crossed: bool = False

    def __call__(self, given: Given) -> np.ndarray:
        """Return the normals, (height, width, 3)."""
        objects, rays = given.answers[Stage.OBJECT], given.answers[Stage.RAY]
        found = np.array(given.right, dtype=np.float64)
        outwards = outward_normals(given)
        for index, shape in enumerate(given.scene.shapes):
            here = objects[..., 0] == index
            wrong = outwards[here]
            for turned in self.turned:
                wrong = turned(shape, given.answers[Stage.POSITION][here], wrong)
            away = dot(wrong, rays[here]) > 0
            turns = away & (shape.two_sided if self.facing == "viewer" else self.facing == "always")
            found[here] = np.where(turns[:, np.newaxis], -wrong, wrong)
            if self.crossed and isinstance(shape, Triangle | Mesh):
                corners = np.asarray(shape.vertices, dtype=np.float64)
                faces = corners[shape.faces] if isinstance(shape, Mesh) else corners[np.newaxis]
                area = length(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]))
                found[here] *= area[objects[here][:, 1].astype(int), np.newaxis]
        return found

    def followed_by(self, other: Wrong) -> Wrong | None:
        """Return both mistakes at once, the other's after these; None where it is of another kind."""
        if not isinstance(other, Normals):
            return None
        return Normals(
            turned=self.turned + other.turned,
            facing=other.facing if other.facing != "viewer" else self.facing,
            crossed=self.crossed or other.crossed,
        )


def _wrong(turned: Turned) -> Wrong:
    return Normals(turned=(turned,))


def outward_normals(given: Given) -> np.ndarray:
    """Return the right normals before any is turned towards the viewer: those of one-sided surfaces."""
    if not any(shape.two_sided for shape in given.scene.shapes):
        return given.right
    shapes = tuple(replace(shape, two_sided=False) for shape in given.scene.shapes)
    return Analytic().continue_from(replace(given.scene, shapes=shapes), Stage.NORMAL, given.answers)


def blocked_by_its_own_face(given: Given) -> np.ndarray:
    """Return visibility where a feeler that starts on the wrong side of the face that it leaves meets that face.

    Along a normal that lies in the face it starts on the face, within rounding, which alone says what it meets: NaN.
    """
    true, wrong = _true_normals(given), given.answers[Stage.NORMAL]
    found = np.array(given.right, dtype=np.float64)
    along = dot(wrong, true)
    starts = np.where(np.abs(along) < IN_THE_FACE, np.nan, np.sign(along))
    for index, light in enumerate(given.scene.lights):
        above = np.sign(dot(true, np.asarray(light.position) - given.answers[Stage.POSITION]))
        seen = np.where(starts * above >= 0, found[..., index], 0.0)
        found[..., index] = np.where(np.isnan(starts) & (found[..., index] > 0), np.nan, seen)
    return found


def _true_normals(given: Given) -> np.ndarray:
    return Analytic().continue_from(given.scene, Stage.NORMAL, given.answers)


def _seen_as_before(given: Given) -> np.ndarray:
    """Return radiance of a renderer that tells front from back by the right normal."""
    seen = dot(_true_normals(given), given.answers[Stage.RAY]) < 0
    scale = 1.0 if given.scene.shading == "simplified" else 1 / np.pi
    return np.where(seen[..., np.newaxis], given.answers[Stage.EXITANCE] * scale, 0.0)


def _register(name: str, says: str, items: tuple[str, ...], *wrongs: Wrong) -> None:
    """Register a mistake that has one image for each of `wrongs`, and for each right formula around it."""
    MISTAKES.register(name)(Mistake(says=says, items=items, ways=tuple(way for one in wrongs for way in around(one))))


def around(wrong: Wrong, says: str | None = None) -> list[Way]:
    """Return the ways in which wrong normals show, by the right formulas around them."""
    plain, seen = {Stage.NORMAL: wrong}, {Stage.RADIANCE: _seen_as_before}
    own = plain | {Stage.VISIBILITY: blocked_by_its_own_face}
    return [Way(stages=stages, says=says) for stages in (plain, own, plain | seen, own | seen)]


def _of(kind: type[Shape], turned: Turned) -> Turned:
    return lambda shape, points, outward: turned(shape, points, outward) if isinstance(shape, kind) else outward


def _without_center(shape: Shape, positions: np.ndarray, outward: np.ndarray) -> np.ndarray:
    return _unit(_world(shape, _unit(_points(shape, positions))))


def _greatest_value(shape: Shape, positions: np.ndarray, outward: np.ndarray) -> np.ndarray:
    local = _points(shape, positions)
    axis = np.eye(3)[np.argmax(local, axis=-1)] if len(local) else np.zeros((0, 3))
    return _unit(_world(shape, axis * np.sign(local)))


_register(
    "normal_by_model",
    "turns normals by the model matrix instead of its inverse transpose",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: _unit(_local(shape, outward) @ _matrix(shape).T)),
)
_register(
    "normal_in_object_space",
    "leaves normals in object space",
    ("NRM-3", "XF-2"),
    _wrong(lambda shape, points, outward: _local(shape, outward)),
)
_register(
    "normal_by_inverse",
    "turns normals by the inverse of the model matrix without transposing it",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: _unit(_local(shape, outward) @ np.linalg.inv(_matrix(shape)).T)),
)
_register(
    "normal_by_transpose",
    "turns normals by the transposed model matrix",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: _unit(_local(shape, outward) @ _matrix(shape))),
)
_register(
    "normal_not_normalised",
    "does not normalise the world normal",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: _world(shape, _local(shape, outward))),
    Normals(turned=(lambda shape, points, outward: _world(shape, _local(shape, outward)),), crossed=True),
)
_register(
    "normal_to_viewer",
    "turns every normal towards the viewer, one-sided surfaces' too",
    ("NRM-3",),
    Normals(facing="always"),
)
_register(
    "normal_never_turned",
    "never turns a normal towards the viewer, not even a two-sided surface's",
    ("NRM-3",),
    Normals(facing="never"),
)
_register(
    "normal_inward",
    "lets sphere normals point inward",
    ("NRM-1",),
    _wrong(_of(Sphere, lambda shape, points, outward: -outward)),
)
_register(
    "normals_inward",
    "lets all normals point inward",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: -outward),
)
_register(
    "normal_keeps_center",
    "forgets to subtract the centre in the sphere's normal",
    ("NRM-1",),
    _wrong(_of(Sphere, _without_center)),
)
_register(
    "cube_normal_unsigned",
    "forgets the sign of the coordinate in the cube's normal",
    ("NRM-2",),
    _wrong(_of(Cube, lambda shape, points, outward: _unit(_world(shape, np.abs(np.round(_local(shape, outward))))))),
)
_register(
    "cube_normal_greatest_value",
    "takes the cube's greatest coordinate instead of the one of greatest magnitude for its normal",
    ("NRM-2",),
    _wrong(_of(Cube, _greatest_value)),
)
