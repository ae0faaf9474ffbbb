"""Laws of motions: the scene moved, scaled, mirrored; shapes placed by another matrix or baked into world space."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.laws.relations import (
    Ask,
    Conditions,
    Relation,
    carried_by,
    everywhere,
    has_triangles,
    moved,
    moved_triangles,
    placed,
    related,
    with_shapes,
)
from rayproof.cases.placement import compose, matrix, rotation, scaling, translation, world_triangles
from rayproof.cases.scene import IDENTITY, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle

# Moving everything at once moves nothing in the image.
MOTION = compose(translation(0.4, -0.3, 0.2), rotation((0.3, -0.5, 0.8), 77.0))


def rigid(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn and move camera, shapes and lights together: points and directions move along, radiance stays.

    Proof: every formula of the specification is made of dot products of differences of points, which a rigid motion
    keeps. Source: Weyl, Symmetry (1952); specification, CAM-1 and XF-1.
    """
    changed = moved(scene, MOTION)
    conditions = Conditions(rebaked=has_triangles(scene))
    yield from related(
        ask, scene, changed, what="everything turned and moved", before=carried_by(MOTION), conditions=conditions
    )
    # The same two images the other way round: what is too much in one of them may pass for an edge in the other.
    back = carried_by(np.linalg.inv(np.asarray(MOTION)))
    yield from related(ask, changed, scene, what="everything moved and turned back", before=back, conditions=conditions)


# A world three times as large, nine times as bright, looks the same.
SCALES = (3.0, 0.01)


def scale(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Scale all lengths by s and flux by s^2: lengths scale, radiance stays. No length of its own may be in a formula.

    Proof: E = Phi cos / (4 pi r^2), with Phi and r^2 both times s^2; everything else is angles and ratios of lengths.
    Source: Buckingham, On Physically Similar Systems (1914); specification, RAD-1.
    """
    conditions = Conditions(rebaked=has_triangles(scene))
    for factor in SCALES:
        motion = scaling(factor, factor, factor)
        before = carried_by(motion, scale=factor)
        changed = moved(scene, motion, scale=factor)
        what = f"all lengths times {factor:g}, flux times {factor * factor:g}"
        yield from related(ask, scene, changed, what=what, before=before, conditions=conditions)


# A world four times as large and sixteen times as bright is the same, nearly to the last bit.
POWER_OF_TWO = 4.0


def scale_power(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Scale all lengths by 4 and flux by 16: no digit changes, as far as formulas divide and multiply.

    Proof: floating point has the same digits around 4 x as around x, and 1 / (16 r^2) and 16 Phi cancel. Not to the
    last bit: a renderer may take a shape's normal as it is where the matrix is the identity, and normalise it once more
    where it is not; some u of the normal are then some of the light. Source: IEEE 754-2019, section 4.3.
    """
    motion = scaling(POWER_OF_TWO, POWER_OF_TWO, POWER_OF_TWO)
    changed, before = moved(scene, motion, scale=POWER_OF_TWO), carried_by(motion, scale=POWER_OF_TWO)
    conditions = Conditions(factor=0.25)
    yield from related(
        ask, scene, changed, what="all lengths times 4, flux times 16", before=before, conditions=conditions
    )


# A mirrored world is seen mirrored.
MIRROR = scaling(-1, 1, 1)


def mirror(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Mirror everything in x = 0: the image is mirrored left to right, and normals still point outward.

    Proof: right = forward x up changes its sign under a mirror, dot products do not, and the world normal is the
    inverse transpose times the object normal also under mirrors. Source: specification, conventions and NRM-3.
    """

    def flipped(image: np.ndarray) -> np.ndarray:
        return image[:, ::-1]

    carried = carried_by(MIRROR)
    before = everywhere(flipped) | {
        stage: lambda image, change=change: flipped(change(image)) for stage, change in carried.items()
    }
    conditions = Conditions(rebaked=has_triangles(scene))
    changed = moved(scene, MIRROR)
    yield from related(ask, scene, changed, what="everything mirrored in x = 0", before=before, conditions=conditions)


# Renaming the axes x -> y -> z -> x changes no number, only its place.
CYCLE = ((0.0, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def axes(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn everything by a third about the diagonal (1, 1, 1): no axis of the world is special.

    Proof: a permutation of coordinates is a rigid motion whose matrix holds zeros and ones, so that coordinates only
    change places. Source: Weyl, Symmetry (1952); specification, conventions.
    """
    conditions = Conditions(rebaked=has_triangles(scene))
    changed = moved(scene, CYCLE)
    yield from related(
        ask, scene, changed, what="x, y, z renamed y, z, x", before=carried_by(CYCLE), conditions=conditions
    )


# Triangles may be moved by their matrix or stand where it takes them.
def standing(shape: Shape) -> Shape:
    """Return triangles and meshes as meshes that need no matrix."""
    if not isinstance(shape, Triangle | Mesh):
        return shape
    corners = world_triangles(shape)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Mesh(
        albedo=shape.albedo, to_world=IDENTITY, two_sided=shape.two_sided, vertices=corners.reshape(-1, 3), faces=faces
    )


def baked(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Bake every triangle's corners into the world: nothing changes, the corners are the same float32 numbers.

    Proof: the scene bakes them once in float64 and rounds once to float32, for every renderer; a normal that is the
    inverse transpose of the object's is that of the baked corners, but for what rounding turns them.
    Source: specification, conventions.
    """
    if moved_triangles(scene):
        conditions = Conditions(rebaked=True)
        changed = with_shapes(scene, standing)
        yield from related(ask, scene, changed, what="triangles baked into the world", conditions=conditions)


# A sphere may be described by its centre and radius or by its matrix.
def by_matrix(shape: Shape) -> Shape:
    """Return a sphere of another centre and radius, moved and scaled by its matrix to where it was."""
    if not isinstance(shape, Sphere):
        return shape
    center, radius = ((-0.4, 0.3, 0.7), 2.5) if shape.center == (0.0, 0.0, 0.0) else ((0.0, 0.0, 0.0), 1.0)
    unit = replace(shape, center=center, radius=radius)
    ratio = shape.radius / radius
    to_origin = translation(*(-x for x in center))
    return placed(unit, compose(translation(*shape.center), scaling(ratio, ratio, ratio), to_origin))


def sphere_placed(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Write every sphere's centre and radius into its matrix, or part of its matrix into those: all stays.

    Proof: x -> c + r x carries the unit sphere onto the one about c of radius r. Source: specification, HIT-1 and XF-1.
    """
    if any(isinstance(shape, Sphere) for shape in scene.shapes):
        changed = with_shapes(scene, by_matrix)
        yield from related(ask, scene, changed, what="every sphere placed in another way")


# A primitive turned by its own symmetry is itself.
# Whole numbers: corners go to corners exactly.
QUARTER = matrix(np.round(np.asarray(rotation((0, 0, 1), 90))))


def turned_in_itself(shape: Shape) -> Shape:
    """Return a shape after a motion of its object space that carries it onto itself."""
    if isinstance(shape, Sphere):
        away = translation(*(-x for x in shape.center))
        return placed(shape, compose(translation(*shape.center), rotation((0.2, 0.9, -0.4), 50), away))
    if isinstance(shape, Cube):
        return placed(shape, compose(CYCLE, scaling(-1, 1, 1)))
    if isinstance(shape, Square):
        return placed(shape, QUARTER)
    if isinstance(shape, Plane):
        return placed(shape, compose(translation(0.3, -0.2, 0), rotation((0, 0, 1), 40), scaling(2, 3, 1)))
    return shape


def symmetry(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn spheres about their centres, cubes onto their faces, squares by a quarter, planes in themselves: all stays.

    Proof: each motion carries the primitive, and which side is out, onto itself. Source: Weyl, Symmetry (1952).
    """
    changed = with_shapes(scene, turned_in_itself)
    if changed != scene:
        yield from related(ask, scene, changed, what="every primitive turned by its own symmetry")
