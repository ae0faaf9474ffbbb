"""Walls that face the camera at a little less and a little more than near and far: which of them are cut away.

Each wall covers its own part of the image. The camera looks along an axis from the origin, so that a wall's depth is
one number of its scene. The closest walls are eight roundings of float32 away from the plane: what single precision
can just tell for certain.
"""

from collections.abc import Iterator

from rayproof.cases.case import Case
from rayproof.cases.covering import covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.scene import Camera, PointLight, Scene, Shape, Square

NEAR, FAR = 1.5, 12.0  # m
CAMERA = Camera(
    eye=(0.0, 0.0, 0.0),
    target=(0.0, 0.0, -1.0),
    up=(0.0, 1.0, 0.0),
    fovy=40.0,
    width=56,
    height=40,
    near=NEAR,
    far=FAR,
)
LIGHT = PointLight(position=(0.2, 0.1, -0.3), flux=(300.0, 340.0, 260.0))
COARSE, FINE = 2.0**-18, 2.0**-21  # relative; float32 rounds by 2^-24


def _walls(depth: float) -> Iterator[Shape]:
    """Yield walls before and behind a depth [m], in the four quarters of the image."""
    for number, share in enumerate((-COARSE, COARSE, -FINE, FINE)):
        beyond = depth * (1 + share)
        x, y = 0.42 * (number % 2 - 0.5) * beyond, 0.32 * (number // 2 - 0.5) * beyond
        width, height = 0.36 * beyond, 0.27 * beyond
        yield Square(
            albedo=(0.3 + 0.15 * number, 0.6, 0.8 - 0.1 * number),
            to_world=((width, 0.0, 0.0, x), (0.0, height, 0.0, y), (0.0, 0.0, 1.0, -beyond), (0.0, 0.0, 0.0, 1.0)),
        )


@CASE_FAMILIES.register("walls")
def walls() -> Iterator[Case]:
    """Yield walls about the near plane, then about the far one."""
    for name, depth in (("near", NEAR), ("far", FAR)):
        scene = Scene(camera=CAMERA, shapes=tuple(_walls(depth)), lights=(LIGHT,))
        yield Case(
            name=f"walls/{name}",
            scene=scene,
            stresses=f"Walls that face the camera a few roundings before and behind the {name} plane.",
            covers=covering(scene, "HIT-2"),
            least_interior=500,
            most_edge=0.2,
        )
