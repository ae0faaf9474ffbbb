"""Every primitive alone, untransformed: what fails here fails in the primitive's own intersection and normal."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around
from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle

ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(2.1, -1.4, 3.3), flux=(310.0, 220.0, 420.0))
# A skew tetrahedron: counter-clockwise seen from outside.
TETRAHEDRON = np.array(((-0.9, -0.7, -0.6), (1.1, -0.5, -0.4), (-0.1, 1.2, -0.5), (0.15, -0.1, 1.05)))
OUTWARD = np.array(((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
TRIANGLE = ((-1.1, -0.6, 0.2), (1.2, -0.4, -0.3), (-0.2, 0.9, 0.8))

# Name, shape, further items, least interior pixels (of 96 x 72), largest edge share.
PRIMITIVES: tuple[tuple[str, Shape, tuple[str, ...], int, float], ...] = (
    ("sphere", Sphere(albedo=ALBEDO, center=(0.2, -0.1, 0.15), radius=0.85), (), 2000, 0.02),
    ("cube", Cube(albedo=ALBEDO), (), 1300, 0.02),
    ("square", Square(albedo=ALBEDO), ("HIT-8",), 420, 0.02),
    ("plane", Plane(albedo=ALBEDO), (), 6000, 0.02),
    ("triangle", Triangle(albedo=ALBEDO, vertices=TRIANGLE), ("HIT-5",), 1300, 0.02),
    ("mesh", Mesh(albedo=ALBEDO, vertices=TETRAHEDRON, faces=OUTWARD), ("HIT-5", "LIT-2", "LIT-4"), 1300, 0.03),
)  # fmt: skip


@CASE_FAMILIES.register("primitives")
def primitives() -> Iterator[Case]:
    """Yield one case per primitive."""
    camera = camera_around((0.1, 0.05, 0.1), distance=4.2, azimuth=-52, elevation=33, width=96, height=72, fovy=29)
    for name, shape, more, least_interior, most_edge in PRIMITIVES:
        scene = Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))
        yield Case(
            name=f"primitives/{name}",
            scene=scene,
            stresses=f"A {name} alone, without a transform: its intersection, its normal and its irradiance.",
            covers=covering(scene, "CAM-5", *more),
            least_interior=least_interior,
            most_edge=most_edge,
        )
