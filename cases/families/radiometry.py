"""Families with light in closed form: inverse square, CIE source, integrating sphere, flux conservation, invariance."""

from collections.abc import Iterator
from math import atan, cos, pi, radians, sin, sqrt, tan

import numpy as np

from rayproof.cases.case import Case, Flux, PixelValue, UniformValue, covering
from rayproof.cases.placement import camera_around, compose, frontal_fovy, mapped, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import IDENTITY, Camera, Matrix, PointLight, Scene, Shape, Sphere, Square, Vector
from rayproof.cases.stages import Stage

# A point light over a square at known distances and angles: the inverse-square law and Lambert's cosine law.
CENTER: Vector = (0.4, -0.3, 0.6)
TILT = compose(translation(*CENTER), rotation((1.0, 0.5, 0.3), 28))
SQUARE = Square(albedo=(0.7, 0.5, 0.25), to_world=compose(TILT, scaling(3.0, 2.2, 1.0)))
FLUX = (400.0, 250.0, 520.0)  # W
DISTANCES = (0.5, 1.0, 2.0, 4.0, 8.0)  # m; straight above, each step a quarter of the irradiance
ANGLES = (30.0, 60.0, 75.0, 85.0, 95.0, 150.0)  # degrees from the normal, at 2 m; the last two below the horizon
WIDTH, HEIGHT = 81, 65  # odd: a pixel centre is on the central ray
EYE_DISTANCE = 5.0  # m
ROUNDINGS = 25  # of the shadow ray vector and its length (10), cosine and falloff (15)
PLACE = 10  # roundings of the eye's distance: the largest error of the hit's place


def lit(name: str, stresses: str, distance: float, angle: float, least_interior: int) -> Case:
    """Return the case of a light at `distance` [m] from the square's centre, `angle` degrees off its normal."""
    turn = radians(angle)
    light = mapped(TILT, (distance * sin(turn) * 0.8, distance * sin(turn) * 0.6, distance * cos(turn)))
    camera = camera_around(
        CENTER, distance=EYE_DISTANCE, azimuth=-70, elevation=48, width=WIDTH, height=HEIGHT, fovy=38
    )
    scene = Scene(camera=camera, shapes=(SQUARE,), lights=(PointLight(position=light, flux=FLUX),))
    above = angle < 90
    falloff = cos(turn) / (4 * pi * distance**2) if above else 0.0
    # A hit that is misplaced by s changes 1 / r^2 by 2 s / r and the cosine by tan s / r.
    roundings = ROUNDINGS + PLACE * (2 + abs(tan(turn))) * EYE_DISTANCE / distance
    because = (
        f"Phi cos / (4 pi r^2); float32: {ROUNDINGS} roundings, and a hit misplaced by {PLACE} roundings of "
        f"{EYE_DISTANCE:g} m counts (2 + tan) / r"
        if above
        else "below the horizon nothing arrives, exactly"
    )
    return Case(
        name=f"inverse_square/{name}",
        scene=scene,
        stresses=stresses,
        covers=covering(scene),
        least_interior=least_interior,
        expectations=tuple(
            PixelValue(
                stage=stage,
                column=WIDTH // 2,
                row=HEIGHT // 2,
                channel=channel,
                value=flux * falloff * factor[channel],
                relative=gamma(roundings, precision="float32") if above else 0.0,
                because=because,
            )
            for stage, factor in (
                (Stage.IRRADIANCE, (1.0, 1.0, 1.0)),
                (Stage.EXITANCE, SQUARE.albedo),
                (Stage.RADIANCE, tuple(albedo / pi for albedo in SQUARE.albedo)),
            )
            for channel, flux in enumerate(FLUX)
        ),
    )


def inverse_square() -> Iterator[Case]:
    """Yield the sweep over distance, then the sweep over angle.

    The centre of the image sees the centre of the square, so E = Phi cos / (4 pi r^2) is known there in closed form
    (Lambert, Photometria, 1760; Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed. (2023), section 4.1).
    """
    for distance in DISTANCES:
        yield lit(
            f"distance_{distance:g}m",
            f"A light {distance:g} m straight above a square: irradiance falls with the square of the distance.",
            distance,
            0.0,
            1200,
        )
    for angle in ANGLES:
        place = "above" if angle < 90 else "below"
        yield lit(
            f"angle_{angle:g}",
            f"A light {angle:g} degrees off the normal, {place} the horizon: Lambert's cosine and its clamp.",
            2.0,
            angle,
            1200,
        )


# CIE 171:2006, test case 5.2: an isotropic 1000 cd source 3 m above a 4 x 4 m plane, E = I h / d^3.
INTENSITY = (1000.0, 500.0, 250.0)  # cd = lm/sr, stored as W/sr; the first channel is the test's
SOURCE_HEIGHT, EYE_HEIGHT = 3.0, 5.0  # m above the plane
PIXEL = 1 / 16  # m
CIE_WIDTH, CIE_HEIGHT = 97, 65  # odd: a pixel centre is under the source
POINTS = ((0.0, 0.0), (0.5, 0.0), (0.0, -0.5), (1.0, 0.5), (1.5, 1.5), (-1.5, 1.0), (-1.75, -1.75))  # m
CIE_ROUNDINGS = 60  # of camera ray (20), hit (15), shadow ray vector and its length (10), cosine and falloff (15)
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
        fovy=frontal_fovy(height=CIE_HEIGHT, pixel=PIXEL, distance=EYE_HEIGHT),
        width=CIE_WIDTH,
        height=CIE_HEIGHT,
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
        most_explained=0.06,  # the plane's border passes through pixel centres
        expectations=tuple(
            PixelValue(
                stage=Stage.IRRADIANCE,
                column=CIE_WIDTH // 2 + round(x / PIXEL),
                row=CIE_HEIGHT // 2 - round(y / PIXEL),
                channel=channel,
                value=intensity * SOURCE_HEIGHT / (x * x + y * y + SOURCE_HEIGHT**2) ** 1.5,
                relative=gamma(CIE_ROUNDINGS * EXTENT, precision="float32"),
                because=f"CIE 171:2006, 5.2: I h / d^3; float32: {CIE_ROUNDINGS} roundings, "
                f"times {EXTENT:g} for the hit",
            )
            for x, y in POINTS
            for channel, intensity in enumerate(INTENSITY)
        ),
    )


def cie_isotropic_source() -> Iterator[Case]:
    """Yield the test as published and the same in a generic frame.

    The plane is parallel to the image, and its pixels are 1/16 m wide, so the reported points are pixel centres:
    111.111 lx under the source, 106.637 lx half a metre from there and 60.481 lx at (1.5, 1.5) m. Lumen are stored as
    watts. Source: CIE 171:2006, Test Cases to Assess the Accuracy of Lighting Computer Programs, section 5.2.
    """
    yield measured("as_published", "CIE 171:2006 test 5.2 in its own axes: E = I h / d^3 at known points.", IDENTITY)
    yield measured(
        "turned", "CIE 171:2006 test 5.2 in a generic frame: the same irradiance at the same pixels.", GENERIC
    )


# A light in the centre of a two-sided sphere: every point of the wall has radiance rho I / (pi r^2), exactly.
ALBEDO = (0.8, 0.6, 0.35)
WALL_FLUX = (500.0, 320.0, 640.0)  # W
WALL_CENTER: Vector = (0.3, -0.2, 0.15)  # m, in object space
RADIUS = 1.6  # m, in object space
# Of camera ray (20), root (25), both ways through the matrix (20), shadow ray (10), square (10), rest (15).
WALL_ROUNDINGS = 100
PLACEMENTS: tuple[tuple[str, float, Matrix], ...] = (
    ("as_given", 1.0, IDENTITY),
    ("scaled", 1.75, compose(translation(0.9, -0.6, 0.4), rotation((0.2, 0.9, -0.4), 63), scaling(1.75, 1.75, 1.75))),
    ("mirrored", 1.25, compose(translation(-0.7, 0.5, 0.3), rotation((0.6, 0, 0.8), 44), scaling(1.25, -1.25, 1.25))),
)  # fmt: skip


def integrating_sphere() -> Iterator[Case]:
    """Yield one case per placement of the sphere.

    The wall is everywhere at distance r and meets the light head-on (Ulbricht's sphere without its interreflection;
    Walsh, Photometry, 3rd ed. (1958), chapter 6).
    """
    for name, scale, to_world in PLACEMENTS:
        middle = mapped(to_world, WALL_CENTER)
        radius = scale * RADIUS
        camera = camera_around(
            (middle[0] + 0.2, middle[1] - 0.1, middle[2] + 0.1),
            distance=0.55 * radius, azimuth=-25, elevation=20, width=72, height=64, fovy=95,
        )  # fmt: skip
        sphere = Sphere(albedo=ALBEDO, center=WALL_CENTER, radius=RADIUS, to_world=to_world, two_sided=True)
        scene = Scene(camera=camera, shapes=(sphere,), lights=(PointLight(position=middle, flux=WALL_FLUX),))
        irradiance = 1 / (4 * pi * radius**2)
        yield Case(
            name=f"integrating_sphere/{name}",
            scene=scene,
            stresses="A light in the centre of a two-sided sphere: one radiance over the whole image.",
            covers=covering(scene, "LIT-3", "LIT-4"),
            least_interior=4000,
            expectations=tuple(
                UniformValue(
                    stage=stage,
                    shape=0,
                    channel=channel,
                    value=WALL_FLUX[channel] * irradiance * factor[channel],
                    relative=gamma(WALL_ROUNDINGS, precision="float32"),
                    because=f"Phi / (4 pi r^2), times rho / pi for radiance; float32: {WALL_ROUNDINGS} roundings",
                )
                for stage, factor in (
                    (Stage.IRRADIANCE, (1.0, 1.0, 1.0)),
                    (Stage.RADIANCE, tuple(albedo / pi for albedo in ALBEDO)),
                )
                for channel in range(3)
            ),
        )


# Flux conservation after CIE 171:2006: the flux of a source in a closed room arrives on its six faces.
ROOM_FLUX = (10_000.0, 4_000.0, 1_500.0)  # lm, stored as W; the first channel is the test's
MIDDLE: Vector = (0.0, 0.0, 1.5)  # m
ROOM_PIXEL = 0.05  # m
BACK = 1.25  # m; distance of the camera behind the source, seen from the face
ROOM_ROUNDINGS = (
    80  # of camera ray (20), hit (15), shadow ray (15), cosine and falloff (15), and the slant of the hit (15)
)

# Name, the face's rotation from z = 0 facing +z, its two sizes [m], its distance from the middle [m], image size [px].
FACES: tuple[tuple[str, Vector, float, tuple[float, float], float, tuple[int, int]], ...] = (
    ("floor", (1.0, 0.0, 0.0), 0.0, (4.0, 4.0), 1.5, (96, 80)),
    ("ceiling", (1.0, 0.0, 0.0), 180.0, (4.0, 4.0), 1.5, (96, 80)),
    ("north", (1.0, 0.0, 0.0), 90.0, (4.0, 3.0), 2.0, (80, 60)),
    ("south", (1.0, 0.0, 0.0), -90.0, (4.0, 3.0), 2.0, (80, 60)),
    ("west", (0.0, 1.0, 0.0), 90.0, (3.0, 4.0), 2.0, (80, 60)),
    ("east", (0.0, 1.0, 0.0), -90.0, (3.0, 4.0), 2.0, (80, 60)),
)


def face(axis: Vector, angle: float, sizes: tuple[float, float], distance: float) -> Shape:
    """Return a square that looks at the middle of the room from `distance` [m]."""
    placed = compose(
        translation(*MIDDLE), rotation(axis, angle), translation(0, 0, -distance), scaling(sizes[0], sizes[1], 1)
    )
    return Square(albedo=(0.5, 0.4, 0.6), to_world=placed)


def share(sizes: tuple[float, float], distance: float) -> float:
    """Return the share of the sphere that a rectangle fills, seen from `distance` above its centre."""
    a, b = sizes[0] / 2, sizes[1] / 2
    return 4 * atan(a * b / (distance * sqrt(a * a + b * b + distance * distance))) / (4 * pi)


def midpoint_bound(sizes: tuple[float, float], distance: float) -> float:
    """Return a bound on the midpoint rule's error relative to the flux.

    The rule errs by at most area pixel^2 / 24 (max |E_xx| + max |E_yy|); both derivatives of I h / d^3 are largest in
    the middle, 3 I / h^4 (Davis and Rabinowitz, Methods of Numerical Integration, 1984, section 2.1).
    """
    error = sizes[0] * sizes[1] * ROOM_PIXEL**2 / 24 * 2 * 3 / (4 * pi) / distance**4
    return error / share(sizes, distance)


def flux_conservation() -> Iterator[Case]:
    """Yield one case per face of the room.

    10 000 lm from the centre of a room 4 x 4 x 3 m: 2210.657 on floor and ceiling, 1394.672 on each 4 x 3 m wall, from
    the solid angle of a rectangle seen from above its centre (Gershun, The Light Field, 1939). Every case sees one face
    frontally, so that its pixels are equal squares and their sum is a midpoint rule.
    """
    room = tuple(face(axis, angle, sizes, distance) for _, axis, angle, sizes, distance, _ in FACES)
    source = PointLight(position=MIDDLE, flux=ROOM_FLUX)
    for index, (name, _, _, sizes, distance, (width, height)) in enumerate(FACES):
        matrix = room[index].to_world
        normal = (matrix[0][2], matrix[1][2], matrix[2][2])
        x, y, z = (middle + BACK * component for middle, component in zip(MIDDLE, normal, strict=True))
        camera = Camera(
            eye=(x, y, z),
            target=MIDDLE,
            up=(0.0, 0.0, 1.0) if abs(normal[2]) < 0.5 else (0.0, 1.0, 0.0),
            fovy=frontal_fovy(height=height, pixel=ROOM_PIXEL, distance=BACK + distance),
            width=width,
            height=height,
            near=0.1,
            far=20.0,
        )
        scene = Scene(camera=camera, shapes=room, lights=(source,))
        bound = midpoint_bound(sizes, distance)
        yield Case(
            name=f"flux_conservation/{name}",
            scene=scene,
            stresses=f"The {name} of a closed room receives its solid angle's share of the flux from the middle.",
            covers=covering(scene, "HIT-8", "LIT-2", "LIT-3", "LIT-4"),
            least_interior=4000,
            expectations=tuple(
                Flux(
                    shape=index,
                    face=-1,
                    channel=channel,
                    footprint=ROOM_PIXEL**2,
                    value=flux * share(sizes, distance),
                    relative=bound + gamma(ROOM_ROUNDINGS, precision="float32"),
                    because=f"CIE 171:2006, flux conservation; the midpoint rule's bound {bound:.2g} and "
                    f"{ROOM_ROUNDINGS} float32 roundings",
                )
                for channel, flux in enumerate(ROOM_FLUX)
            ),
        )


# Radiance is invariant along a ray: a camera that moves along its central ray sees the same value there.
ALONG_CENTER: Vector = (0.2, 0.3, -0.1)
ALONG_TILT = compose(translation(*ALONG_CENTER), rotation((0.7, -0.5, 0.4), 23))
ALONG_SQUARE = Square(albedo=(0.75, 0.45, 0.3), to_world=compose(ALONG_TILT, scaling(4.0, 3.5, 1.0)))
SPHERE = Sphere(albedo=(0.3, 0.7, 0.5), center=mapped(ALONG_TILT, (1.1, 0.6, 0.6)), radius=0.5)
LIGHTS = (
    PointLight(position=mapped(ALONG_TILT, (-1.2, 0.8, 2.0)), flux=(300.0, 120.0, 200.0)),
    PointLight(position=mapped(ALONG_TILT, (1.5, -1.0, 2.6)), flux=(90.0, 350.0, 260.0)),
)
ALONG_DISTANCES = ((1.5, 3000), (3.0, 3000), (6.0, 2200), (12.0, 450))  # m, and least interior pixels
ALONG_WIDTH, ALONG_HEIGHT = 73, 57  # odd: a pixel centre is on the central ray
ALONG_ROUNDINGS = 30  # of the shadow rays and their lengths (10), cosines and falloffs (15), sum and radiance (5)


def irradiance(channel: int) -> float:
    """Return E [W/m^2] at the square's centre, summed over the lights."""
    normal = np.subtract(mapped(ALONG_TILT, (0.0, 0.0, 1.0)), ALONG_CENTER)
    total = 0.0
    for light in LIGHTS:
        toward = np.subtract(light.position, ALONG_CENTER)
        squared = float(toward @ toward)
        total += light.flux[channel] * float(normal @ toward) / (4 * pi * squared**1.5)
    return total


def invariance() -> Iterator[Case]:
    """Yield one case per distance of the camera; the expectation is the same in all of them.

    Rays do not interact and lights add, so the value is the sum of two closed forms at every distance of the camera
    (Nicodemus, Radiance, American Journal of Physics 31 (1963), 368).
    """
    for distance, least_interior in ALONG_DISTANCES:
        camera = camera_around(
            ALONG_CENTER,
            distance=distance,
            azimuth=-95,
            elevation=54,
            width=ALONG_WIDTH,
            height=ALONG_HEIGHT,
            fovy=34,
            roll=17,
        )
        scene = Scene(camera=camera, shapes=(ALONG_SQUARE, SPHERE), lights=LIGHTS)
        # A hit that is misplaced by s changes Phi cos / r^2 by (2 + tan) s / r; here tan < 1 and r > 2 m.
        roundings = ALONG_ROUNDINGS + PLACE * 3 * distance / 2
        yield Case(
            name=f"invariance/from_{distance:g}m",
            scene=scene,
            stresses=f"A camera {distance:g} m away on one ray: the central radiance is that of every other distance.",
            covers=covering(scene, "CAM-5", "LIT-2", "LIT-3", "LIT-4", "RAD-5"),
            least_interior=least_interior,
            expectations=tuple(
                PixelValue(
                    stage=Stage.RADIANCE,
                    column=ALONG_WIDTH // 2,
                    row=ALONG_HEIGHT // 2,
                    channel=channel,
                    value=ALONG_SQUARE.albedo[channel] / pi * irradiance(channel),
                    relative=gamma(roundings, precision="float32"),
                    because=f"rho / pi times the sum of Phi cos / (4 pi r^2), without the camera's distance; float32: "
                    f"{ALONG_ROUNDINGS} roundings, and a hit misplaced by {PLACE} roundings of {distance:g} m",
                )
                for channel in range(3)
            ),
        )
