"""The oracle's guard: scenes whose answers anybody can write down, put to the analytic reference before it judges.

Where no other reference can answer (the lecture's simplified light, for one), nobody else could contradict it.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.placement import frontal_fovy
from rayproof.cases.scene import Camera, Plane, PointLight, Scene, Sphere, Square
from rayproof.cases.stages import Stage
from tests.harness.guards import BrokenHarnessError

WIDTH, HEIGHT, PIXEL, DEPTH = 9, 7, 0.25, 4.0  # px, px, and in m: a pixel's side on the floor, the eye's height
SIZE = (HEIGHT, WIDTH)
ALBEDO = (0.5, 0.25, 0.75)
ABOVE = PointLight(position=(0.0, 0.0, 3.0), flux=(70.0, 50.0, 90.0))
ASIDE = PointLight(position=(8.0, 0.0, 4.0), flux=(300.0, 500.0, 400.0))
# Half way from the floor's middle to the light aside, and out of sight: its shadow is twice as large as it is.
BLOCKER = Square(albedo=ALBEDO, to_world=((0.4, 0, 0, 4.0), (0, 0.4, 0, 0), (0, 0, 1, 2.0), (0, 0, 0, 1)))
SHADOW = 0.4  # m, half its side
FLOOR = Scene(
    camera=Camera(
        eye=(0.0, 0.0, DEPTH),
        target=(0.0, 0.0, 0.0),
        up=(0.0, 1.0, 0.0),
        fovy=frontal_fovy(height=HEIGHT, pixel=PIXEL, distance=DEPTH),
        width=WIDTH,
        height=HEIGHT,
        near=0.5,
        far=8.0,
    ),
    shapes=(Plane(albedo=ALBEDO), BLOCKER),
    lights=(ABOVE, ASIDE),
)
CLOSE = 1e-12  # relative to the largest value: a hundred times what float64 needs here, a million below any fault


def guard_oracle(oracle: Any) -> None:
    """Ask the oracle about the known scenes; raise BrokenHarnessError where an answer is another."""
    for shading in ("inverse_square", "simplified"):
        answers = oracle.render(replace(FLOOR, shading=shading), tuple(Stage))
        for stage, known in _floor(simplified=shading == "simplified").items():
            _expect(answers[stage], known, f"{stage} of a floor, {shading}")
        _expect_camera(answers[Stage.CAMERA])
    _guard_clipping(oracle)
    _guard_normals(oracle)


def _grid() -> tuple[np.ndarray, np.ndarray]:
    """Return where on the floor each pixel looks, x and y [m]."""
    row, column = np.mgrid[:HEIGHT, :WIDTH]
    return (column - WIDTH // 2) * PIXEL, (HEIGHT // 2 - row) * PIXEL


def _floor(*, simplified: bool) -> dict[Stage, np.ndarray]:
    """Return the closed forms of every stage of the floor."""
    x, y = _grid()
    zero = np.zeros(SIZE)
    t = np.sqrt(x**2 + y**2 + DEPTH**2)
    free = np.stack([zero == 0, ~((np.abs(x) < SHADOW) & (np.abs(y) < SHADOW))], axis=-1).astype(np.float64)
    arriving = np.zeros((*SIZE, 3))
    for number, light in enumerate(FLOOR.lights):
        place = light.position
        r = np.sqrt((place[0] - x) ** 2 + (place[1] - y) ** 2 + place[2] ** 2)
        share = place[2] / r if simplified else place[2] / (4 * math.pi * r**3)
        arriving += (free[..., number] * share)[..., np.newaxis] * np.asarray(light.flux)
    leaving = arriving * ALBEDO
    return {
        Stage.RAY: np.stack([x / t, y / t, -DEPTH / t], axis=-1),
        Stage.OBJECT: np.stack([zero, zero], axis=-1),
        Stage.DISTANCE: t[..., np.newaxis],
        Stage.POSITION: np.stack([x, y, zero], axis=-1),
        Stage.NORMAL: np.stack([zero, zero, zero + 1], axis=-1),
        Stage.VISIBILITY: free,
        Stage.IRRADIANCE: arriving,
        Stage.EXITANCE: leaving,
        Stage.RADIANCE: leaving if simplified else leaving / math.pi,
    }


def _expect_camera(answer: Any) -> None:
    """Hold the camera's answer against the image's corners and the frustum's."""
    x, y = _grid()
    half_width, half_height = WIDTH * PIXEL / 2, HEIGHT * PIXEL / 2
    _expect(answer["ndc"], np.stack([x / half_width, y / half_height], axis=-1), "ndc")
    corners = [
        (sx * half_width * depth / DEPTH, sy * half_height * depth / DEPTH, DEPTH - depth)
        for depth in (FLOOR.camera.near, FLOOR.camera.far)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    _expect(answer["frustum_corners"], np.array(corners), "frustum corners")
    for corner in corners:
        clip = answer["projection"] @ answer["view"] @ np.array([*corner, 1.0])
        depth = 0.0 if corner[2] == DEPTH - FLOOR.camera.near else 1.0
        _expect(np.abs(clip[:3] / clip[3]), np.array([1.0, 1.0, depth]), "clip coordinates of the frustum's corners")


def _guard_clipping(oracle: Any) -> None:
    """Clip a little beyond the floor's middle: planes keep all of the floor, a shell only what is as near."""
    x, y = _grid()
    near_middle = np.sqrt(x**2 + y**2 + DEPTH**2) < DEPTH + 0.01
    camera = replace(FLOOR.camera, far=DEPTH + 0.01)
    for clip, kept in (("depth", np.ones(SIZE, bool)), ("shell", near_middle), ("none", np.ones(SIZE, bool))):
        found = oracle.render(replace(FLOOR, camera=camera, clip=clip), (Stage.OBJECT,))[Stage.OBJECT]
        _expect(found, np.where(kept, 0.0, -1.0)[..., np.newaxis].repeat(2, axis=-1), f"objects, clip {clip}")


def _guard_normals(oracle: Any) -> None:
    """Look at a mirrored ellipsoid: its points solve its equation, and its normals are the gradient there."""
    axes = np.array((2.0, 1.0, 1.5))
    to_world = ((2.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, -1.5, 0.0), (0.0, 0.0, 0.0, 1.0))
    scene = replace(FLOOR, shapes=(Sphere(albedo=ALBEDO, to_world=to_world),), lights=())
    answers = oracle.render(scene, (Stage.OBJECT, Stage.POSITION, Stage.NORMAL))
    hit = answers[Stage.OBJECT][..., 0] == 0
    points = answers[Stage.POSITION][hit] / axes
    if np.count_nonzero(hit) < SIZE[0]:
        raise BrokenHarnessError("the oracle is broken: it sees no ellipsoid")
    _expect(np.sum(points**2, axis=-1), np.ones(len(points)), "points of an ellipsoid")
    gradient = points / axes
    _expect(answers[Stage.NORMAL][hit], gradient / np.linalg.norm(gradient, axis=-1, keepdims=True), "its normals")
    if np.any(answers[Stage.POSITION][hit][:, 2] < 0):
        raise BrokenHarnessError("the oracle is broken: it sees an ellipsoid's far side")


def _expect(found: np.ndarray, known: np.ndarray, what: str) -> None:
    limit = CLOSE * max(1.0, float(np.abs(known).max()))
    if found.shape != known.shape or not np.all(np.abs(found - known) <= limit):
        raise BrokenHarnessError(f"the oracle is broken: {what} differs from its closed form")
