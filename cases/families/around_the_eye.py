"""Families `behind` (shapes behind the eye) and `inside` (spheres and cubes seen from within)."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, UniformValue, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation, vector
from rayproof.cases.scene import Camera, Clip, Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

# Every primitive behind the eye: a line through the eye meets it, a ray does not.
FLOOR = Square(
    albedo=(0.6, 0.55, 0.5),
    to_world=compose(translation(0.1, 0.0, -1.0), rotation((0.5, 1.0, 0.2), 8), scaling(7, 6, 1)),
)
IN_FRONT = Sphere(albedo=(0.4, 0.6, 0.7), center=(0.2, -0.1, 0.1), radius=0.7)
CORNERS = np.array(((-0.6, -0.5, -0.4), (0.7, -0.4, -0.5), (-0.1, 0.8, -0.4), (0.1, 0.0, 0.9)))
OUTWARD = np.array(((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
CAMERA = camera_around((0.1, 0.0, -0.1), distance=4.0, azimuth=-51, elevation=37, width=88, height=66, fovy=44)


def beyond_the_eye(distance: float, *, aside: float, above: float) -> tuple[float, float, float]:
    """Return a place `distance` [m] behind the eye, moved a little to the side and up, off the viewing axis."""
    eye, target = np.asarray(CAMERA.eye), np.asarray(CAMERA.target)
    backward = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(np.asarray(CAMERA.up), backward)
    return vector(eye + distance * backward + aside * right + above * np.asarray(CAMERA.up))


def hidden_shapes() -> tuple[tuple[str, Shape, tuple[str, ...]], ...]:
    """Return name, shape and further items of one primitive of each kind behind the eye."""
    turned = rotation((0.4, -0.7, 0.5), 40)
    here = compose(translation(*beyond_the_eye(3.2, aside=0.3, above=-0.2)), turned, scaling(1.3, 1.1, 1.2))
    facing = compose(translation(*beyond_the_eye(2.6, aside=-0.2, above=0.3)), turned, scaling(2.4, 2.1, 1.0))
    corners = beyond_the_eye(3.0, aside=-1.3, above=-0.9), beyond_the_eye(2.7, aside=1.2, above=-0.8)
    triangle = (*corners, beyond_the_eye(3.3, aside=0.1, above=1.4))
    albedo = (0.8, 0.4, 0.3)
    return (
        ("sphere", Sphere(albedo=albedo, center=beyond_the_eye(3.1, aside=0.2, above=0.1), radius=1.0), ()),
        ("cube", Cube(albedo=albedo, to_world=here), ()),
        ("plane", Plane(albedo=albedo, to_world=facing), ()),
        ("square", Square(albedo=albedo, to_world=facing), ("HIT-8",)),
        ("triangle", Triangle(albedo=albedo, vertices=triangle), ("HIT-5",)),
        ("mesh", Mesh(albedo=albedo, vertices=CORNERS, faces=OUTWARD, to_world=here), ("HIT-5",)),
    )


def behind() -> Iterator[Case]:
    """Yield a case per primitive, unclipped; then all of them together behind a near plane, and lit.

    A renderer that takes a negative root, forgets that a box behind the origin is a miss, or takes the absolute value
    of a distance shows these shapes in front of everything else.
    """
    hidden = hidden_shapes()
    light = PointLight(position=(2.1, -1.2, 3.1), flux=(420.0, 360.0, 300.0))
    everything = tuple(shape for name, shape, _ in hidden if name != "plane")
    questions: list[tuple[str, str, tuple[Shape, ...], tuple[PointLight, ...], Clip, tuple[str, ...]]] = [
        (name, f"A {name} behind the eye, and nothing clipped.", (FLOOR, IN_FRONT, shape), (), "none", more)
        for name, shape, more in hidden
    ]
    questions.append(
        (
            "all_lit",
            "Shapes of every kind behind the eye and the near plane.",
            (FLOOR, IN_FRONT, *everything),
            (light,),
            "depth",
            (),
        )
    )
    for name, stresses, shapes, lights, clip, more in questions:
        scene = Scene(camera=CAMERA, shapes=shapes, lights=lights, clip=clip)
        yield Case(
            name=f"behind/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, "HIT-2", *more),
            least_interior=3500,
        )


# A camera inside a sphere and inside a cube: the nearer root is behind it and the normal is turned.
ALBEDO = (0.6, 0.7, 0.45)
LIGHT = PointLight(position=(0.5, -0.4, 0.6), flux=(160.0, 120.0, 210.0))
INNER = Sphere(albedo=(0.8, 0.3, 0.4), center=(-0.6, 0.3, -0.2), radius=0.35)
ROOM = compose(translation(0.2, 0.1, 0.1), rotation((0.3, 0.7, -0.4), 27), scaling(4.2, 3.6, 3.9))
SKEW = compose(
    translation(0.2, 0.1, 0.1), rotation((0.3, 0.7, -0.4), 27), shear(xy=0.3, yz=-0.2), scaling(4.2, 3.6, 3.9)
)


def viewpoint(fovy: float) -> Camera:
    """Return a camera a little more than a metre from the middle that looks across it."""
    return camera_around(
        (-0.2, 0.1, -0.1), distance=1.2, azimuth=-30, elevation=25, width=88, height=64, fovy=fovy
    )  # fmt: skip


def inside() -> Iterator[Case]:
    """Yield spheres and cubes seen from within, one- and two-sided, empty and with something inside."""
    sphere = Sphere(albedo=ALBEDO, center=(0.1, 0.05, -0.1), radius=2.1, two_sided=True)
    stretched = Sphere(albedo=ALBEDO, to_world=SKEW, radius=0.5, two_sided=True)
    cube = Cube(albedo=ALBEDO, to_world=ROOM, two_sided=True)
    skewed = Cube(albedo=ALBEDO, to_world=SKEW, two_sided=True)
    scenes: tuple[tuple[str, str, tuple[Shape, ...]], ...] = (
        ("sphere", "Inside a two-sided sphere with the light: the farther root counts.", (sphere,)),
        ("ellipsoid", "Inside a two-sided ellipsoid: in its space the ray has another length.", (stretched,)),
        ("cube", "Inside a two-sided cube with the light: t_near is negative and the hit is t_far.", (cube,)),
        ("skew_cube", "Inside a sheared two-sided cube: six normals that are not orthogonal.", (skewed,)),
        ("sphere_in_cube", "A sphere inside a cube, both seen from within the cube, with its shadow.", (cube, INNER)),
    )  # fmt: skip
    for name, stresses, shapes in scenes:
        scene = Scene(camera=viewpoint(84), shapes=shapes, lights=(LIGHT,))
        yield Case(
            name=f"inside/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, "CAM-5", "LIT-4"),
            least_interior=4500,
        )
    one_sided = Sphere(albedo=ALBEDO, center=(0.1, 0.05, -0.1), radius=2.1)
    scene = Scene(camera=viewpoint(60), shapes=(one_sided,), lights=(LIGHT,))
    yield Case(
        name="inside/one_sided_sphere",
        scene=scene,
        stresses="Inside a one-sided sphere: it is hit from within, and black.",
        covers=covering(scene),
        least_interior=5000,
        expectations=tuple(
            UniformValue(
                stage=Stage.RADIANCE,
                shape=0,
                channel=channel,
                value=0.0,
                relative=0.0,
                because="one-sided and seen from behind",
            )
            for channel in range(3)
        ),
    )
