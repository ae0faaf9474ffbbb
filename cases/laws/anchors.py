"""Laws `anchor_...`: single scenes (floor, sphere, sizes, clip) whose image is known in closed form."""

from collections.abc import Iterator
from dataclasses import replace
from math import pi

import numpy as np

from rayproof.cases.laws.relations import LIGHT, Ask, Relation, with_camera
from rayproof.cases.placement import compose, rotation, scaling
from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Shape, Sphere, Square
from rayproof.cases.stages import Stage

# A light above a floor: the inverse square and the cosine, in every pixel.
HEIGHT, ASIDE, ALBEDO, FLUX = 1.25, (0.4, -0.3), (0.25, 0.5, 0.75), (300.0, 500.0, 700.0)  # m, m, 1, W
FLOOR_CAMERA = Camera(
    eye=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=50.0, width=23, height=15, near=0.1, far=10.0
)


def anchor_floor(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look straight down at a floor under a light: E = Phi h / (4 pi (h^2 + a^2)^1.5), a from the light's foot.

    Proof: cos = h / r and r^2 = h^2 + a^2; pixel (c, r) sees x = D tan(alpha) aspect sx, y = D tan(alpha) sy. In the
    lecture's simplified model E = Phi h / r. Source: CIE 171:2006, test case 5.2; specification, RAD-1 to RAD-4.
    """
    del scene
    floor = Square(albedo=ALBEDO, to_world=((9.0, 0, 0, 0), (0, 9.0, 0, 0), (0, 0, 1.0, 0), (0, 0, 0, 1.0)))
    light = PointLight(position=(*ASIDE, HEIGHT), flux=FLUX)
    world = Scene(camera=FLOOR_CAMERA, shapes=(floor,), lights=(light,))
    tall = FLOOR_CAMERA.eye[2] * np.tan(FLOOR_CAMERA.alpha)
    across = (2 * (np.arange(FLOOR_CAMERA.width) + 0.5) / FLOOR_CAMERA.width - 1) * tall * FLOOR_CAMERA.aspect
    up = (1 - 2 * (np.arange(FLOOR_CAMERA.height) + 0.5) / FLOOR_CAMERA.height) * tall
    x, y = np.meshgrid(across, up)
    r = np.sqrt((x - ASIDE[0]) ** 2 + (y - ASIDE[1]) ** 2 + HEIGHT**2)
    for shading in ("inverse_square", "simplified"):
        physical = shading == "inverse_square"
        spread = HEIGHT / (4 * pi * r**3) if physical else HEIGHT / r
        irradiance = np.asarray(FLUX) * spread[..., np.newaxis]
        exitance = irradiance * ALBEDO
        values = {
            Stage.IRRADIANCE: irradiance,
            Stage.EXITANCE: exitance,
            Stage.RADIANCE: exitance / pi if physical else exitance,
        }
        lit = replace(world, shading=shading)
        answers = ask(lit)
        for stage in LIGHT:
            if stage in answers:
                yield Relation(
                    stage=stage,
                    expected=values[stage],
                    measured=answers[stage],
                    scene=lit,
                    changed=lit,
                    what=f"a floor under a light ({shading})",
                )


# A light in the middle of a sphere lights it evenly.
RADIUS = 2.5  # m


def anchor_sphere(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look about inside a two-sided sphere with a light in its middle: L = albedo Phi / (4 pi^2 R^2) everywhere.

    Proof: every point of the wall is R away from the light and faces it. Source: Ulbricht, Die Bestimmung der mittleren
    räumlichen Lichtintensität (1900), without interreflection; specification, RAD-4.
    """
    del scene
    camera = Camera(
        eye=(0.4, -0.3, 0.5), target=(2.0, 1.0, -1.0), up=(0.0, 0.0, 1.0), fovy=70.0, width=15, height=11, near=0.01,
        far=100.0,
    )  # fmt: skip
    sphere = Sphere(albedo=ALBEDO, radius=RADIUS, two_sided=True)
    world = Scene(camera=camera, shapes=(sphere,), lights=(PointLight(position=(0.0, 0.0, 0.0), flux=FLUX),))
    irradiance = np.asarray(FLUX) / (4 * pi * RADIUS**2)
    exitance = irradiance * ALBEDO
    values = {Stage.IRRADIANCE: irradiance, Stage.EXITANCE: exitance, Stage.RADIANCE: exitance / pi}
    answers = ask(world)
    for stage in LIGHT:
        if stage in answers:
            yield Relation(
                stage=stage,
                expected=np.broadcast_to(values[stage], answers[stage].shape),
                measured=answers[stage],
                scene=world,
                changed=world,
                what="a light in the middle of a sphere",
            )


# How large the primitives are: each straight ahead, lit from the eye.
AWAY, BRIGHT = 4.0, (3000.0, 5000.0, 7000.0)  # m, W
PLACED = compose(rotation((0, 0, 1), 30), scaling(1.5, 1.5, 1.5))


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
        light = PointLight(position=camera.eye, flux=BRIGHT)
        world = Scene(camera=camera, shapes=(shape,), lights=(light,))
        answers = ask(world)
        radiance = np.asarray(BRIGHT) * ALBEDO / (4 * pi**2 * distance**2)
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


# A floor straight below, cut by near and far planes, and by spheres about the eye.
DEPTH = 2.0  # m
CLIP_CAMERA = Camera(
    eye=(0.0, 0.0, DEPTH),
    target=(0.0, 0.0, 0.0),
    up=(0.0, 1.0, 0.0),
    fovy=70.0,
    width=15,
    height=11,
    near=0.1,
    far=10.0,
)
SHARES = (0.9, 0.999, 1.001, 1.15)  # of the floor's depth; no pixel's centre is as far away


def anchor_clip(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Look straight down at a floor and clip it: planes cut all of it or nothing, spheres about the eye a disc.

    Proof: its depth is the same for all rays, and the distance depth / cos with tan = tan(alpha) (aspect sx, sy).
    Source: specification, HIT-2 and E2.
    """
    del scene
    pose = ((90.0, 0.0, 0.0, 0.0), (0.0, 90.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    light = PointLight(position=CLIP_CAMERA.eye, flux=(500.0, 400.0, 300.0))
    whole = Scene(camera=CLIP_CAMERA, shapes=(Square(albedo=(0.5, 0.6, 0.7), to_world=pose),), lights=(light,))
    tall = np.tan(CLIP_CAMERA.alpha)
    across = (2 * (np.arange(CLIP_CAMERA.width) + 0.5) / CLIP_CAMERA.width - 1) * tall * CLIP_CAMERA.aspect
    up = (1 - 2 * (np.arange(CLIP_CAMERA.height) + 0.5) / CLIP_CAMERA.height) * tall
    x, y = np.meshgrid(across, up)
    measures = {"depth": np.full(x.shape, DEPTH), "shell": DEPTH * np.sqrt(1 + x * x + y * y)}
    free = ask(replace(whole, clip="none"))
    for clip, measure in measures.items():
        for share in SHARES:
            plane = share * DEPTH
            for side, cut, seen in (
                ("near", {"near": plane, "far": 50 * DEPTH}, measure > plane),
                ("far", {"near": 0.01 * DEPTH, "far": plane}, measure < plane),
            ):
                changed = with_camera(replace(whole, clip=clip), **cut)
                answers = ask(changed)
                for stage, nothing in ((Stage.OBJECT, -1.0), (Stage.DISTANCE, np.inf), (Stage.RADIANCE, 0.0)):
                    if stage in answers and stage in free:
                        yield Relation(
                            stage=stage,
                            expected=np.where(seen[..., np.newaxis], free[stage], nothing),
                            measured=answers[stage],
                            scene=whole,
                            changed=changed,
                            what=f"{side} ({clip}) at {share:g} of the floor's depth",
                        )
