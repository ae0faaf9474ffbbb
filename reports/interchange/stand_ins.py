"""Replacements for features that a program lacks: meshes for shapes, other clip modes, other sides.

Cubes, squares, triangles and meshes are replaced by equal triangles. Spheres and planes are replaced by meshes that
only approximate them, so that a case is judged as the scene with those meshes. If near and far plane touch nothing, or
no back of a surface is visible, scenes of different clip modes or sides have the same image.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rayproof.cases.placement import matrix, unit
from rayproof.cases.scene import Clip, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.scene_json import NAMES
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange.framing import box

FLAT = ("cube", "square", "triangle", "mesh")  # types of shapes that triangles can replace exactly
# Halves are exact in float32, so that the mesh is the shape itself. Counter-clockwise seen from outside.
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], dtype=np.float32)
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_CUBE_FACES = np.array([half for a, b, c, d in _SIDES for half in ((a, b, c), (a, c, d))], dtype=np.int32)
_SQUARE = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], dtype=np.float32)
_SQUARE_FACES = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)


@dataclass(frozen=True, kw_only=True)
class Rebuilt:
    """A scene with meshes or triangles in place of equal shapes, and the original of each of its shapes."""

    scene: Scene
    shapes: np.ndarray  # (shapes of `scene`,): the shape of the original
    faces: np.ndarray  # (shapes of `scene`,): the face of the original's mesh; -1 if the mesh itself was handed over

    def named_as_asked(self, images: Mapping[Stage, np.ndarray]) -> dict[Stage, np.ndarray]:
        """Return a program's images with the shapes and faces of the original; a miss stays a miss."""
        if Stage.OBJECT not in images:
            return dict(images)
        objects = images[Stage.OBJECT].copy()
        written = objects[..., 0]
        is_shape = (written >= 0) & (written < len(self.shapes)) & (written == np.floor(written))
        pieces = written[is_shape].astype(int)
        faces = self.faces[pieces]
        objects[is_shape] = np.stack([self.shapes[pieces], np.where(faces < 0, objects[is_shape, 1], faces)], axis=-1)
        return dict(images) | {Stage.OBJECT: objects}


def rebuilt(scene: Scene, stand_ins: Mapping[str, str]) -> Rebuilt:
    """Return the scene with a "mesh", or a "triangle" for each face, in place of shapes of the types given."""
    shapes: list[Shape] = []
    owners, numbers = [], []
    for index, shape in enumerate(scene.shapes):
        instead = stand_ins.get(NAMES[type(shape)])
        pieces = [shape] if instead is None else [_as_mesh(shape)] if instead == "mesh" else _as_triangles(shape)
        mesh = isinstance(shape, Mesh)
        shapes += pieces
        owners += [index] * len(pieces)
        numbers += ([-1] if instead is None else range(len(pieces))) if mesh else [0 if instead else -1] * len(pieces)
    return Rebuilt(scene=replace(scene, shapes=tuple(shapes)), shapes=np.array(owners), faces=np.array(numbers))


def _as_triangles(shape: Shape) -> Sequence[Shape]:
    mesh = _as_mesh(shape)
    assert isinstance(mesh, Mesh)
    corners = mesh.vertices[mesh.faces].astype(np.float64).tolist()
    about = {"albedo": mesh.albedo, "to_world": mesh.to_world, "two_sided": mesh.two_sided}
    return [Triangle(**about, vertices=(tuple(p), tuple(q), tuple(r))) for p, q, r in corners]


def _as_mesh(shape: Shape) -> Shape:
    if isinstance(shape, Cube):
        vertices, faces = _CORNERS, _CUBE_FACES
    elif isinstance(shape, Square):
        vertices, faces = _SQUARE, _SQUARE_FACES
    elif isinstance(shape, Triangle):
        vertices, faces = np.array(shape.vertices, dtype=np.float32), np.array([(0, 1, 2)], dtype=np.int32)
    else:
        return shape
    return Mesh(albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided, vertices=vertices, faces=faces)


# Approximations of spheres and planes: a sphere as a mesh of flat triangles, a plane as a square that extends beyond
# everything that is visible, lit or a blocker.

DIVISIONS = 5  # of an icosahedron's 20 faces, each into 4
SPHERE_TRIANGLES = 20 * 4**DIVISIONS
MOST_TRIANGLES = 200_000  # of a scene
BEYOND = 1.01  # times the distance that a square must reach
STEEPEST = (
    100.0  # in heights of the eye: a view of a plane beyond this, without far plane, counts as a view of its horizon
)


class NoStandInError(ValueError):
    """A shape that no mesh can replace; the message is one sentence."""


def tessellated(scene: Scene, kinds: Collection[str], *, squares: bool) -> Scene:
    """Return the scene with meshes for its spheres and planes, of the `kinds` "sphere" and "plane".

    With `squares` a plane becomes a square. A mesh has the place of its shape among the scene's shapes.

    Raises:
        NoStandInError: too many triangles would be needed, or a plane is seen up to its horizon.

    """
    spheres = sum(isinstance(shape, Sphere) for shape in scene.shapes) if "sphere" in kinds else 0
    meshes = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))
    if (count := spheres * SPHERE_TRIANGLES) and count + meshes > MOST_TRIANGLES:
        raise NoStandInError(f"Its spheres as meshes would be {count} triangles, more than {MOST_TRIANGLES} in all.")

    def instead(index: int, shape: Shape) -> Shape:
        if isinstance(shape, Sphere) and "sphere" in kinds:
            return _sphere_mesh(shape)
        if isinstance(shape, Plane) and "plane" in kinds:
            square = _square_of(shape, index, scene)
            return square if squares else _as_mesh(square)
        return shape

    return replace(scene, shapes=tuple(instead(index, shape) for index, shape in enumerate(scene.shapes)))


@lru_cache(maxsize=1)
def _unit_sphere() -> tuple[np.ndarray, np.ndarray]:
    """Return vertices on the unit sphere, float64, and faces, counter-clockwise seen from outside."""
    golden = (1 + 5**0.5) / 2
    corners = [(0.0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    vertices = [tuple(np.roll(corner, turn)) for turn in range(3) for corner in corners]
    points = np.array(vertices)
    # Each face of an icosahedron joins three corners at the distance of its edge, 2.
    near = np.abs(np.linalg.norm(points[:, np.newaxis] - points, axis=-1) - 2) < 1e-9
    faces = [
        (a, b, c) if np.dot(np.cross(points[b] - points[a], points[c] - points[a]), points[a]) > 0 else (a, c, b)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[a, c]
    ]
    for _ in range(DIVISIONS):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            edge = (min(a, b), max(a, b))
            if edge not in middles:
                middles[edge] = len(vertices)
                vertices.append(tuple((np.array(vertices[a]) + vertices[b]) / 2))
            return middles[edge]

        faces = [
            part
            for a, b, c in faces
            for ab, bc, ca in [(middle(a, b), middle(b, c), middle(c, a))]
            for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        ]
    sphere = np.array(vertices)
    return unit(sphere), np.array(faces, dtype=np.int32)


@lru_cache(maxsize=64)
def _sphere_mesh(sphere: Sphere) -> Mesh:
    directions, faces = _unit_sphere()
    vertices = (np.array(sphere.center) + sphere.radius * directions).astype(np.float32)
    about = {"albedo": sphere.albedo, "to_world": sphere.to_world, "two_sided": sphere.two_sided}
    return Mesh(**about, vertices=vertices, faces=faces)


def _square_of(plane: Plane, index: int, scene: Scene) -> Square:
    """Return a square in place of a plane, around the point of the plane that is nearest to the eye."""
    to_world = np.asarray(plane.to_world, dtype=np.float64)
    normal = np.linalg.inv(to_world[:3, :3]).T[:, 2]
    normal /= np.linalg.norm(normal)
    eye = np.asarray(scene.camera.eye)
    height = float(normal @ (eye - to_world[:3, 3]))
    side = 2 * BEYOND * _reach(scene, index, normal, height)
    first = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    first /= np.linalg.norm(first)
    placed = np.eye(4)
    placed[:3, :3] = np.column_stack([side * first, side * np.cross(normal, first), normal])
    placed[:3, 3] = eye - height * normal
    return Square(albedo=plane.albedo, two_sided=plane.two_sided, to_world=matrix(placed))


def _reach(scene: Scene, index: int, normal: np.ndarray, height: float) -> float:
    """Return the radius [m] around the eye within which a plane must be present: up to visible points and lights.

    A shadow ray joins a visible point and a light, so that a ball around the eye that contains both contains it.
    """
    camera = scene.camera
    eye = np.asarray(camera.eye)
    corners = Analytic().at(scene, [Stage.RAY], _image_corners(scene))[Stage.RAY]
    forward = np.subtract(camera.target, camera.eye)
    depths = corners @ (forward / np.linalg.norm(forward))
    distances = [float(np.linalg.norm(np.subtract(light.position, eye))) for light in scene.lights]
    if scene.clip == "shell":
        distances.append(camera.far)
    elif scene.clip == "depth":
        distances.append(camera.far / float(depths.min()))
    else:
        # The plane's part in view ends where the rays through the image's corners meet it, if each of them does.
        with np.errstate(divide="ignore"):
            along = -height / (corners @ normal)
        behind = bool((along < 0).all()) or height == 0
        if not behind and not ((along > 0) & (along <= STEEPEST * abs(height))).all():
            raise NoStandInError(f"shapes[{index}] is a plane that is seen up to its horizon, without a far plane.")
        distances += [] if behind else [float(along.max())]
        for shape in scene.shapes:
            if not isinstance(shape, Plane):
                low, high = box(shape)
                distances.append(float(np.linalg.norm(np.maximum(np.abs(low - eye), np.abs(high - eye)))))
    return max(distances)


def _image_corners(scene: Scene) -> np.ndarray:
    width, height = scene.camera.width, scene.camera.height
    return np.array([(x, y) for x in (0.0, width) for y in (0.0, height)], dtype=np.float64)


# Features without effect: clip planes that touch nothing, invisible backs of surfaces.

ASIDE = 1e-3  # near and far plane are moved towards each other by this share of their distance
FINER = 3  # examined points per side of each pixel, if the scene has few triangles
RAY_TRIANGLES = 2e7  # rays times triangles of such an image
CLIPPING = (Stage.OBJECT, Stage.DISTANCE)


@lru_cache(maxsize=1024)
def is_untouched(scene: Scene, clip: Clip) -> bool:
    """Return whether near and far plane, under a clip mode, hide nothing that the camera would see without them.

    The planes are moved towards each other by `ASIDE`, so that none comes near to a visible surface.
    """
    if clip == "none":
        return True
    camera = scene.camera
    near, far = camera.near * (1 + ASIDE), camera.far * (1 - ASIDE)
    if not near < far:
        return False
    if clip == "depth" and all(_within_depths(scene, shape, near, far) for shape in scene.shapes):
        return True
    narrow = replace(scene, clip=clip, camera=replace(camera, near=near, far=far))
    return _same_images(narrow, replace(scene, clip="none"), CLIPPING)


def _within_depths(scene: Scene, shape: Shape, near: float, far: float) -> bool:
    """Return whether a shape is between two depths [m], or behind the eye."""
    if isinstance(shape, Plane):
        return False
    low, high = box(shape)
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    forward = np.subtract(scene.camera.target, scene.camera.eye)
    depths = (corners - scene.camera.eye) @ (forward / np.linalg.norm(forward))
    return bool(near <= depths.min() and depths.max() <= far) or bool(depths.max() < 0)


@lru_cache(maxsize=1024)
def is_alike_with_sides(scene: Scene, two_sided: bool, stages: tuple[Stage, ...]) -> bool:
    """Return whether some stages of a scene are the same if all of its surfaces are two-sided, or if none is.

    Sides matter only for a visible back of a surface; hits and blockers do not depend on them.
    """
    changing = np.array([shape.two_sided != two_sided for shape in scene.shapes])
    looked_at = (Stage.RAY, Stage.OBJECT, Stage.NORMAL)
    for images in _images(with_sides(scene, two_sided=False), looked_at):
        ray, objects, normal = (images[stage] for stage in looked_at)
        shape_of_pixel = objects[..., 0].astype(int)
        if bool(((shape_of_pixel >= 0) & changing[shape_of_pixel] & ((ray * normal).sum(axis=-1) >= 0)).any()):
            return Stage.NORMAL not in stages and _same_images(scene, with_sides(scene, two_sided=two_sided), stages)
    return True


def with_sides(scene: Scene, *, two_sided: bool) -> Scene:
    """Return the scene with all of its surfaces two-sided, or none."""
    return replace(scene, shapes=tuple(replace(shape, two_sided=two_sided) for shape in scene.shapes))


def _same_images(scene: Scene, another: Scene, stages: Collection[Stage]) -> bool:
    """Return whether the oracle answers alike to two scenes of one size and as many triangles."""
    wanted = [stage for stage in IMAGE_STAGES if stage in stages]
    for first, second in zip(_images(scene, wanted), _images(another, wanted), strict=True):
        if not all(np.array_equal(first[stage], second[stage], equal_nan=True) for stage in wanted):
            return False
    return True


def _images(scene: Scene, stages: Collection[Stage]) -> Iterator[StageImages]:
    """Yield the oracle's images at each pixel's centre, then at points around it, if there are few triangles."""
    camera = scene.camera
    triangles = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh)) + len(scene.shapes)
    fine = FINER**2 * camera.width * camera.height * triangles <= RAY_TRIANGLES
    for factor in (1, FINER) if fine else (1,):
        size = {"width": factor * camera.width, "height": factor * camera.height}
        yield Analytic().render(replace(scene, camera=replace(camera, **size)), stages)
