"""The three clip modes on geometry that the near and the far plane cut open, wide enough that they differ.

The specification's `depth` clips by planes, `shell` by spheres around the eye (the lecture's t), `none` not at all.
Among a primitive's intersections the smallest inside the interval counts, so a cut sphere shows its inside. Only
camera rays are clipped: what is cut away still throws its shadow.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import CLIPS, Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

FLOOR = Plane(
    albedo=(0.6, 0.6, 0.5), to_world=compose(translation(0.1, 0.0, -1.1), rotation((1.0, 0.3, 0.1), 6)), two_sided=True
)
# The near plane passes through the sphere; the small square lies before it and is seen by the light alone.
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


@CASE_FAMILIES.register("clipping")
def clipping() -> Iterator[Case]:
    """Yield both scenes in the three modes, then a plane up to its horizon with and without a far plane."""
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
            most_edge=0.04,
        )
    for clip in CLIPS:
        scene = Scene(camera=close, shapes=FLAT_FACED, clip=clip)
        yield Case(
            name=f"clipping/faces_{clip}",
            scene=scene,
            stresses=f"A cube, a mesh and a triangle cut by the near and the far plane, clip {clip}.",
            covers=covering(scene, "CAM-5", "HIT-2", "HIT-5"),
            least_interior=1200,
            most_edge=0.05,
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
            most_edge=0.04,
        )
