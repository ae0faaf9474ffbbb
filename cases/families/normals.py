"""Shading normals where a wrong formula shows: stretch, shear, mirrors, and normals turned towards the viewer."""

from collections.abc import Iterator

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation
from rayproof.cases.scene import Cube, Plane, Scene, Shape, Sphere, Square

ALBEDO = (0.6, 0.5, 0.4)
FLAT = compose(translation(0.2, 0.1, 0.1), rotation((0.5, 0.7, -0.3), 40), scaling(2.0, 1.5, 0.25))
SKEW = compose(translation(-0.1, 0.2, 0.1), rotation((-0.3, 0.6, 0.5), 55), shear(xy=0.9, xz=0.5, yz=-0.6))
FLIPPED = compose(translation(0.1, -0.1, 0.2), rotation((0.7, 0.2, 0.6), 70), scaling(1.4, 0.9, -1.2), shear(yz=0.4))

QUESTIONS: tuple[tuple[str, str, tuple[Shape, ...], int], ...] = (
    (
        "flat_ellipsoid",
        "A sphere flattened to a quarter: normals tilt away from the radius.",
        (Sphere(albedo=ALBEDO, to_world=FLAT, radius=0.8),),
        1500,
    ),
    (
        "skew_cube",
        "A strongly sheared cube: its normals are not orthogonal to each other.",
        (Cube(albedo=ALBEDO, to_world=SKEW),),
        800,
    ),
    (
        "mirrored",
        "A mirrored and sheared ellipsoid that passes through a mirrored cube: normals still point outward.",
        (Sphere(albedo=ALBEDO, to_world=FLIPPED, radius=0.75), Cube(albedo=ALBEDO, to_world=FLIPPED)),
        1500,
    ),
    (
        "offset_sphere",
        "A small sphere far from its object-space origin: the centre must be subtracted before normalising.",
        (Sphere(albedo=ALBEDO, center=(3.0, -4.0, 2.0), radius=0.9, to_world=compose(translation(-3.0, 4.0, -2.0))),),
        1500,
    ),
    (
        "turned_to_the_viewer",
        "Two-sided and one-sided faces seen from behind: only the two-sided ones turn their normals.",
        (
            Square(
                albedo=ALBEDO,
                to_world=compose(translation(-0.9, -0.2, 0.7), SKEW, rotation((1, 0, 0), 180)),
                two_sided=True,
            ),
            Square(albedo=ALBEDO, to_world=compose(translation(0.7, 0.6, 0.2), FLAT, rotation((0, 1, 0), 180))),
            Plane(
                albedo=ALBEDO,
                to_world=compose(translation(0.0, 0.0, -1.0), rotation((0.8, 0.6, 0.0), 172)),
                two_sided=True,
            ),
        ),
        3000,
    ),
)


@CASE_FAMILIES.register("normals")
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
            most_edge=0.04,
        )
