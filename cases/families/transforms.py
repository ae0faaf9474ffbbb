"""Families `transforms` (every shape under every affine motion) and `normals` (the normals under motions)."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import camera_around, compose, mapped, rotation, scaling, shear, translation
from rayproof.cases.scene import Cube, Matrix, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle, Vector

# Every primitive under every kind of affine map, most of which a normal that is only rotated gets wrong.
ALBEDO = (0.35, 0.6, 0.8)
PLACE: Vector = (0.7, -0.4, 0.5)
LIGHT = PointLight(position=(2.9, -2.6, 3.6), flux=(450.0, 300.0, 380.0))
TURN = rotation((0.4, -0.3, 0.85), 38)

MOTIONS: tuple[tuple[str, Matrix], ...] = (
    ("translated", translation(*PLACE)),
    ("rotated", compose(translation(*PLACE), TURN)),
    ("scaled", compose(translation(*PLACE), TURN, scaling(1.3, 1.3, 1.3))),
    ("stretched", compose(translation(*PLACE), TURN, scaling(1.6, 0.8, 1.1))),
    ("sheared", compose(translation(*PLACE), TURN, shear(xy=0.45, xz=-0.3, yz=0.35), scaling(1.2, 0.9, 1.1))),
    ("mirrored", compose(translation(*PLACE), TURN, scaling(-1.2, 1.0, 1.1))),
)

# A pyramid over a square, counter-clockwise seen from outside.
PYRAMID = np.array(((-0.8, -0.8, -0.5), (0.8, -0.8, -0.5), (0.8, 0.8, -0.5), (-0.8, 0.8, -0.5), (0.1, -0.05, 0.9)))
OUTWARD = np.array(((0, 2, 1), (0, 3, 2), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)))
TRIANGLE = ((-1.0, -0.7, 0.1), (1.1, -0.6, -0.2), (0.1, 1.0, 0.3))


def shapes(to_world: Matrix) -> tuple[tuple[str, Shape, tuple[str, ...], int], ...]:
    """Return name, shape, further items and least interior pixels (of 80 x 64) of every primitive so placed."""
    return (
        ("sphere", Sphere(albedo=ALBEDO, radius=0.8, to_world=to_world), (), 900),
        ("cube", Cube(albedo=ALBEDO, to_world=to_world), (), 700),
        ("square", Square(albedo=ALBEDO, to_world=to_world), ("HIT-8",), 300),
        ("plane", Plane(albedo=ALBEDO, to_world=to_world), (), 4500),
        ("triangle", Triangle(albedo=ALBEDO, vertices=TRIANGLE, to_world=to_world), ("HIT-5",), 700),
        (
            "mesh",
            Mesh(albedo=ALBEDO, vertices=PYRAMID, faces=OUTWARD, to_world=to_world),
            ("HIT-5", "LIT-2", "LIT-4"),
            900,
        ),
    )


def transforms() -> Iterator[Case]:
    """Yield every primitive under every motion.

    Non-uniform scale, shear and mirror distinguish the inverse transpose from the matrix itself, and a direction that
    is normalised in object space from an unnormalised one.
    """
    for motion, to_world in MOTIONS:
        target = mapped(to_world, (0.05, 0.0, 0.1))
        camera = camera_around(target, distance=4.4, azimuth=-38, elevation=41, width=80, height=64, fovy=31)
        for name, shape, more, least_interior in shapes(to_world):
            scene = Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))
            yield Case(
                name=f"transforms/{name}_{motion}",
                scene=scene,
                stresses=f"A {name} {motion}: the way into object space and the normal's way back.",
                covers=covering(scene, *more),
                least_interior=least_interior,
            )


# Shading normals that reveal a wrong formula: stretch, shear, mirrors, and normals turned towards the viewer.
NORMALS_ALBEDO = (0.6, 0.5, 0.4)
FLAT = compose(translation(0.2, 0.1, 0.1), rotation((0.5, 0.7, -0.3), 40), scaling(2.0, 1.5, 0.25))
SKEW = compose(translation(-0.1, 0.2, 0.1), rotation((-0.3, 0.6, 0.5), 55), shear(xy=0.9, xz=0.5, yz=-0.6))
FLIPPED = compose(translation(0.1, -0.1, 0.2), rotation((0.7, 0.2, 0.6), 70), scaling(1.4, 0.9, -1.2), shear(yz=0.4))

QUESTIONS: tuple[tuple[str, str, tuple[Shape, ...], int], ...] = (
    (
        "flat_ellipsoid",
        "A sphere flattened to a quarter: normals tilt away from the radius.",
        (Sphere(albedo=NORMALS_ALBEDO, to_world=FLAT, radius=0.8),),
        1500,
    ),
    (
        "skew_cube",
        "A strongly sheared cube: its normals are not orthogonal to each other.",
        (Cube(albedo=NORMALS_ALBEDO, to_world=SKEW),),
        800,
    ),
    (
        "mirrored",
        "A mirrored and sheared ellipsoid that passes through a mirrored cube: normals still point outward.",
        (Sphere(albedo=NORMALS_ALBEDO, to_world=FLIPPED, radius=0.75), Cube(albedo=NORMALS_ALBEDO, to_world=FLIPPED)),
        1500,
    ),
    (
        "offset_sphere",
        "A small sphere far from its object-space origin: the centre must be subtracted before normalising.",
        (
            Sphere(
                albedo=NORMALS_ALBEDO,
                center=(3.0, -4.0, 2.0),
                radius=0.9,
                to_world=compose(translation(-3.0, 4.0, -2.0)),
            ),
        ),
        1500,
    ),
    (
        "turned_to_the_viewer",
        "Two-sided and one-sided faces seen from behind: only the two-sided ones turn their normals.",
        (
            Square(
                albedo=NORMALS_ALBEDO,
                to_world=compose(translation(-0.9, -0.2, 0.7), SKEW, rotation((1, 0, 0), 180)),
                two_sided=True,
            ),
            Square(albedo=NORMALS_ALBEDO, to_world=compose(translation(0.7, 0.6, 0.2), FLAT, rotation((0, 1, 0), 180))),
            Plane(
                albedo=NORMALS_ALBEDO,
                to_world=compose(translation(0.0, 0.0, -1.0), rotation((0.8, 0.6, 0.0), 172)),
                two_sided=True,
            ),
        ),
        3000,
    ),
)


def normals() -> Iterator[Case]:
    """Yield one unlit case per question."""
    camera = camera_around((0.1, 0.1, 0.1), distance=4.5, azimuth=-34, elevation=31, width=88, height=72, fovy=30)
    for name, stresses, shapes, least_interior in QUESTIONS:
        scene = Scene(camera=camera, shapes=shapes)
        yield Case(
            name=f"normals/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=least_interior,
        )
