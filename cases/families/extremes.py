"""Family `extremes`: numbers beyond the ranges of all other families, in few and small images.

Many lights, many shapes, views along the up vector, an eye in an infinite plane, lights in closed solids, albedos of 0
and 1, wide images, and very bright and very dim light. `docs/specification.md` has the table of the suite's ranges. The
mesh with more than 2^16 faces is in the family `faces`.
"""

from collections.abc import Iterator
from math import cos, radians, sin

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Rgb, Scene, Shape, Sphere, Vector

GREY: Rgb = (0.6, 0.55, 0.5)
ORANGE: Rgb = (0.8, 0.4, 0.25)
LIGHTS = 17  # more than 8 and 16
COLUMNS, ROWS = 20, 13  # of shapes: 260, more than 64, 128 and 256
STEEP = 3.0  # degrees between the viewing direction and the up vector
BRIGHT = 4e8  # W
DIM = 3e-10  # W


def _steep_view(eye: Vector, *, upward: bool, turn: float, fovy: float, width: int, height: int) -> Camera:
    """Return a camera that looks `STEEP` degrees off +z, or off -z if not `upward`, with z as its up vector.

    `turn` [degrees] is the azimuth of its viewing direction.
    """
    tilt, turn = radians(STEEP), radians(turn)
    forward = (sin(tilt) * cos(turn), sin(tilt) * sin(turn), cos(tilt) if upward else -cos(tilt))
    x, y, z = (start + 4 * step for start, step in zip(eye, forward, strict=True))
    return Camera(eye=eye, target=(x, y, z), up=(0, 0, 1), fovy=fovy, width=width, height=height, near=0.1, far=50)


def many_lights() -> Case:
    """Return a sphere on a plane below a spiral of lights, each of another colour, seen from above."""
    lights = []
    for number in range(LIGHTS):
        turn, share = 2.4 * number, number / LIGHTS
        place = ((1.2 + 2 * share) * cos(turn), (1.2 + 2 * share) * sin(turn), 2.5 + share)
        lights.append(PointLight(position=place, flux=(20 + 40 * share, 60 - 40 * share, 20 + 10 * (number % 4))))
    shapes = (Plane(albedo=GREY), Sphere(albedo=ORANGE, center=(0.1, 0.05, 0.7), radius=0.6))
    camera = _steep_view((0.1, -0.2, 5.0), upward=False, turn=53, fovy=38, width=41, height=29)
    scene = Scene(camera=camera, shapes=shapes, lights=tuple(lights))
    return Case(
        name="extremes/many_lights",
        scene=scene,
        stresses=f"{LIGHTS} lights, seen in a direction {STEEP:g} degrees from straight down.",
        covers=covering(scene),
        least_interior=1000,
    )


def many_shapes() -> Case:
    """Return rows of spheres, each of another colour, and look from below at the last of them."""
    count = COLUMNS * ROWS
    spheres = []
    for number in range(count):
        column, row = number % COLUMNS, number // COLUMNS
        share = number / count
        place = (0.3 * (column - (COLUMNS - 1) / 2), 0.3 * (row - (ROWS - 1) / 2), 4.0)
        albedo = (0.2 + 0.7 * share, 0.9 - 0.6 * share, 0.25 + 0.1 * (number % 7))
        spheres.append(Sphere(albedo=albedo, center=place, radius=0.13))
    camera = _steep_view((1.7, 1.2, 0.0), upward=True, turn=76, fovy=25, width=34, height=23)
    light = PointLight(position=(2.5, 0.4, 0.4), flux=(420.0, 380.0, 460.0))
    scene = Scene(camera=camera, shapes=tuple(spheres), lights=(light,))
    return Case(
        name="extremes/many_shapes",
        scene=scene,
        stresses=f"{count} shapes, seen in a direction {STEEP:g} degrees from straight up.",
        covers=covering(scene),
        least_interior=300,
    )


def eye_in_a_plane() -> Case:
    """Return a view whose eye and middle row of rays are in an infinite plane: its distance is 0 / 0.

    The plane is between two spheres and two lights, and is visible in no pixel. The lights are so near the eye that the
    plane is far brighter there than behind the near plane: a hit at the eye cannot be explained by rounding.
    """
    shapes = (
        Plane(albedo=GREY, two_sided=True),
        Sphere(albedo=ORANGE, center=(0.5, 0.9, 0.8), radius=0.7),
        Sphere(albedo=GREY, center=(-0.4, 1.0, -0.8), radius=0.7),
    )
    camera = Camera(eye=(0, -3, 0), target=(0, 0, 0), up=(0, 0, 1), fovy=40, width=41, height=31, near=1.0, far=50)
    lights = (
        PointLight(position=(0.1, -3.0, 0.3), flux=(400.0, 350.0, 500.0)),
        PointLight(position=(-0.1, -3.0, -0.3), flux=(350.0, 500.0, 400.0)),
    )
    scene = Scene(camera=camera, shapes=shapes, lights=lights)
    return Case(
        name="extremes/eye_in_a_plane",
        scene=scene,
        stresses="The eye and the rays of the middle row lie in an infinite plane: they miss it.",
        covers=covering(scene),
        least_interior=250,
    )


def lights_in_solids() -> Case:
    """Return a light in a closed sphere and one in a closed cube, which leave the floor and a ball outside dark.

    Albedos are exactly 0 and 1. A third light shows the floor.
    """
    cube = compose(translation(-0.9, 0.3, 0.75), rotation((0.3, 0.5, 1.0), 25), scaling(0.9, 1.0, 0.8))
    shapes = (
        Plane(albedo=(1.0, 0.5, 0.0), two_sided=True),
        Sphere(albedo=(0.0, 1.0, 1.0), center=(0.7, 0.4, 0.9), radius=0.6),
        Cube(albedo=(1.0, 0.0, 1.0), to_world=cube, two_sided=True),
        Sphere(albedo=(1.0, 1.0, 1.0), center=(0.0, -0.9, 0.4), radius=0.3, two_sided=True),
    )
    lights = (
        PointLight(position=(0.75, 0.35, 0.95), flux=(60.0, 50.0, 40.0)),
        PointLight(position=(-0.85, 0.25, 0.8), flux=(40.0, 70.0, 50.0)),
        PointLight(position=(1.8, -2.2, 3.5), flux=(90.0, 80.0, 70.0)),
    )
    camera = Camera(
        eye=(0.2, -4.0, 2.6), target=(0, 0, 0.4), up=(0, 0, 1), fovy=42, width=52, height=39, near=0.1, far=50
    )
    scene = Scene(camera=camera, shapes=shapes, lights=lights, clip="none")
    return Case(
        name="extremes/lights_in_solids",
        scene=scene,
        stresses="Lights in a closed sphere and in a closed cube light nothing outside; albedos are 0 and 1.",
        covers=covering(scene),
        least_interior=1400,
    )


def _wide(name: str, stresses: str, width: int, height: int, fovy: float, flux: float, least_interior: int) -> Case:
    """Return a floor with spheres and a cube from the left border to the right one, under a light of `flux` [W]."""
    row = tuple(
        Sphere(albedo=ORANGE, center=(x, 0.3 * (number % 2), 0.45), radius=0.3 + 0.02 * number)
        for number, x in enumerate((-2.2, -1.3, -0.4, 1.4, 2.2))
    )
    cube = Cube(albedo=GREY, to_world=compose(translation(0.5, 0.1, 0.4), rotation((0.2, 0.1, 1), 33)))
    shapes: tuple[Shape, ...] = (Plane(albedo=GREY), *row, cube)
    camera = Camera(
        eye=(0.1, -4.0, 0.9),
        target=(0.05, 0, 0.42),
        up=(0, 0, 1),
        fovy=fovy,
        width=width,
        height=height,
        near=0.1,
        far=50,
    )
    light = PointLight(position=(0.6, -2.5, 3.0), flux=(flux, 0.8 * flux, 0.9 * flux))
    scene = Scene(camera=camera, shapes=shapes, lights=(light,))
    return Case(
        name=f"extremes/{name}",
        scene=scene,
        stresses=stresses,
        covers=covering(scene),
        least_interior=least_interior,
    )


def extremes() -> Iterator[Case]:
    """Yield cases that each exceed several limits of programs: counts, image sizes, formats, comparisons with 0."""
    yield many_lights()
    yield many_shapes()
    yield eye_in_a_plane()
    yield lights_in_solids()
    yield _wide(
        "wide_and_bright",
        "An image 265 pixels wide, no whole number of tiles, with radiance above 65 504.",
        265,
        31,
        8.0,
        BRIGHT,
        6500,
    )
    yield _wide("very_wide_and_dim", "An image 1063 pixels wide, with irradiance below 1e-9.", 1063, 3, 0.19, DIM, 2500)
