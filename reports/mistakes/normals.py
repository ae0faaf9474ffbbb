"""Mistakes of normals: a wrong matrix, length or sign, or a wrong rule of turning them towards the viewer."""

from collections.abc import Callable

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, Freedom, Rows
from rayproof.reference.analytic.vectors import cross, dot, units
from rayproof.reports.mistakes import Mistake, known, variant

# Maps a shape, the linear part (3, 3) of its matrix, points (N, 3), faces (N,) and right unit normals (N, 3) in object
# space to normals (N, 3) in world space.
Turned = Callable[[Shape, np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def linear_of(shape: Shape) -> np.ndarray:
    """Return the linear part (3, 3) of a shape's model matrix."""
    return np.asarray(shape.to_world, dtype=np.float64)[:3, :3]


def local_of(shape: Shape, outward: np.ndarray) -> np.ndarray:
    """Return unit normals (N, 3) in object space from unit normals (N, 3) in world space."""
    return units(outward @ linear_of(shape))


class OwnFaceBlocks(Mistake):
    """A shadow ray crosses its own face if it starts on the wrong side of the face, due to a wrong normal."""

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return the visibility (N, lights) without the lights on the other side of the face."""
        visible = super().visibility(scene, rows, freedom)
        right = Analytic().normals(scene, rows[Stage.RAY], rows[Stage.OBJECT], rows[Stage.POSITION])
        start = dot(right, rows[Stage.NORMAL])
        for column, light in enumerate(scene.lights):
            visible[:, column] *= start * dot(right, np.asarray(light.position) - rows[Stage.POSITION]) >= 0
        return visible


class SeenByRightNormal(Mistake):
    """Front and back are distinguished by the right normal, and only the light by the wrong one."""

    def facing(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the hits with a right normal that is turned towards the viewer."""
        hit, side = objects[:, 0] >= 0, np.zeros(len(objects), dtype=bool)
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            if here.any():
                away = dot(self.right_outward(scene, index, directions[here], objects[here]), directions[here]) > 0
                side[here] = shape.two_sided | ~away
        return hit & side

    def right_outward(self, scene: Scene, index: int, directions: np.ndarray, objects: np.ndarray) -> np.ndarray:
        """Return the right outward normals (N, 3) at the hits of a shape."""
        distances = Analytic().distances(scene, directions, objects)[:, np.newaxis]
        positions = Analytic().positions(scene, directions, objects, distances)
        return Analytic().outward_normals(scene, index, positions, objects[:, 1])


def _register(name: str, sentence: str, items: tuple[str, ...], wrong: type[Mistake]) -> None:
    """Register wrong normals, with the variants in which the steps around them use the right normals."""
    known(name, sentence, *items)(wrong)
    for around in ((OwnFaceBlocks,), (SeenByRightNormal,), (OwnFaceBlocks, SeenByRightNormal)):
        variant(name)(type("".join((name, *(part.__name__ for part in around))), (*around, wrong), {}))


def _outward(name: str, sentence: str, items: tuple[str, ...], turned: Turned, *kinds: type[Shape]) -> None:
    def outward_normals(
        self: Mistake, scene: Scene, index: int, positions: np.ndarray, faces: np.ndarray
    ) -> np.ndarray:
        shape, right = scene.shapes[index], Analytic.outward_normals(self, scene, index, positions, faces)
        if kinds and not isinstance(shape, kinds):
            return right
        return turned(shape, linear_of(shape), positions, faces, local_of(shape, right))

    _register(name, sentence, items, type(name, (Mistake,), {"outward_normals": outward_normals}))


def _crossed(shape: Shape, linear: np.ndarray, points: np.ndarray, faces: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return normals (N, 3) in object space; those of triangles are the cross products of their sides."""
    if not isinstance(shape, Triangle | Mesh):
        return local
    vertices = np.asarray(shape.vertices, dtype=np.float64)
    corners = vertices[np.newaxis] if isinstance(shape, Triangle) else vertices[shape.faces]
    corners = corners[np.clip(faces, 0, len(corners) - 1).astype(int)]
    return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _unsigned(shape: Shape, linear: np.ndarray, points: np.ndarray, faces: np.ndarray, local: np.ndarray) -> np.ndarray:
    return units(np.abs(np.round(local)) @ np.linalg.inv(linear))


def _greatest(shape: Shape, linear: np.ndarray, points: np.ndarray, faces: np.ndarray, local: np.ndarray) -> np.ndarray:
    offset = np.asarray(shape.to_world, dtype=np.float64)[:3, 3]
    inside = (points - offset) @ np.linalg.inv(linear).T
    axis = np.eye(3)[inside.argmax(axis=1)]
    return units(axis * np.where((inside * axis).sum(axis=1, keepdims=True) < 0, -1, 1) @ np.linalg.inv(linear))


def _about_origin(
    shape: Shape, linear: np.ndarray, points: np.ndarray, faces: np.ndarray, local: np.ndarray
) -> np.ndarray:
    offset, inverse = np.asarray(shape.to_world, dtype=np.float64)[:3, 3], np.linalg.inv(linear)
    return units((points - offset) @ inverse.T @ inverse)


def _smooth(shape: Shape, linear: np.ndarray, points: np.ndarray, faces: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return the normals (N, 3) of a mesh, interpolated between vertex normals, the means over the adjacent faces."""
    assert isinstance(shape, Mesh)
    vertices, all_faces = shape.vertices.astype(np.float64), shape.faces
    corners = vertices[all_faces]
    areas = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    at = np.zeros((place.max() + 1, 3))
    for corner in range(3):
        np.add.at(at, place.ravel()[all_faces[:, corner]], areas)
    offset = np.asarray(shape.to_world, dtype=np.float64)[:3, 3]
    inside, number = (points - offset) @ np.linalg.inv(linear).T, np.clip(faces, 0, len(all_faces) - 1).astype(int)
    a, b, c = np.moveaxis(corners[number], 1, 0)
    area = areas[number]
    size = dot(area, area)
    weights = [
        dot(cross(c - b, inside - b), area),
        dot(cross(a - c, inside - c), area),
        dot(cross(b - a, inside - a), area),
    ]
    mixed = sum(
        (weight / size)[:, np.newaxis] * units(at)[place.ravel()[all_faces[number, corner]]]
        for corner, weight in enumerate(weights)
    )
    return units(np.asarray(mixed) @ np.linalg.inv(linear))


NRM3 = ("NRM-3", "XF-2")
_outward(
    "normal_by_model",
    "turns normals by the model matrix instead of its inverse transpose",
    NRM3,
    lambda _, m, p, f, n: units(n @ m.T),
)
_outward("normal_in_object_space", "leaves normals in object space", NRM3, lambda _, m, p, f, n: n)
_outward(
    "normal_by_inverse",
    "turns normals by the inverse of the model matrix without transposing it",
    NRM3,
    lambda _, m, p, f, n: units(n @ np.linalg.inv(m).T),
)
_outward(
    "normal_by_transpose", "turns normals by the transposed model matrix", NRM3, lambda _, m, p, f, n: units(n @ m)
)
_outward(
    "normal_by_model_unnormalised",
    "turns normals by the model matrix and does not normalise them",
    NRM3,
    lambda _, m, p, f, n: n @ m.T,
)
_outward(
    "normal_not_normalised", "does not normalise the world normal", NRM3, lambda _, m, p, f, n: n @ np.linalg.inv(m)
)
_outward(
    "normals_inward", "lets all normals point inward", ("NRM-3",), lambda _, m, p, f, n: -units(n @ np.linalg.inv(m))
)
_outward(
    "normal_inward",
    "lets sphere normals point inward",
    ("NRM-1",),
    lambda _, m, p, f, n: -units(n @ np.linalg.inv(m)),
    Sphere,
)
_outward(
    "normal_keeps_center", "forgets to subtract the centre in the sphere's normal", ("NRM-1",), _about_origin, Sphere
)
_outward("cube_normal_unsigned", "forgets the sign of the coordinate in the cube's normal", ("NRM-2",), _unsigned, Cube)
_outward(
    "cube_normal_greatest_value",
    "takes the cube's greatest coordinate instead of the one of greatest magnitude for its normal",
    ("NRM-2",),
    _greatest,
    Cube,
)
_outward(
    "normal_by_winding",
    "derives normals from the winding in the world, which a mirror turns round",
    ("NRM-3",),
    lambda _, m, p, f, n: units(n @ np.linalg.inv(m)) * np.sign(np.linalg.det(m)),
)
_outward("smooth_normals", "interpolates a mesh's normals between its vertices", ("NRM-3",), _smooth, Mesh)


class Crossed(Mistake):
    """The normals of triangles are the cross products of their sides, transformed to world space."""

    def outward_normals(self, scene: Scene, index: int, positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return normals that are not normalised."""
        shape, right = scene.shapes[index], super().outward_normals(scene, index, positions, faces)
        linear = linear_of(shape)
        return _crossed(shape, linear, positions, faces, local_of(shape, right)) @ np.linalg.inv(linear)


variant("normal_not_normalised")(Crossed)


class Turning(Mistake):
    """Normals are turned to the viewer by a wrong rule."""

    def away(self, scene: Scene, index: int, outward: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the normals that are reversed."""
        raise NotImplementedError

    def normals(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Return normals (N, 3), turned by this rule."""
        normals = np.zeros((len(objects), 3))
        for index in range(len(scene.shapes)):
            here = objects[:, 0] == index
            if here.any():
                outward = self.outward_normals(scene, index, positions[here], objects[here, 1])
                turned = self.away(scene, index, outward, directions[here])
                normals[here] = np.where(np.reshape(turned, (-1, 1)), -outward, outward)
        return normals


Rule = Callable[[Shape, np.ndarray, np.ndarray], np.ndarray]


def _turning(name: str, sentence: str, rule: Rule) -> None:
    away = {"away": lambda _, scene, index, outward, d: rule(scene.shapes[index], outward, d)}
    _register(name, sentence, ("NRM-3", "RAD-4"), type(name, (Turning,), away))


def _behind(shape: Shape, outward: np.ndarray, directions: np.ndarray) -> np.ndarray:
    return dot(outward, directions) > 0


_turning("normal_to_viewer", "turns every normal towards the viewer, one-sided surfaces' too", _behind)
_turning(
    "normal_never_turned",
    "never turns a normal towards the viewer, not even a two-sided surface's",
    lambda shape, outward, d: np.zeros(len(outward), dtype=bool),
)
_turning(
    "normal_turned_away",
    "turns the normals of two-sided surfaces away from the viewer",
    lambda shape, outward, d: shape.two_sided & ~_behind(shape, outward, d),
)
_turning(
    "mirrored_turned_away",
    "turns the normals of two-sided shapes that a matrix mirrors away from the viewer",
    lambda shape, outward, d: shape.two_sided & (_behind(shape, outward, d) ^ (np.linalg.det(linear_of(shape)) < 0)),
)


class MixedSpaces(Turning):
    """Front and back are distinguished by the product of two vectors in different spaces."""

    def side(self, shape: Shape, outward: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the hits that are taken for the back of the surface."""
        raise NotImplementedError

    def away(self, scene: Scene, index: int, outward: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the normals to reverse: hits of two-sided shapes that are taken for the back."""
        shape = scene.shapes[index]
        return shape.two_sided & self.side(shape, outward, directions)

    def facing(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the shown hits; hits of one-sided shapes are shown if they are taken for the front."""
        shown = np.zeros(len(objects), dtype=bool)
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            shown[here] = shape.two_sided | ~self.side(shape, normals[here], directions[here])
        return shown


for _name, _sentence, _side in (
    (
        "side_by_local_normal",
        "tells front from back by the normal of object space and the ray of the world",
        lambda _, shape, n, d: dot(local_of(shape, n), d) > 0,
    ),
    (
        "side_by_local_ray",
        "tells front from back by the normal of the world and the ray of object space",
        lambda _, shape, n, d: dot(n, d @ np.linalg.inv(linear_of(shape)).T) > 0,
    ),
):
    known(_name, _sentence, "NRM-3", "RAD-4")(type(_name, (MixedSpaces,), {"side": _side}))


@known("back_seen", "shows one-sided surfaces from behind", "RAD-4")
class BackSeen(Mistake):
    """Every hit is shown."""

    def facing(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of all hits."""
        return objects[:, 0] >= 0


@known("front_hidden", "shows one-sided surfaces from behind and hides their front", "RAD-4")
class FrontHidden(Mistake):
    """The back is lit instead of the front."""

    def facing(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the hits that are seen from behind."""
        return (objects[:, 0] >= 0) & (dot(normals, directions) > 0)


@known(
    "normal_of_rounded_corners",
    "takes faces' normals from corners that it rounds to float32 in world space, and does not declare it",
    "NRM-3",
)
class OfRoundedCorners(Mistake):
    """The normals of faces are computed from the rounded corners in world space."""

    def outward_normals(self, scene: Scene, index: int, positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return the normals (N, 3) of faces with rounded corners, on the same side as the right normals."""
        shape, right = scene.shapes[index], super().outward_normals(scene, index, positions, faces)
        if not isinstance(shape, Triangle | Mesh):
            return right
        corners = world_triangles(shape).astype(np.float64)[np.clip(faces, 0, None).astype(int)]
        normals = units(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        return normals * np.where(dot(normals, right) < 0, -1.0, 1.0)[:, np.newaxis]
