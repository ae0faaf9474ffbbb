"""Every primitive behind the eye: a line through the eye meets it, a ray does not.

Whoever takes a negative root, forgets that a box behind the origin is a miss, or makes a distance positive sees these
shapes where they are not, in front of everything else.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Clip, Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

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
    x, y, z = eye + distance * backward + aside * right + above * np.asarray(CAMERA.up)
    return (float(x), float(y), float(z))


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


@CASE_FAMILIES.register("behind")
def behind() -> Iterator[Case]:
    """Yield one case per primitive, unclipped; then all of them at once behind a near plane, and lit."""
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
            most_edge=0.03,
        )
