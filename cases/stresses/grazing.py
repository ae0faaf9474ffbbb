"""Rays that all but miss: along a sphere's outline, and almost parallel to a plane."""

from collections.abc import Iterator
from dataclasses import replace
from math import degrees

import numpy as np

from rayproof.cases.scene import Camera, Plane, PointLight, Scene, Sphere, Square, Vector
from rayproof.cases.stresses import HEIGHT, STRESSES, VIEWS, WIDTH

ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(3.0, -2.0, 4.0), flux=(300.0, 200.0, 400.0))
DISTANCE = 8.0  # m
WINDOW = 2.0**-10  # rad: half the image's height, at the outline
SLOPES = (0.03125, 0.0078125, 0.00390625, 0.001953125, 0.0009765625)  # 1: eye's height over distance


def looking(eye: Vector, target: Vector, *, fovy: float) -> Camera:
    """Return a camera from `eye` to `target` [m] with `fovy` degrees and an up that is parallel to no axis."""
    return Camera(
        eye=eye, target=target, up=(0.2, 0.1, 1.0), fovy=fovy, width=WIDTH, height=HEIGHT, near=0.125, far=1024.0
    )


@STRESSES.register("tangent_sphere", slots=("sphere", "sphere_normal"))
def tangent_sphere() -> Iterator[tuple[str, Scene]]:
    """Yield a thin window across the outline of a unit sphere, all rays within 2^-10 rad of it."""
    generator = np.random.default_rng(20260)
    for number, _ in enumerate(VIEWS, start=1):
        outward, sideways = np.linalg.qr(generator.normal(size=(3, 2)))[0].T
        # The tangent point of the cone from the eye: 1/D along the axis, sqrt(1 - 1/D^2) across.
        point = outward / DISTANCE + sideways * np.sqrt(1 - 1 / DISTANCE**2)
        eye, target = (tuple(map(float, place)) for place in (outward * DISTANCE, point))
        camera = looking((eye[0], eye[1], eye[2]), (target[0], target[1], target[2]), fovy=2 * degrees(WINDOW))
        yield f"outline_{number}", Scene(camera=camera, shapes=(Sphere(albedo=ALBEDO),), lights=(LIGHT,))


@STRESSES.register("grazing_plane", slots=("plane", "position"))
def grazing_plane() -> Iterator[tuple[str, Scene]]:
    """Yield the plane z = 0 under ever flatter rays."""
    for slope in SLOPES:
        camera = looking((DISTANCE, 1.0, slope * DISTANCE), (0.0, 0.0, 0.0), fovy=degrees(slope))
        yield f"slope_{slope:g}", Scene(camera=camera, shapes=(Plane(albedo=ALBEDO),), lights=(LIGHT,), clip="none")


@STRESSES.register("grazing_square", slots=("square",))
def grazing_square() -> Iterator[tuple[str, Scene]]:
    """Yield the unit square under ever flatter rays."""
    for name, scene in grazing_plane():
        yield name, replace(scene, shapes=(Square(albedo=ALBEDO, two_sided=True),))
