"""Numbers of faces at which a tree has another shape: one, nine, 1025, and more than 2^15.

Among many small faces stand large ones, the mesh's first, middle and last: one that is lost leaves a hole of its size.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, translation
from rayproof.cases.scene import Mesh, PointLight, Scene, Vector

ALBEDO = (0.65, 0.7, 0.45)
LIGHT = PointLight(position=(0.8, -0.7, 4.1), flux=(400.0, 330.0, 460.0))
TURN = compose(translation(0.05, -0.03, 0.1), rotation((0.4, 1.0, 0.3), 12))
WIDE = np.array(((-3.0, -2.2, 0.0), (3.4, -2.5, 0.1), (0.1, 4.5, -0.1)))  # fills the frame
LARGE = np.array(((-0.45, -0.4, 0.0), (0.5, -0.35, 0.05), (0.0, 0.55, -0.05)))
ROWS = 3  # of large faces

Corners = np.ndarray  # (faces, 3, 3) [m]


def mesh_of(corners: Corners, *, two_sided: bool = False) -> Mesh:
    """Return a mesh whose faces share no vertex."""
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Mesh(
        albedo=ALBEDO,
        vertices=corners.reshape(-1, 3),
        faces=faces,
        to_world=TURN,
        two_sided=two_sided,
    )


def apart(count: int) -> Corners:
    """Return large faces in rows of three, each by itself."""
    places = np.arange(count)
    offsets = np.stack([1.15 * (places % ROWS - 1), 1.05 * (places // ROWS - 1), 0.04 * places], axis=1)
    return LARGE + offsets[:, np.newaxis]


def among(count: int) -> Corners:
    """Return `count` faces: nine large ones, the first, the middle and the last of them, and a strip of small ones."""
    large = apart(9)
    small = count - len(large)
    across = int(np.ceil(np.sqrt(6 * small)))  # the strip is some six times as long as it is wide
    step = 3.4 / across
    column, row = np.arange(small) % across, np.arange(small) // across
    heights = 0.02 * np.sin(40 * step * column)
    offsets = np.stack([-1.7 + step * column, -1.65 - step * row, heights], axis=1)
    crumbs = 0.8 * step * LARGE + offsets[:, np.newaxis]
    middle = small // 2
    return np.concatenate([large[:3], crumbs[:middle], large[3:6], crumbs[middle:], large[6:]])


def behind(depths: Sequence[float]) -> Corners:
    """Return faces that fill the frame at those heights, each smaller than what lies below it."""
    shrink = {depth: 0.9 - 0.8 * rank / len(depths) for rank, depth in enumerate(sorted(depths))}
    return np.stack([WIDE * (shrink[depth], shrink[depth], 1.0) * 0.7 + (0.0, 0.0, depth) for depth in depths])


@CASE_FAMILIES.register("faces")
def faces() -> Iterator[Case]:
    """Yield meshes of one, five, nine, 1025 and 2^15 + 1 faces; those of an odd number of pixels are 65 wide."""
    target: Vector = (0.0, -0.15, 0.0)
    even = camera_around(target, distance=6.0, azimuth=-95, elevation=70, width=64, height=48, fovy=38)
    odd = camera_around(target, distance=6.0, azimuth=-95, elevation=70, width=65, height=49, fovy=38)
    close = camera_around(target, distance=3.2, azimuth=-95, elevation=70, width=65, height=49, fovy=38)
    stacked = behind((-0.4, 0.5, -0.1, 0.8, 0.2))
    named = {
        "one": "One face that fills the frame: a tree of a single leaf, 65 pixels wide.",
        "above_each_other": "Five faces above each other, in no order, each seen at its rim.",
        "nine": "Nine faces, one more than a power of two, in an image of odd width and height.",
        "thousand_and_25": "1025 faces, one more than a power of two; three large ones are the last.",
        "over_two_to_the_15": "2^15 + 1 faces, most of them smaller than a pixel.",
    }
    questions = (
        ("one", close, WIDE[np.newaxis], 2500),
        ("above_each_other", odd, stacked, 900),
        ("nine", odd, apart(9), 500),
        ("thousand_and_25", even, among(1025), 500),
        ("over_two_to_the_15", even, among(2**15 + 1), 500),
    )
    for name, camera, corners, least_interior in questions:
        scene = Scene(camera=camera, shapes=(mesh_of(corners, two_sided=name == "one"),), lights=(LIGHT,))
        yield Case(
            name=f"faces/{name}",
            scene=scene,
            stresses=named[name],
            covers=covering(scene),
            least_interior=least_interior,
            most_edge=0.2,
        )
