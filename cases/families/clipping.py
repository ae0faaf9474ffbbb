"""Families `clipping` and `walls`: shapes cut open by near and far, walls just before and behind these."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation, unit
from rayproof.cases.scene import CLIPS, Camera, Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

# The three clip modes on geometry that the near and the far plane cut open, wide enough that they differ.
FLOOR = Plane(
    albedo=(0.6, 0.6, 0.5), to_world=compose(translation(0.1, 0.0, -1.1), rotation((1.0, 0.3, 0.1), 6)), two_sided=True
)
# The near plane passes through the sphere; the small square is in front of it, and only shadow rays can hit it.
OPENED: tuple[Shape, ...] = (
    FLOOR,
    Sphere(albedo=(0.8, 0.4, 0.3), center=(0.1, 0.1, 0.0), radius=1.0, two_sided=True),
    Square(
        albedo=(0.3, 0.5, 0.8),
        to_world=compose(translation(1.3, -1.5, 1.3), rotation((0.3, 1.0, 0.2), 20), scaling(0.5, 0.5, 1)),
        two_sided=True,
    ),
)
WEDGE = np.array(((-1.5, -0.9, -0.8), (1.4, -0.7, -0.9), (0.1, 1.5, -0.7), (0.2, 0.1, 1.2)))
OUTWARD = np.array(((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
FLAT_FACED: tuple[Shape, ...] = (
    Cube(
        albedo=(0.4, 0.7, 0.5),
        to_world=compose(translation(0.7, -0.5, 0.2), rotation((0.4, 0.8, -0.3), 37), scaling(1.6, 1.1, 1.3)),
        two_sided=True,
    ),
    Mesh(albedo=(0.7, 0.6, 0.3), vertices=WEDGE, faces=OUTWARD, to_world=translation(-0.8, 0.9, 0.2), two_sided=True),
    Triangle(albedo=(0.5, 0.4, 0.8), vertices=((-3.0, -2.0, -1.2), (3.5, -1.0, -1.4), (0.5, 4.5, -1.0))),
)


def clipping() -> Iterator[Case]:
    """Yield both scenes in the three modes, then a plane up to its horizon with and without a far plane.

    The specification's `depth` clips by planes, `shell` by spheres around the eye (the lecture's t), `none` not at all.
    Among a primitive's intersections the smallest inside the interval counts, so a cut sphere shows its inside. Only
    camera rays are clipped: the clipped part still casts its shadow.
    """
    wide = camera_around(
        (0.2, 0.0, 0.0), distance=2.5, azimuth=-48, elevation=33, width=96, height=72, fovy=86, near=1.9, far=4.2
    )
    close = camera_around(
        (0.1, 0.1, 0.0), distance=3.9, azimuth=-48, elevation=33, width=96, height=72, fovy=52, near=3.3, far=5.0
    )
    light = PointLight(position=(2.2, -2.4, 3.3), flux=(420.0, 300.0, 500.0))
    for clip in CLIPS:
        scene = Scene(camera=wide, shapes=OPENED, lights=(light,), clip=clip)
        yield Case(
            name=f"clipping/sphere_{clip}",
            scene=scene,
            stresses=f"A sphere cut open and a floor cut off, clip {clip}; a square cut away still throws its shadow.",
            covers=covering(scene, "HIT-2", "LIT-4"),
            least_interior=2000,
        )
    for clip in CLIPS:
        scene = Scene(camera=close, shapes=FLAT_FACED, clip=clip)
        yield Case(
            name=f"clipping/faces_{clip}",
            scene=scene,
            stresses=f"A cube, a mesh and a triangle cut by the near and the far plane, clip {clip}.",
            covers=covering(scene, "CAM-5", "HIT-2", "HIT-5"),
            least_interior=1200,
        )
    low = camera_around(
        (0.0, 0.0, 0.6), distance=3.0, azimuth=-20, elevation=8, width=96, height=64, fovy=55, near=0.2, far=40.0
    )
    for clip in ("depth", "none"):
        scene = Scene(camera=low, shapes=(FLOOR,), clip=clip)
        yield Case(
            name=f"clipping/horizon_{clip}",
            scene=scene,
            stresses=f"A plane up to its horizon, clip {clip}: rays run ever more nearly parallel to it, then away.",
            covers=covering(scene, "HIT-2"),
            least_interior=2000,
        )


# Walls that face the camera at a little less and a little more than near and far: which of them are cut away.
NEAR, FAR = 1.5, 12.0  # m
CAMERA = Camera(
    eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0), up=(0.0, 1.0, 0.0), fovy=40.0, width=56, height=40, near=NEAR, far=FAR
)
LIGHT = PointLight(position=(0.2, 0.1, -0.3), flux=(300.0, 340.0, 260.0))
COARSE, FINE = 2.0**-18, 2.0**-21  # relative; float32 rounds by 2^-24
BESIDE = 1e-9  # relative; float32 cannot resolve it, and float64 rounds by 1e-16
SMALL = CAMERA.width // 2, CAMERA.height // 2  # px
CUT_ROWS = (12, 18)  # of the floor, the last that far and the first that near leaves in sight
FLAT = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))  # z becomes -y
# Of a shell's walls, the distance of a corner from the middle over that from the eye: they lie flatter than FINE.
NARROW = 2e-4


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


def _cut_floor() -> Scene:
    """Return a floor that near and far cut 1e-9 of their depth off the centres of two rows, which stay visible."""
    height = SMALL[1]
    # The floor is 1 m below the eye: the middle of a row sees it at a depth of 1 / tan of the angle below the axis.
    first, last = (1 / ((2 * (row + 0.5) / height - 1) * math.tan(CAMERA.alpha)) for row in CUT_ROWS)
    camera = replace(CAMERA, width=SMALL[0], height=height, near=last * (1 - BESIDE), far=first * (1 + BESIDE))
    floor = Square(albedo=(0.5, 0.6, 0.7), to_world=compose(translation(0, -1, -8), FLAT, scaling(30, 20, 1)))
    return Scene(camera=camera, shapes=(floor,))


def _shell_walls(camera: Camera) -> Iterator[Shape]:
    """Yield a triangle for each pixel, square to its ray, at a distance before or behind near or far, by quarters."""
    width, height = camera.width, camera.height
    column, row = (grid.reshape(-1) for grid in np.meshgrid(np.arange(width), np.arange(height)))
    across, up = (2 * (column + 0.5) / width - 1) * camera.aspect, 1 - 2 * (row + 0.5) / height
    toward = np.stack([across * math.tan(camera.alpha), up * math.tan(camera.alpha), -np.ones(len(row))], axis=1)
    toward = unit(toward)
    side = np.cross(toward, (0.0, 1.0, 0.0))
    side = unit(side)
    above = np.cross(side, toward)
    corners = [
        toward + NARROW * (math.cos(angle) * side + math.sin(angle) * above)
        for angle in 0.3 + 2 * math.pi * np.arange(3) / 3
    ]
    quarter = 2 * (row >= height // 2) + (column >= width // 2)
    for number, (clip, share) in enumerate(((NEAR, -FINE), (NEAR, FINE), (FAR, -FINE), (FAR, FINE))):
        vertices = clip * (1 + share) * np.stack(corners, axis=1)[quarter == number].reshape(-1, 3)
        faces = np.arange(len(vertices)).reshape(-1, 3)
        yield Mesh(albedo=(0.3 + 0.15 * number, 0.6, 0.5), vertices=vertices, faces=faces)


def walls() -> Iterator[Case]:
    """Yield walls about the near plane, then about the far one; a floor that both cut, and walls about a shell.

    Each wall covers its own part of the image. The camera looks along an axis from the origin, so that a wall's depth
    is one number of its scene. The closest walls are eight roundings of float32 away from the plane, the least distance
    that single precision resolves with certainty. A floor is cut so close to pixel centres that only double precision
    resolves it. For the shell every pixel has a small wall of its own, which faces the eye.
    """
    for name, depth in (("near", NEAR), ("far", FAR)):
        scene = Scene(camera=CAMERA, shapes=tuple(_walls(depth)), lights=(LIGHT,))
        yield Case(
            name=f"walls/{name}",
            scene=scene,
            stresses=f"Walls that face the camera a few roundings before and behind the {name} plane.",
            covers=covering(scene, "HIT-2"),
            least_interior=500,
        )
    scene = _cut_floor()
    yield Case(
        name="walls/cut_beside_pixels",
        scene=scene,
        stresses="A floor cut 1e-9 beside pixel centres: clipping in single precision loses some of a double's pixels.",
        covers=covering(scene, "HIT-2"),
        least_interior=100,
        # Single precision cannot resolve two rows.
        most_explained=0.2,
    )
    few = replace(CAMERA, width=SMALL[0] // 2, height=SMALL[1] // 2)
    scene = Scene(camera=few, shapes=tuple(_shell_walls(few)), clip="shell")
    yield Case(
        name="walls/shell",
        scene=scene,
        stresses="Small walls that face the eye, eight roundings before and behind the two spheres that clip.",
        covers=covering(scene, "HIT-2"),
        least_interior=60,
    )
