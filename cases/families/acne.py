"""Family `acne`: contact, long grazing light, the terminator, a light on a surface, layers.

A shadow ray that starts a rounding error below its surface hits that surface. The danger grows with the distance from
the eye and with the slant of the light; a strategy that starts too far away loses the shadow where things touch.
"""

from collections.abc import Iterator

from rayproof.cases.case import Case, PixelValue, covering
from rayproof.cases.placement import camera_around, compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Shape, Sphere, Square
from rayproof.cases.stages import Stage

TILT = compose(translation(0.1, -0.2, -0.4), rotation((1.0, -0.6, 0.3), 11))


def on_the_sphere() -> Case:
    """Return a light exactly where the central ray meets a sphere: dark everywhere, and never a NaN."""
    camera = Camera(
        eye=(0.0, 0.0, 4.0),
        target=(0.0, 0.0, 0.0),
        up=(0.0, 1.0, 0.0),
        fovy=36.0,
        width=65,
        height=57,
        near=0.25,
        far=16.0,
    )
    sphere = Sphere(albedo=(0.6, 0.7, 0.5))
    light = PointLight(position=(0.0, 0.0, 1.0), flux=(300.0, 200.0, 250.0))
    scene = Scene(camera=camera, shapes=(sphere,), lights=(light,))
    return Case(
        name="acne/light_on_the_sphere",
        scene=scene,
        stresses="A light exactly on a sphere, on the central ray: 0 there, not 0 / 0, and below every other horizon.",
        covers=covering(scene),
        least_interior=1000,
        expectations=tuple(
            PixelValue(
                stage=Stage.IRRADIANCE,
                column=column,
                row=row,
                channel=channel,
                value=0.0,
                relative=0.0,
                because="a light on the surface gives nothing there, and stands below the horizon of the rest",
            )
            for column, row in ((32, 28), (40, 28), (32, 18), (22, 34))
            for channel in range(3)
        ),
    )


def on_a_blocker() -> Case:
    """Return a light on the underside of a turned cube: rounding decides whether the cube blocks it."""
    lamp = compose(translation(0.4, -0.3, 1.9), rotation((0.7, -0.4, 0.5), 25), scaling(0.8, 0.7, 0.5))
    x, y, z = (0.1 * row[0] - 0.2 * row[1] - 0.5 * row[2] + row[3] for row in lamp[:3])
    scene = Scene(
        camera=camera_around((0.2, 0.0, 0.6), distance=5.5, azimuth=-50, elevation=-4, width=96, height=72, fovy=36),
        shapes=(
            Sphere(albedo=(0.6, 0.7, 0.5), center=(-0.1, 0.2, 0.0), radius=0.9),
            Cube(albedo=(0.8, 0.4, 0.3), to_world=lamp),
        ),
        lights=(PointLight(position=(x, y, z), flux=(300.0, 200.0, 250.0)),),
    )
    return Case(
        name="acne/light_on_a_blocker",
        scene=scene,
        stresses="A light on a cube's underside: points that face it cannot tell whether the cube blocks it.",
        covers=covering(scene),
        least_interior=600,
        # Every point of the sphere that faces the light.
        most_explained=0.05,
    )


def layered() -> Case:
    """Return two sheets 0.65 mm apart: a renderer whose shadow epsilon is larger lights the lower sheet wrongly.

    Twice the tracer's own bound in float32 is 0.045 mm, twice 16 times the offset that rounding needs is 0.40 mm, and
    twice twenty times that bound is 0.90 mm.
    """
    frame = compose(rotation((0.6, -0.4, 0.5), 7), scaling(3, 3, 1))
    scene = Scene(
        camera=camera_around((0, 0, 0), distance=3.0, azimuth=-50, elevation=65, width=24, height=18, fovy=30),
        shapes=(
            Square(albedo=(0.5, 0.6, 0.7), to_world=frame),
            Square(albedo=(0.7, 0.4, 0.3), to_world=compose(frame, translation(0, 0, -6.5e-4))),
        ),
        lights=(PointLight(position=(0.4, -0.3, 2.2), flux=(300.0, 200.0, 250.0)),),
    )
    return Case(
        name="acne/layered",
        scene=scene,
        stresses="Two sheets so close that whoever leaves more unseen than rounding needs cannot tell one's light.",
        # Strategies against acne other than the default miss more blockers by design.
        covers=tuple(item for item in covering(scene) if item != "LIT-5"),
        least_interior=400,
    )


def acne() -> Iterator[Case]:
    """Yield contact, grazing light, the terminator, a floor seen from afar, lights on surfaces, and layers."""
    floor = Square(albedo=(0.6, 0.55, 0.7), to_world=compose(TILT, scaling(7, 8, 1)))
    resting: tuple[Shape, ...] = (
        floor,
        Sphere(albedo=(0.8, 0.4, 0.3), radius=0.6, to_world=compose(TILT, translation(0.9, -0.6, 0.6))),
        Cube(albedo=(0.4, 0.6, 0.8), to_world=compose(TILT, translation(-0.8, 0.5, 0.5), rotation((0, 0, 1), 28))),
    )
    near = camera_around((0.0, 0.0, 0.0), distance=5.5, azimuth=-50, elevation=36, width=96, height=72, fovy=38)
    far = camera_around((0.0, 0.0, 0.0), distance=60.0, azimuth=-50, elevation=36, width=96, height=72, fovy=3.6)
    grazing = PointLight(position=(3.4, -2.6, 0.45), flux=(420.0, 380.0, 300.0))
    high = PointLight(position=(1.6, -1.4, 3.6), flux=(420.0, 380.0, 300.0))
    alone = Sphere(albedo=(0.7, 0.6, 0.5), center=(0.1, -0.1, 0.2), radius=1.3)
    small = Sphere(albedo=(0.4, 0.6, 0.8), center=(1.6, -1.5, 0.9), radius=0.25)
    side = PointLight(position=(3.1, 1.9, 2.0), flux=(500.0, 450.0, 380.0))
    tilted = Plane(albedo=(0.6, 0.55, 0.7), to_world=TILT)
    questions: tuple[tuple[str, str, Scene, tuple[str, ...], int], ...] = (
        (
            "contact",
            "A sphere and a cube that rest on a floor: their shadows begin where they touch it.",
            Scene(camera=near, shapes=resting, lights=(high,)),
            ("LIT-2", "LIT-4"),
            3000,
        ),
        (
            "grazing",
            "A light a little above a floor: shadow rays that almost run along it, and long shadows.",
            Scene(camera=near, shapes=resting, lights=(grazing,)),
            ("LIT-2", "LIT-4"),
            3000,
        ),
        (
            "terminator",
            "A sphere lit from the side: the terminator crosses the image.",
            Scene(camera=near, shapes=(alone, small), lights=(side,)),
            ("LIT-2", "LIT-4"),
            1500,
        ),
        (
            "from_afar",
            "A plane seen from 60 m: the hit is rounded in units of the distance, the shadow is not.",
            Scene(camera=far, shapes=(tilted, resting[1]), lights=(high,)),
            ("LIT-2", "LIT-4"),
            4000,
        ),
    )
    for name, stresses, scene, more, least_interior in questions:
        yield Case(
            name=f"acne/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, *more),
            least_interior=least_interior,
        )
    yield on_the_sphere()
    yield on_a_blocker()
    yield layered()
