"""Sentinels at edges: outlines and inner edges through pixel centres, where either side is right and nothing else is.

A level square stands before a plane; its border runs exactly through the centres of a frame of pixels. What a pixel
there shows may be the square or the plane, but no third value, however wide the edge class is.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.placement import frontal_fovy
from rayproof.cases.scene import Camera, Mesh, Plane, PointLight, Scene, Square
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.oracle import FullOracle, stages_of
from rayproof.reports.judge.self_test.known_answer import Sentinel, rounded, spoilt_at
from rayproof.reports.results.outcomes import Outcome

PIXEL, HEIGHT = 0.125, 4.0  # m: a pixel's side on the square, and the eye's height above it
SIDE = 0.875  # m; its half is an odd number of half pixels, so that the border meets pixel centres
INNER = (7, 8)  # row, column of a pixel on the diagonal
BORDER = (4, 8)  # row, column of a pixel on the border: its centre is at x = 0.0625, y = 0.4375

# The same square as a mesh of two triangles.
CORNERS = np.array(((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))) * SIDE / 2
HALVES = Mesh(albedo=(0.7, 0.5, 0.3), vertices=CORNERS, faces=np.array(((0, 1, 2), (0, 2, 3))))


def edge_scene(side: float) -> Scene:
    """Return the scene with a square of the given side [m]."""
    return Scene(
        camera=Camera(
            eye=(0.0, 0.0, HEIGHT),
            target=(0.0, 0.0, 0.0),
            up=(0.0, 1.0, 0.0),
            fovy=frontal_fovy(height=16, pixel=PIXEL, distance=HEIGHT),
            width=16,
            height=16,
            near=0.1,
            far=20.0,
        ),
        shapes=(
            Square(albedo=(0.7, 0.5, 0.3), to_world=((side, 0, 0, 0), (0, side, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))),
            Plane(albedo=(0.4, 0.6, 0.8), to_world=((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, -1), (0, 0, 0, 1))),
        ),
        lights=(PointLight(position=(0.3, 0.2, 6.0), flux=(90.0, 70.0, 50.0)),),
    )


EDGE_CASE = Case(
    name="sentinel/edge",
    scene=edge_scene(SIDE),
    stresses="Nothing: its answers are spoiled on purpose.",
    covers=("HIT-7",),
    least_interior=100,
    most_edge=0.25,
)


def edge_sentinels(oracle: FullOracle) -> Iterator[Sentinel]:
    """Yield the sentinels for the oracle's answers to the scene with an edge through pixel centres."""
    stages = stages_of(EDGE_CASE.scene)
    truth = oracle.render(EDGE_CASE.scene, stages)
    good = rounded(truth)

    def sentinel(name: str, ours: StageImages, outcome: Outcome, stage: Stage | None) -> Sentinel:
        return Sentinel(name=name, ours=ours, theirs=truth, outcome=outcome, stage=stage, case=EDGE_CASE)

    yield sentinel("faultless at an edge", good, Outcome.PASS, None)
    for word, side in (("inside", SIDE * (1 - 1e-9)), ("outside", SIDE * (1 + 1e-9))):
        moved = rounded(oracle.render(edge_scene(side), stages))
        yield sentinel(f"an edge seen from {word}", moved, Outcome.PASS, None)
    between = good | {Stage.DISTANCE: spoilt_at(good[Stage.DISTANCE], BORDER, HEIGHT + 0.4)}
    yield sentinel("neither side of an edge", between, Outcome.FAIL, Stage.DISTANCE)
    # Of a program that answers nothing but radiance no earlier stage says what it should be.
    for value in (1e30, 1.001 * float(good[Stage.RADIANCE][(*BORDER, 0)])):
        bare: StageImages = {Stage.RADIANCE: spoilt_at(good[Stage.RADIANCE], BORDER, value)}
        yield sentinel(f"radiance alone, {value:.3g} at an edge", bare, Outcome.FAIL, Stage.RADIANCE)
    halves = replace(EDGE_CASE, scene=replace(EDGE_CASE.scene, shapes=(HALVES, EDGE_CASE.scene.shapes[1])))
    whole = oracle.render(halves.scene, stages)
    image = rounded(whole)[Stage.RADIANCE].copy()
    image[INNER] = 0.0
    yield Sentinel(
        name="a hole between two faces of a mesh, radiance alone",
        ours={Stage.RADIANCE: image},
        theirs=whole,
        outcome=Outcome.FAIL,
        stage=Stage.RADIANCE,
        case=halves,
    )
    missed = good | {Stage.OBJECT: spoilt_at(good[Stage.OBJECT], BORDER, -1.0)}
    yield sentinel("nothing at an edge", missed, Outcome.FAIL, Stage.OBJECT)
