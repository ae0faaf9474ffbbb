"""Families `several_lights` (two to eight) and `simplified` (the lecture's shading, only by the cosine)."""

from collections.abc import Iterator
from math import cos, radians, sin, tan

import numpy as np

from rayproof.cases.case import Case, PixelValue, covering
from rayproof.cases.placement import camera_around, compose, mapped, rotation, scaling, translation
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import SHADINGS, Cube, Mesh, PointLight, Scene, Shape, Sphere, Square, Vector
from rayproof.cases.stages import Stage

# Several lights at once: light adds, a blocked light adds pure black, and a light below the floor adds nothing.
SHAPES: tuple[Shape, ...] = (
    Square(
        albedo=(0.7, 0.6, 0.5),
        to_world=compose(translation(0.1, -0.1, -0.7), rotation((1.0, 0.4, 0.1), 8), scaling(8, 9, 1)),
    ),
    Sphere(albedo=(0.8, 0.5, 0.3), center=(0.7, -0.5, 0.35), radius=0.6),
    Cube(
        albedo=(0.4, 0.5, 0.9),
        to_world=compose(translation(-0.8, 0.4, 0.3), rotation((0.3, -0.5, 0.8), 41), scaling(0.9, 0.7, 1.1)),
    ),
)
PLACES = ((2.3, -1.7, 3.1), (-2.2, -1.1, 2.6), (0.4, 2.4, 3.6), (0.3, -0.4, -2.5))  # m; the last is below the floor
COLORS = ((1.0, 0.25, 0.1), (0.2, 0.9, 0.3), (0.1, 0.3, 0.8), (0.5, 0.6, 0.7))
EIGHT = 8  # lights
POWER = {"inverse_square": 380.0, "simplified": 0.8}  # W, and the light's RGB


def eight() -> Case:
    """Return a case with eight lights around the shapes, enough for a renderer to loop over them."""
    around = tuple((2.4 * cos(0.8 * k), 2.4 * sin(0.8 * k), 2.2 + 0.25 * k) for k in range(EIGHT))
    lights = tuple(
        PointLight(position=place, flux=(90.0 + 15.0 * k, 200.0 - 20.0 * k, 60.0 + 20.0 * (k % 3)))
        for k, place in enumerate(around)
    )
    camera = camera_around((0.0, 0.0, 0.1), distance=6.0, azimuth=-72, elevation=34, width=56, height=42, fovy=40)
    scene = Scene(camera=camera, shapes=SHAPES, lights=lights)
    return Case(
        name="several_lights/eight",
        scene=scene,
        stresses="Eight lights, each of another colour, brightness and height: none may be lost or taken twice.",
        covers=covering(scene),
        least_interior=800,
    )


def several_lights() -> Iterator[Case]:
    """Yield three lights and one below the floor, under both shading models; two in one place; eight."""
    yield eight()
    camera = camera_around((0.0, 0.0, 0.1), distance=6.0, azimuth=-72, elevation=34, width=96, height=72, fovy=40)
    for shading in SHADINGS:
        lights = tuple(
            PointLight(position=place, flux=(POWER[shading] * red, POWER[shading] * green, POWER[shading] * blue))
            for place, (red, green, blue) in zip(PLACES, COLORS, strict=True)
        )
        scene = Scene(camera=camera, shapes=SHAPES, lights=lights, shading=shading)
        yield Case(
            name=f"several_lights/{shading}",
            scene=scene,
            stresses="Overlapping shadows of three coloured lights, and a fourth light that the floor hides.",
            covers=covering(scene, "LIT-3", "LIT-4"),
            least_interior=3500,
        )
    lights = tuple(PointLight(position=PLACES[0], flux=flux) for flux in ((200.0, 0.0, 90.0), (0.0, 300.0, 45.0)))
    scene = Scene(camera=camera, shapes=SHAPES, lights=lights)
    yield Case(
        name="several_lights/in_one_place",
        scene=scene,
        stresses="Two lights in one place, each dark in a channel, add up channel by channel.",
        covers=covering(scene, "LIT-2", "LIT-3", "LIT-4"),
        least_interior=3500,
    )


# The lecture's simplified point light: its RGB as it is, clamped cosine, no falloff, no division by pi.
CENTER: Vector = (-0.2, 0.3, 0.4)
TILT = compose(translation(*CENTER), rotation((-0.4, 1.0, 0.2), 24))
SQUARE = Square(albedo=(0.8, 0.55, 0.3), to_world=compose(TILT, scaling(3.0, 2.4, 1.0)))
OCTAHEDRON = np.array(((0.8, 0, 0), (-0.8, 0, 0), (0, 0.8, 0), (0, -0.8, 0), (0, 0, 0.9), (0, 0, -0.9)))
FACES = np.array(((0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)))
RGB = ((0.9, 0.7, 0.5), (0.6, 0.8, 1.0))
WIDTH, HEIGHT = 81, 65  # odd: a pixel centre is on the central ray
EYE_DISTANCE = 5.0  # m
ROUNDINGS = 25  # of the shadow ray vector and its length (10), cosines and their sum (15)
PLACE = 10  # roundings of the eye's distance: the largest error of the hit's place


def cosines(distance: float) -> Case:
    """Return the case of two lights at `distance` [m], 20 and 50 degrees off the normal."""
    turns = [radians(angle) for angle in (20, 50)]
    places = [
        mapped(TILT, (distance * sin(turn) * 0.6, distance * sin(turn) * -0.8, distance * cos(turn))) for turn in turns
    ]
    camera = camera_around(
        CENTER, distance=EYE_DISTANCE, azimuth=-80, elevation=52, width=WIDTH, height=HEIGHT, fovy=38
    )
    lights = tuple(PointLight(position=place, flux=rgb) for place, rgb in zip(places, RGB, strict=True))
    scene = Scene(camera=camera, shapes=(SQUARE,), lights=lights, shading="simplified")
    return Case(
        name=f"simplified/lights_at_{distance:g}m",
        scene=scene,
        stresses=f"Two lights {distance:g} m away: without falloff their clamped cosines add to more than one.",
        covers=covering(scene, "HIT-8"),
        least_interior=1200,
        expectations=tuple(
            PixelValue(
                stage=Stage.RADIANCE,
                column=WIDTH // 2,
                row=HEIGHT // 2,
                channel=channel,
                value=SQUARE.albedo[channel] * (RGB[0][channel] * cos(turns[0]) + RGB[1][channel] * cos(turns[1])),
                relative=gamma(ROUNDINGS + PLACE * tan(turns[1]) * EYE_DISTANCE / distance, precision="float32"),
                because=f"albedo x RGB x cos, summed; float32: {ROUNDINGS} roundings, and a hit misplaced by {PLACE} "
                f"roundings of {EYE_DISTANCE:g} m counts tan / r",
            )
            for channel in range(3)
        ),
    )  # fmt: skip


def simplified() -> Iterator[Case]:
    """Yield the closed forms at two distances, then shadows and a mesh in this model.

    Two lights may add to more than one; the sum is not clamped. The same closed form holds at every distance.
    """
    yield cosines(1.5)
    yield cosines(6.0)
    floor = Square(
        albedo=(0.6, 0.7, 0.5),
        to_world=compose(translation(0, 0, -1.1), rotation((1.0, -0.3, 0.2), 7), scaling(7, 8, 1)),
    )
    sphere = Sphere(albedo=(0.9, 0.4, 0.4), center=(0.9, 0.6, 0.1), radius=0.6)
    mesh = Mesh(
        albedo=(0.4, 0.5, 0.9),
        vertices=OCTAHEDRON,
        faces=FACES,
        to_world=compose(translation(-0.6, -0.4, 0.1), rotation((1.0, 0.5, 0.3), 33)),
    )
    camera = camera_around((0.1, 0.0, -0.2), distance=6.0, azimuth=-35, elevation=33, width=96, height=72, fovy=40)
    scene = Scene(
        camera=camera,
        shapes=(floor, sphere, mesh),
        lights=(PointLight(position=(1.9, -1.8, 2.9), flux=RGB[0]),),
        shading="simplified",
    )
    yield Case(
        name="simplified/shadows",
        scene=scene,
        stresses="A sphere and an octahedron with their shadows under the simplified light.",
        covers=covering(scene, "HIT-5", "LIT-2", "LIT-3", "LIT-4"),
        least_interior=3500,
    )
