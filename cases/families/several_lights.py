"""Several lights at once: light adds, a blocked light adds pure black, and a light below the floor adds nothing."""

from collections.abc import Iterator
from math import cos, sin

from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import SHADINGS, Cube, PointLight, Scene, Shape, Sphere, Square

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
    """Return eight lights about the shapes: so many that a renderer may take them in a loop."""
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
        most_edge=0.2,
    )


@CASE_FAMILIES.register("several_lights")
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
            most_edge=0.04,
        )
    lights = tuple(PointLight(position=PLACES[0], flux=flux) for flux in ((200.0, 0.0, 90.0), (0.0, 300.0, 45.0)))
    scene = Scene(camera=camera, shapes=SHAPES, lights=lights)
    yield Case(
        name="several_lights/in_one_place",
        scene=scene,
        stresses="Two lights in one place, each dark in a channel, add up channel by channel.",
        covers=covering(scene, "LIT-2", "LIT-3", "LIT-4"),
        least_interior=3500,
        most_edge=0.03,
    )
