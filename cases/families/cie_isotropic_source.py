"""CIE 171:2006, test case 5.2: an isotropic 1000 cd source 3 m above a 4 x 4 m plane, E = I h / d^3.

The plane is parallel to the image, and its pixels are 1/16 m wide, so the reported points are pixel centres: 111.111 lx
under the source, 106.637 lx half a metre beside it and 60.481 lx at (1.5, 1.5) m. Lumen are stored as watts.
Source: CIE 171:2006, Test Cases to Assess the Accuracy of Lighting Computer Programs, section 5.2.
"""

from collections.abc import Iterator
from math import pi

from rayproof.cases.case import Case, PixelValue, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import compose, frontal_fovy, mapped, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import IDENTITY, Camera, Matrix, PointLight, Scene, Square, Vector
from rayproof.cases.stages import Stage

INTENSITY = (1000.0, 500.0, 250.0)  # cd = lm/sr, stored as W/sr; the first channel is the test's
SOURCE_HEIGHT, EYE_HEIGHT = 3.0, 5.0  # m above the plane
PIXEL = 1 / 16  # m
WIDTH, HEIGHT = 97, 65  # odd: a pixel centre lies under the source
POINTS = ((0.0, 0.0), (0.5, 0.0), (0.0, -0.5), (1.0, 0.5), (1.5, 1.5), (-1.5, 1.0), (-1.75, -1.75))  # m
ROUNDINGS = 60  # of camera ray (20), hit (15), feeler vector and its length (10), cosine and falloff (15)
EXTENT = 2.0  # a rounding of the hit point counts this much more: |p| / d times the exponent 3
GENERIC = compose(translation(0.7, -0.4, 0.3), rotation((0.3, 0.8, 0.5), 50))


def measured(name: str, stresses: str, frame: Matrix) -> Case:
    """Return the test case placed in `frame`."""

    def direction(x: float, y: float, z: float) -> Vector:
        tip, foot = mapped(frame, (x, y, z)), mapped(frame, (0.0, 0.0, 0.0))
        return (tip[0] - foot[0], tip[1] - foot[1], tip[2] - foot[2])

    camera = Camera(
        eye=mapped(frame, (0.0, 0.0, EYE_HEIGHT)),
        target=mapped(frame, (0.0, 0.0, 0.0)),
        up=direction(0.0, 1.0, 0.0),
        fovy=frontal_fovy(height=HEIGHT, pixel=PIXEL, distance=EYE_HEIGHT),
        width=WIDTH,
        height=HEIGHT,
        near=0.5,
        far=20.0,
    )
    red, green, blue = (4 * pi * intensity for intensity in INTENSITY)
    source = PointLight(position=mapped(frame, (0.0, 0.0, SOURCE_HEIGHT)), flux=(red, green, blue))
    plane = Square(albedo=(0.3, 0.5, 0.7), to_world=compose(frame, scaling(4.0, 4.0, 1.0)))
    scene = Scene(camera=camera, shapes=(plane,), lights=(source,))
    return Case(
        name=f"cie_isotropic_source/{name}",
        scene=scene,
        stresses=stresses,
        covers=covering(scene, "CAM-5", "HIT-8"),
        least_interior=3500,
        most_edge=0.06,  # the plane's border lies on pixel centres
        expectations=tuple(
            PixelValue(
                stage=Stage.IRRADIANCE,
                column=WIDTH // 2 + round(x / PIXEL),
                row=HEIGHT // 2 - round(y / PIXEL),
                channel=channel,
                value=intensity * SOURCE_HEIGHT / (x * x + y * y + SOURCE_HEIGHT**2) ** 1.5,
                relative=gamma(ROUNDINGS * EXTENT, precision="float32"),
                because=f"CIE 171:2006, 5.2: I h / d^3; float32: {ROUNDINGS} roundings, times {EXTENT:g} for the hit",
            )
            for x, y in POINTS
            for channel, intensity in enumerate(INTENSITY)
        ),
    )


@CASE_FAMILIES.register("cie_isotropic_source")
def cie_isotropic_source() -> Iterator[Case]:
    """Yield the test as published and the same in a generic frame."""
    yield measured("as_published", "CIE 171:2006 test 5.2 in its own axes: E = I h / d^3 at known points.", IDENTITY)
    yield measured(
        "turned", "CIE 171:2006 test 5.2 in a generic frame: the same irradiance at the same pixels.", GENERIC
    )
