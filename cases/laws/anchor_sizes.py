"""How large the primitives are: each straight ahead, lit from the eye."""

from collections.abc import Iterator
from math import pi

import numpy as np

from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, rotation, scaling
from rayproof.cases.relations import Ask, Relation
from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Shape, Sphere, Square
from rayproof.cases.stages import Stage

AWAY, ALBEDO, FLUX = 4.0, (0.25, 0.5, 0.75), (3000.0, 5000.0, 7000.0)  # m, 1, W
PLACED = compose(rotation((0, 0, 1), 30), scaling(1.5, 1.5, 1.5))


@LAWS.register(
    "anchor_sizes",
    stage=Stage.DISTANCE,
    implicates=("HIT-1", "HIT-3", "HIT-7", "NRM-1", "NRM-2", "XF-1"),
    anchor=True,
    own=True,
)
def anchor_sizes(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look at a sphere, a cube and a square head-on: the central distance is known, and L = albedo Phi / (4 pi^2 t^2).

    Proof: the sphere of radius R begins R before its centre, the cube half its side, the square at it; the light in
    the eye falls in at a right angle. Source: specification, unit primitives.
    """
    del scene
    camera = Camera(
        eye=(0.0, 0.0, AWAY), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=40.0, width=9, height=9, near=0.01,
        far=100.0,
    )  # fmt: skip
    sphere = Sphere(albedo=ALBEDO, to_world=PLACED, radius=0.7)
    solids: tuple[tuple[Shape, float], ...] = (
        (sphere, AWAY - 1.5 * 0.7),
        (Cube(albedo=ALBEDO, to_world=PLACED), AWAY - 1.5 * 0.5),
        (Square(albedo=ALBEDO, to_world=PLACED), AWAY),
    )
    middle = np.zeros((9, 9), dtype=bool)
    middle[4, 4] = True
    for shape, distance in solids:
        light = PointLight(position=camera.eye, flux=FLUX)
        world = Scene(camera=camera, shapes=(shape,), lights=(light,))
        answers = ask(world)
        radiance = np.asarray(FLUX) * ALBEDO / (4 * pi**2 * distance**2)
        for stage, value in ((Stage.DISTANCE, np.array([distance])), (Stage.RADIANCE, radiance)):
            if stage in answers:
                yield Relation(
                    stage=stage,
                    expected=np.broadcast_to(value, answers[stage].shape),
                    measured=answers[stage],
                    scene=world,
                    changed=world,
                    what=f"a {type(shape).__name__.lower()} straight ahead",
                    examined=middle,
                )
