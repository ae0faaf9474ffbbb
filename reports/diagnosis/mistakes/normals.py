"""Mistakes of normals (matrix, length, side, centre), NRM-1 to NRM-3, and of rays brought into object space.

A wrong normal also decides on which side of a surface a feeler starts. The oracle never lets a flat face block itself;
a renderer that starts its feelers along the wrong normal does, where the light is on the other side of the true face.
So each of these mistakes has both forms. Renderers that take the normal where the ray meets the shape in object space
meet it here by the plainest formulas, rightly or wrongly transformed; triangles and meshes lie in the world.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.placement import placed, world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.surfaces import surface_of
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way, Wrong
from rayproof.reports.diagnosis.answering import hits_by
from rayproof.reports.diagnosis.trials import Evidence
from rayproof.reports.judge.answers import dot, length
from rayproof.reports.judge.forward.conditioning import condition
from rayproof.reports.judge.forward.limits import limits

ABOVE = 1e-6  # of a point's distance from origin or eye, beyond a float's rounding: so far above it feelers start

# From linear part, translation, origins and directions (N, 3) in the world to both in object space.
IntoObject = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def _renormalised(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    back = np.linalg.inv(linear).T
    turned = directions @ back
    return (origins - offset) @ back, turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def _moved(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    back = np.linalg.inv(linear).T
    return (origins - offset) @ back, (directions - offset) @ back


def _forward(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    return origins @ linear.T + offset, directions @ linear.T


def _rightly(
    linear: np.ndarray, offset: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    back = np.linalg.inv(linear).T
    return (origins - offset) @ back, directions @ back


@dataclass(frozen=True, kw_only=True)
class _Meeting:
    """How rays and feelers meet shapes."""

    into: IntoObject = _rightly
    unit_a: bool = False  # take A = 1 in the sphere's quadratic
    face: Callable[[Shape], Shape] = lambda shape: shape  # what is met for a triangle or mesh


def _meet(
    shape: Shape, origins: np.ndarray, directions: np.ndarray, low: np.ndarray, high: np.ndarray, *, unit_a: bool
) -> np.ndarray:
    """Return the smallest t in (low, high) at which rays of object space meet a unit shape there, or inf."""
    with np.errstate(all="ignore"):
        if isinstance(shape, Sphere) and unit_a:
            start = origins - np.asarray(shape.center)
            middle = -dot(start, directions)
            half = np.sqrt(middle**2 - dot(start, start) + shape.radius**2)
            roots = [middle - half, middle + half]
        elif isinstance(shape, Sphere):
            start = origins - np.asarray(shape.center)
            size = dot(directions, directions)
            middle = -dot(start, directions) / size
            foot = start + middle[:, np.newaxis] * directions
            half = np.sqrt((shape.radius**2 - dot(foot, foot)) / size)
            roots = [middle - half, middle + half]
        elif isinstance(shape, Cube):
            ends = np.sort([(-0.5 - origins) / directions, (0.5 - origins) / directions], axis=0)
            enter, leave = np.nanmax(ends[0], axis=-1), np.nanmin(ends[1], axis=-1)
            beside = np.any((directions == 0) & (np.abs(origins) > 0.5), axis=-1)
            missed = (enter > leave) | beside
            roots = [np.where(missed, np.nan, root) for root in (enter, leave)]
        else:
            root = -origins[:, 2] / directions[:, 2]
            met = origins + root[:, np.newaxis] * directions
            within = isinstance(shape, Plane) | np.all(np.abs(met[:, :2]) < 0.5, axis=-1)
            roots = [np.where(within, root, np.nan)]
        found = [np.where((root > low) & (root < high), root, np.inf) for root in roots]
    return np.min(found, axis=0)


def _hits(how: _Meeting) -> dict[Stage, Wrong]:
    """Return objects and distances of the nearest hits."""

    def meet(
        shape: Shape, eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        if isinstance(shape, Triangle | Mesh):
            crossing, face = surface_of(how.face(shape)).first(eye, rays, low, high)[:2]
            return crossing, face % len(_faces(shape)[1])
        origins, directions = how.into(*placed(shape), np.broadcast_to(eye, rays.shape), rays)
        return _meet(shape, origins, directions, low, high, unit_a=how.unit_a), np.zeros(len(rays))

    return hits_by(meet)


def _normals(given: Given, how: _Meeting) -> np.ndarray:
    """Return the normals at the points of object space that the rays met."""
    found = np.array(given.right, dtype=np.float64)
    objects, rays = given.answers[Stage.OBJECT][..., 0], given.answers[Stage.RAY]
    eye = np.asarray(given.scene.camera.eye, dtype=np.float64)
    for index, shape in enumerate(given.scene.shapes):
        here = objects == index
        if isinstance(shape, Triangle | Mesh) or not here.any():
            continue
        linear, offset = placed(shape)
        flat = rays[here]
        origins, directions = how.into(linear, offset, np.broadcast_to(eye, flat.shape), flat)
        normals = _local_normals(shape, origins + given.answers[Stage.DISTANCE][here] * directions) @ np.linalg.inv(
            linear
        )
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        turns = shape.two_sided & (dot(normals, flat) > 0)
        found[here] = np.where(turns[:, np.newaxis], -normals, normals)
    return found


def _local_normals(shape: Shape, points: np.ndarray) -> np.ndarray:
    if isinstance(shape, Sphere):
        return points - np.asarray(shape.center)
    if isinstance(shape, Cube):
        axis = np.abs(points).argmax(axis=-1)
        return np.eye(3)[axis] * np.sign(np.take_along_axis(points, axis[:, np.newaxis], axis=-1))
    return np.broadcast_to((0.0, 0.0, 1.0), points.shape)


def _visible(given: Given, how: _Meeting) -> np.ndarray:
    """Return which lights are above the horizon with a feeler that meets nothing, brought astray as well."""
    hit, eye = given.answers[Stage.OBJECT][..., 0] >= 0, np.asarray(given.scene.camera.eye)
    points = given.answers[Stage.POSITION][hit]
    columns = []
    for light in given.scene.lights:
        normals, source = given.answers[Stage.NORMAL][hit], np.asarray(light.position, dtype=np.float64)
        starts = points + ABOVE * np.maximum(length(points), length(points - eye))[:, np.newaxis] * normals
        seen = dot(normals, source - points) > 0
        seen &= ~_blocked(given.scene, starts, source, how)
        column = np.zeros(hit.shape)
        column[hit] = seen
        columns.append(column)
    return np.stack(columns, axis=-1)


def _blocked(scene: Scene, points: np.ndarray, source: np.ndarray, how: _Meeting) -> np.ndarray:
    low, high = np.zeros(len(points)), np.ones(len(points))
    found = np.zeros(len(points), dtype=bool)
    for shape in scene.shapes:
        if isinstance(shape, Triangle | Mesh):
            crossing, *_ = surface_of(how.face(shape)).first(
                source, points - source, low, high
            )  # from the light, one for all
        else:
            origins, directions = how.into(*placed(shape), points, source - points)
            crossing = _meet(shape, origins, directions, low, high, unit_a=how.unit_a)
        found |= np.isfinite(crossing)
    return found


def way_by(into: IntoObject) -> Way:
    """Return the way of a renderer that brings rays and feelers into object space so."""
    return _way_of(_Meeting(into=into))


def _way_of(how: _Meeting) -> Way:
    """Return the way of a renderer whose rays and feelers meet shapes so."""
    return Way(
        stages={
            **_hits(how),
            Stage.NORMAL: lambda given: _normals(given, how),
            Stage.VISIBILITY: lambda given: _visible(given, how),
        }
    )


def _parallelograms(shape: Shape) -> Shape:
    """Return a mesh in which each face has its mirror image beside it, numbered after all faces of the shape."""
    vertices, faces = _faces(shape)
    first, second, third = (vertices[faces[:, corner]] for corner in range(3))
    beside = np.concatenate([second, third, second + third - first])
    count = len(faces)
    numbers = len(vertices) + np.arange(3 * count).reshape(3, count)
    mirrored = np.stack([numbers[0], numbers[2], numbers[1]], axis=-1)
    return Mesh(
        albedo=shape.albedo,
        to_world=shape.to_world,
        two_sided=shape.two_sided,
        vertices=np.concatenate([vertices, beside]).astype(np.float32),
        faces=np.concatenate([faces, mirrored]).astype(np.int32),
    )


def _faces(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(shape, Mesh):
        return np.asarray(shape.vertices), np.asarray(shape.faces)
    assert isinstance(shape, Triangle)
    return np.asarray(shape.vertices, dtype=np.float32), np.array([(0, 1, 2)])


RENORMALISED, MOVED, FORWARD = (_way_of(_Meeting(into=into)) for into in (_renormalised, _moved, _forward))
UNIT_A = _way_of(_Meeting(unit_a=True))
PARALLELOGRAMS = _way_of(_Meeting(face=_parallelograms))


# From a shape, points on it and its outward unit normals in the world (n, 3) to the wrong outward normals.
Turned = Callable[[Shape, np.ndarray, np.ndarray], np.ndarray]


LEAST_ROUNDED = 30  # pixels of a case: so many wrong normals are not those of rounded corners by chance
# So little of a normal, whatever its length, stands off a face that a feeler along it starts on the face: along a unit
# normal it starts some thousand roundings above.
IN_THE_FACE = 1e-3


def _unit(vectors: np.ndarray) -> np.ndarray:
    size = length(vectors)[..., np.newaxis]
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0)


def _local(shape: Shape, outward: np.ndarray) -> np.ndarray:
    """Return the unit normals of object space: the inverse transpose's inverse is the transpose."""
    return _unit(outward @ placed(shape)[0])


def _world(shape: Shape, local: np.ndarray) -> np.ndarray:
    return local @ np.linalg.inv(placed(shape)[0])


def _points(shape: Shape, positions: np.ndarray) -> np.ndarray:
    matrix, offset = placed(shape)
    return (positions - offset) @ np.linalg.inv(matrix).T


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


def _from_rounded_corners(given: Given) -> np.ndarray:
    """Return the normals of faces whose corners are float32 in world space, turned as the right ones are."""
    objects, found = given.answers[Stage.OBJECT], np.array(given.right, dtype=np.float64)
    for index, shape in enumerate(given.scene.shapes):
        here = objects[..., 0] == index
        if isinstance(shape, Triangle | Mesh) and here.any():
            first, second, third = np.moveaxis(world_triangles(shape).astype(np.float64), 1, 0)
            normals = _unit(np.cross(second - first, third - first))[objects[here][:, 1].astype(int)]
            found[here] = np.sign(dot(normals, found[here]))[:, np.newaxis] * normals
    return found


def rounded(evidence: Evidence) -> bool | None:
    """Say whether a case's wrong normals are those of rounded corners; None where too few are wrong.

    They are off by less than a mistake is looked for, so that they are held to the limits of the judge.
    """
    right = evidence.right.answers
    if not {Stage.OBJECT, Stage.NORMAL} <= set(evidence.stages) or evidence.rounding.baked:
        return None
    about = Given(scene=evidence.scene, answers=right, right=right[Stage.NORMAL], parameter=0.0)
    limit = limits(evidence.scene, right, condition(evidence.scene, right), evidence.rounding, by_matrices=False)
    off, off_rounded = (
        length(evidence.ours[Stage.NORMAL] - normals) > limit.end_to_end[Stage.NORMAL]
        for normals in (right[Stage.NORMAL], _from_rounded_corners(about))
    )
    flat = [isinstance(shape, Triangle | Mesh) for shape in evidence.scene.shapes]
    # A flat face has one normal, at its edges too; of a curved surface the edges say nothing.
    faces = np.array([*flat, False])[right[Stage.OBJECT][..., 0].astype(int)]
    wrong = off & np.all(evidence.ours[Stage.OBJECT] == right[Stage.OBJECT], axis=-1) & (faces | ~evidence.right.edge)
    if np.any(wrong & off_rounded):
        return False
    return True if np.count_nonzero(wrong) >= LEAST_ROUNDED else None


def _greatest_value(shape: Shape, positions: np.ndarray, outward: np.ndarray) -> np.ndarray:
    local = _points(shape, positions)
    axis = np.eye(3)[np.argmax(local, axis=-1)] if len(local) else np.zeros((0, 3))
    return _unit(_world(shape, axis * np.sign(local)))


_register(
    "normal_by_model",
    "turns normals by the model matrix instead of its inverse transpose",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: _unit(_local(shape, outward) @ placed(shape)[0].T)),
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
    _wrong(lambda shape, points, outward: _unit(_local(shape, outward) @ np.linalg.inv(placed(shape)[0]).T)),
)
_register(
    "normal_by_transpose",
    "turns normals by the transposed model matrix",
    ("NRM-3",),
    _wrong(lambda shape, points, outward: _unit(_local(shape, outward) @ placed(shape)[0])),
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
MISTAKES.register("normal_of_rounded_corners")(
    Mistake(
        says="takes faces' normals from corners that it rounds to float32 in world space, and does not declare it",
        items=("NRM-3",),
        ways=(Way(stages={Stage.NORMAL: _from_rounded_corners}),),
        seen=rounded,
        seen_in=1,  # its pixels are foretold within the judge's limits; most failing meshes have too many faces to ask
    )
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
