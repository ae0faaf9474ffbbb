"""Small squares close to the light: before it, as the floor sees it, and behind it.

Before the light they throw a shadow as large as one halfway; behind it they throw none. The share of the way at which
each stands runs from 0.9 to 0.9999 and from 1.0001 to 1.1.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around
from rayproof.cases.scene import Camera, Matrix, PointLight, Scene, Square

PLACE = np.array((0.1, -0.2, 3.0))  # of the light [m]
LIGHT = PointLight(position=(0.1, -0.2, 3.0), flux=(500.0, 420.0, 350.0))
CAMERA: Camera = camera_around((0.0, 0.0, 0.0), distance=7.0, azimuth=-50, elevation=38, width=64, height=48, fovy=36)
FLOOR = Square(albedo=(0.6, 0.6, 0.5), to_world=((6, 0, 0, 0), (0, 6, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))
MIDDLES = ((-1.3, -1.2), (1.3, -1.1), (-1.2, 1.2), (1.2, 1.3))  # of the shadows, x and y on the floor [m]
WIDTH = 0.9  # m, of each shadow
BEFORE = (0.9, 0.99, 0.999, 0.9999)
BEHIND = (1.1, 1.01, 1.001, 1.0001)


def _parallel(share: float, middle: tuple[float, float]) -> Matrix:
    """Return where a square stands, parallel to the floor, whose shadow lies there, or would behind the light."""
    ground = np.array((*middle, 0.0))
    x, y, z = (ground + share * (PLACE - ground)).tolist()
    size = WIDTH * abs(1 - share)
    return ((size, 0.0, 0.0, x), (0.0, size, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0))


@CASE_FAMILIES.register("along_the_way")
def along_the_way() -> Iterator[Case]:
    """Yield four squares before the light, then four behind it."""
    for name, shares, stresses in (
        ("before_the_light", BEFORE, "Squares at 0.9 to 0.9999 of the way to the light throw their whole shadow."),
        ("behind_the_light", BEHIND, "Squares at 1.0001 to 1.1 of the way to the light throw none."),
    ):
        squares = tuple(
            Square(albedo=(0.4, 0.5, 0.7), to_world=_parallel(share, middle), two_sided=True)
            for share, middle in zip(shares, MIDDLES, strict=True)
        )
        scene = Scene(camera=CAMERA, shapes=(FLOOR, *squares), lights=(LIGHT,))
        yield Case(
            name=f"along_the_way/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=1200,
            most_edge=0.1,
        )
