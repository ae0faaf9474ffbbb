"""Nearby problems, which differ from the original problem by no more than rounding: the moved data and their amounts.

An answer is right if it differs by no more than the forward limit from the exact answer to such a problem: mixed
forward-backward stability (Wilkinson, Rounding Errors in Algebraic Processes, 1963; Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., 2002, section 1.5). u is the unit roundoff of the renderer's precision; each datum is
moved by up to 2, 8 and 16 u of the size given here, drawn at random:

    image point of a ray      the ray's own forward limit, in pixels. It shows outlines, shadows' edges, terminators
    eye and target            |eye| + |target - eye|, together: the direction is moved by the image point
    shapes                    the length of their placement's vectors, by a common affine map of the world, and of each
                              number that only one shape has; coincident corners move together, whatever their index,
                              and shapes that share a corner are moved by the same map. So no nearby scene has a crack,
                              and a hole is never explained
    lights                    |position| + |target - eye|
    near and far plane        themselves
    start of a shadow ray     from the hit up to the hit's error along the normal, never below the surface: so shadow
                              acne is never explained. Hit and start decide whether a light is above the horizon, and
                              for half of the points the plane of the face as well, from which corners rounded to
                              float32 turn a triangle's normal
    position of a normal      the hit's own error along its ray: at a cube's edge it may be on the next side
    coinciding surfaces       any of the surfaces within four limits of the first may be hit, in every third problem
    the scene as read         rounded once to the precision, as one problem: far from the origin the scene differs

Declared epsilons (`Declared`) move further data: the start of shadow rays by the shadow epsilon, or blockers within it
are skipped; hits within the ray epsilon of the eye are skipped; shadow rays end earlier by the light epsilon; surfaces
within the tie epsilon coincide; image points move by the edge epsilon, seen from the eye, and by the radius within
which the renderer places its samples.
"""

import hashlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache

import numpy as np

from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import GOLDEN, Camera, Motion, Scene, SceneError, Shape, Vector, scrambled

AMOUNTS = (2.0, 8.0, 16.0)  # units of roundoff: the distances that data are moved
FARTHEST = 8 * AMOUNTS[-1]  # if a pixel does not change even by this amount, no nearby problem explains it
COINCIDING = 4  # limits of distance within which surfaces coincide: the error of each may be two hits' limits
EVERY_TIE = 3  # in every third problem coinciding surfaces are in a different order


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A scene within rounding of the original scene, and the random numbers of its points."""

    scene: Scene
    amount: float  # units of roundoff; 0: the scene itself
    seed: tuple[int, ...]  # of the random numbers of its points

    @property
    def draw(self) -> np.random.Generator:
        """Return a generator of the random numbers of its points, with the same seed each time."""
        return np.random.default_rng(self.seed)

    def drawn(self, pixels: np.ndarray, count: int) -> np.ndarray:
        """Return `count` numbers from [-1, 1) per pixel (n,), (n, count), independent of the other pixels."""
        start = np.random.SeedSequence(self.seed).generate_state(1, np.uint64)[0]
        with np.errstate(over="ignore"):
            own = scrambled(start ^ (pixels.astype(np.uint64) + np.uint64(1)) * GOLDEN)
            bits = scrambled(own[:, np.newaxis] + np.arange(count, dtype=np.uint64) * GOLDEN)
        return (bits >> np.uint64(11)).astype(np.float64) * 2.0**-52 - 1


@dataclass(frozen=True, eq=False)
class Problems:
    """The problems within rounding of a scene, in one precision; equal scenes have equal problems.

    With `baked`, shapes are also turned as by the rounding of their corners in world space.
    """

    scene: Scene
    precision: str
    baked: bool = False

    @cached_property
    def seed(self) -> int:
        """Return a number derived from the scene's content, so that the name of a case does not affect a verdict."""
        return seed_of(self.scene)

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Return the shapes' indices in groups that share a corner to the last bit."""
        return adjoining(self.scene.shapes)

    def itself(self, number: int = 0) -> Problem:
        """Return the original scene as a problem; only its points are moved."""
        return Problem(scene=self.scene, amount=AMOUNTS[-1], seed=(self.seed, 0, number))

    @cached_property
    def moved(self) -> Callable[[float, int], Problem | None]:
        """Return `_problem` with a cache, so that each problem is computed once."""
        return cache(self._problem)

    def _problem(self, amount: float, number: int) -> Problem | None:
        """Return a problem with all data moved by up to `amount` units of roundoff; None if it is no valid scene."""
        seed = (self.seed, int(amount), 1 + number)
        try:
            scene = _moved(self.scene, self.groups, amount * UNIT_ROUNDOFF[self.precision], seed, baked=self.baked)
        except SceneError:
            return None
        return Problem(scene=scene, amount=amount, seed=(*seed, 1))

    def within(self, numbers: range) -> Iterator[Problem]:
        """Yield a problem of each amount for each number."""
        for number in numbers:
            for amount in AMOUNTS:
                if (problem := self.moved(amount, number)) is not None:
                    yield problem

    def as_read(self) -> Problem | None:
        """Return the scene whose numbers are rounded once to the precision; None if it is no valid scene."""
        if self.precision == "float64":
            return None
        try:
            scene = replace(
                self.scene,
                camera=_camera_as_read(self.scene.camera, self.precision),
                shapes=tuple(shape.read_in(self.precision) for shape in self.scene.shapes),
                lights=tuple(
                    replace(light, position=_read(light.position, self.precision)) for light in self.scene.lights
                ),
            )
        except SceneError:
            return None
        return Problem(scene=scene, amount=AMOUNTS[-1], seed=(self.seed, 2))


@lru_cache(maxsize=4)
def problems_of(scene: Scene, precision: str, *, baked: bool) -> Problems:
    """Return the problems within rounding of a scene; cached, since all renderers of one precision share them."""
    return Problems(scene, precision, baked)


def _moved(
    scene: Scene, groups: tuple[tuple[int, ...], ...], amount: float, seed: tuple[int, ...], *, baked: bool
) -> Scene:
    draw = np.random.default_rng(seed)
    camera = scene.camera
    apart = math.dist(camera.target, camera.eye)
    shift = amount * (_length(camera.eye) + apart) * draw.uniform(-1, 1, 3)
    near, far = (end * (1 + amount * float(draw.uniform(-1, 1))) for end in (camera.near, camera.far))
    lights = tuple(
        replace(light, position=_vector(light.position, amount * (_length(light.position) + apart) * off))
        for light, off in zip(scene.lights, draw.uniform(-1, 1, (len(scene.lights), 3)), strict=True)
    )
    shapes = list(scene.shapes)
    for group in groups:
        motion = _motion([scene.shapes[index] for index in group], amount, draw, baked=baked)
        for index in group:
            shapes[index] = scene.shapes[index].moved(motion)
    moved = replace(
        camera, eye=_vector(camera.eye, shift), target=_vector(camera.target, shift), near=near, far=max(near, far)
    )
    return replace(scene, camera=moved, shapes=tuple(shapes), lights=lights)


def _motion(shapes: list[Shape], amount: float, draw: np.random.Generator, *, baked: bool) -> Motion:
    """Return the motion of shapes that share corners, or of a single shape."""
    size, turn = max(shape.extent for shape in shapes), amount
    centers = np.array([np.asarray(shape.to_world)[:3, 3] for shape in shapes])
    if baked:
        # Errors of u |T| at the corners turn a shape by that over its least extent.
        for shape, center in zip(shapes, centers, strict=True):
            least = np.linalg.svd(np.asarray(shape.to_world)[:3, :3], compute_uv=False)[-1]
            turn = max(turn, amount * float(np.linalg.norm(center)) / least)
    return Motion(
        linear=turn * draw.uniform(-1, 1, (3, 3)),
        center=centers.mean(axis=0),
        shift=amount * size * draw.uniform(-1, 1, 3),
        amount=amount,
        size=size,
        draw=draw,
        seed=int(draw.integers(1 << 63)),
    )


def adjoining(shapes: tuple[Shape, ...]) -> tuple[tuple[int, ...], ...]:
    """Return the shapes' indices in groups that share a corner to the last bit, directly or through other shapes."""
    group = list(range(len(shapes)))

    def root(index: int) -> int:
        while group[index] != index:
            index = group[index]
        return index

    owner: dict[bytes, int] = {}
    corners = [(index, shape.corners) for index, shape in enumerate(shapes)]
    if sum(len(places) > 0 for _, places in corners) > 1:
        for index, places in corners:
            for place in {row.tobytes() for row in np.asarray(places, dtype=np.float64) + 0.0}:
                first = owner.setdefault(place, index)
                group[root(index)] = root(first)
    members: dict[int, list[int]] = {}
    for index in range(len(shapes)):
        members.setdefault(root(index), []).append(index)
    return tuple(map(tuple, members.values()))


@lru_cache(maxsize=8)
def seed_of(scene: Scene) -> int:
    """Return 63 bits of a digest of a scene's content, without the case's name."""
    content = hashlib.sha256(repr((scene.camera, scene.lights, scene.shading, scene.clip)).encode())
    for shape in scene.shapes:
        content.update(shape.digest.encode())
    return int.from_bytes(content.digest()[:8], "big") >> 1


def _camera_as_read(camera: Camera, precision: str) -> Camera:
    eye, target, up = (_read(vector, precision) for vector in (camera.eye, camera.target, camera.up))
    return replace(camera, eye=eye, target=target, up=up)


def _read(numbers: Vector, precision: str) -> Vector:
    x, y, z = np.asarray(numbers, dtype=precision).astype(np.float64).tolist()
    return (x, y, z)


def _vector(numbers: Vector, off: np.ndarray) -> Vector:
    x, y, z = (np.asarray(numbers) + off).tolist()
    return (x, y, z)


def _length(numbers: Vector) -> float:
    return math.hypot(*numbers)
