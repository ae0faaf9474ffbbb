"""`Draft`, a random scene before it is finished, and `Draws`, its random numbers, the same on every machine.

Its random numbers never change: they are raw 64-bit words of PCG64, converted by our own arithmetic. NumPy keeps the
words of its bit generators and their seeding from version to version, but not its distributions (NumPy Enhancement
Proposal 19).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from rayproof.cases.placement import compose, mapped, rotation, scaling, translation, vector
from rayproof.cases.scene import (
    PARALLEL,
    Camera,
    Clip,
    Cube,
    Matrix,
    Mesh,
    Plane,
    PointLight,
    Rgb,
    Scene,
    Shading,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
)

T = TypeVar("T")
STEP = 2.0**-53  # between neighbouring uniform numbers


class Draws:
    """A stream of random numbers for one scene, seeded by whole numbers."""

    def __init__(self, *seed: int) -> None:
        self._words = np.random.PCG64(seed)

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """Return a number of [low, high)."""
        return low + (high - low) * (int(self._words.random_raw()) >> 11) * STEP

    def logarithmic(self, low: float, high: float) -> float:
        """Return a number of [low, high), whose logarithm is uniform."""
        return math.exp(self.uniform(math.log(low), math.log(high)))

    def whole(self, low: int, high: int) -> int:
        """Return a whole number from `low` to `high`, both included."""
        return low + int(self.uniform() * (high - low + 1))

    def chance(self, probability: float) -> bool:
        """Return True with the given probability."""
        return self.uniform() < probability

    def choice(self, options: Sequence[T]) -> T:
        """Return one of the options with equal probability."""
        return options[self.whole(0, len(options) - 1)]

    def vector(self, low: float, high: float) -> Vector:
        """Return three numbers of [low, high)."""
        return (self.uniform(low, high), self.uniform(low, high), self.uniform(low, high))

    def direction(self) -> Vector:
        """Return a point of the unit sphere, uniform by area (Archimedes: height and azimuth are)."""
        height, turn = self.uniform(-1, 1), self.uniform(0, 2 * math.pi)
        across = math.sqrt(1 - height * height)
        return (across * math.cos(turn), across * math.sin(turn), height)


SIZES = ((48, 36), (40, 30), (33, 25), (24, 32), (64, 48))  # px
FLUX = 200.0  # W, at some 4 m
TETRAHEDRON = (
    ((0.6, 0.6, 0.6), (0.6, -0.6, -0.6), (-0.6, 0.6, -0.6), (-0.6, -0.6, 0.6)),
    ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)),
)
OCTAHEDRON = (
    ((0.8, 0, 0), (-0.8, 0, 0), (0, 0.8, 0), (0, -0.8, 0), (0, 0, 0.8), (0, 0, -0.8)),
    ((0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)),
)
CELLS = 4  # per side of a sheet


def rgb(draws: Draws, low: float, high: float) -> Rgb:
    """Return a colour of channels from `low` to `high`."""
    return draws.vector(low, high)


def placement(draws: Draws) -> Matrix:
    """Return a motion, turn and even scaling that leaves a unit shape near the origin."""
    size = draws.uniform(0.5, 1.3)
    return compose(
        translation(*draws.vector(-1.3, 1.3)),
        rotation(draws.direction(), draws.uniform(0, 180)),
        scaling(size, size, size),
    )


def sheet(draws: Draws) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a crumpled sheet, facing +z."""
    count = CELLS + 1
    vertices = [
        (x / CELLS - 0.5, y / CELLS - 0.5, draws.uniform(-0.12, 0.12)) for y in range(count) for x in range(count)
    ]
    corners = [y * count + x for y in range(CELLS) for x in range(CELLS)]
    faces = [(c, c + 1, c + count + 1) for c in corners] + [(c, c + count + 1, c + count) for c in corners]
    return np.array(vertices) * (1.6, 1.6, 1.0), np.array(faces)


def shape_of(kind: type[Shape], draws: Draws, to_world: Matrix) -> Shape:
    """Return a shape of a kind, the rest drawn."""
    albedo, two_sided = rgb(draws, 0.2, 0.9), draws.chance(0.35)
    if kind is Sphere:
        about: dict[str, Vector | float] = {}
        if draws.chance(0.4):  # else the unit sphere, which has kernels of its own
            about = {"center": draws.vector(-0.3, 0.3), "radius": draws.uniform(0.4, 0.9)}
        return Sphere(albedo=albedo, two_sided=two_sided, to_world=to_world, **about)  # pyright: ignore[reportArgumentType]
    if kind is Triangle:
        corners = (draws.vector(-1, 1), draws.vector(-1, 1), draws.vector(-1, 1))
        return Triangle(albedo=albedo, two_sided=two_sided, to_world=to_world, vertices=corners)
    if kind is Mesh:
        which = draws.whole(0, 2)
        vertices, faces = map(np.array, (TETRAHEDRON, OCTAHEDRON)[which]) if which < 2 else sheet(draws)
        return Mesh(albedo=albedo, two_sided=two_sided, to_world=to_world, vertices=vertices, faces=faces)
    return kind(albedo=albedo, two_sided=two_sided, to_world=to_world)


@dataclass(kw_only=True)
class Draft:
    """The parts of a scene, which features change in place. Lengths in metres, angles in degrees."""

    draws: Draws
    shapes: list[Shape] = field(default_factory=list)
    lights: list[PointLight] = field(default_factory=list)
    eye: Vector = (0.0, 0.0, 0.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 0.0, 1.0)
    fovy: float = 40.0
    width: int = 48
    height: int = 36
    near: float = 0.05
    far: float = 60.0
    shading: Shading = "inverse_square"
    clip: Clip = "depth"
    scale: float = 1.0
    offset: Vector = (0.0, 0.0, 0.0)

    def any_of(self, *kinds: type[Shape]) -> int:
        """Return the index of a shape of one of the kinds; if there is none, such a shape is added."""
        indices = [index for index, shape in enumerate(self.shapes) if isinstance(shape, kinds)]
        if indices:
            return self.draws.choice(indices)
        self.shapes.append(shape_of(self.draws.choice(kinds), self.draws, placement(self.draws)))
        return len(self.shapes) - 1

    def alter(self, index: int, **changes: object) -> None:
        """Replace fields of a shape."""
        self.shapes[index] = replace(self.shapes[index], **changes)

    def surface_point(self, index: int) -> Vector:
        """Return a point of a shape's surface, as exactly as float64 has it."""
        shape, draws = self.shapes[index], self.draws
        if isinstance(shape, Sphere):
            point = np.asarray(shape.center) + shape.radius * np.asarray(draws.direction())
        elif isinstance(shape, Cube):
            point = np.asarray(draws.vector(-0.5, 0.5))
            point[draws.whole(0, 2)] = draws.choice((-0.5, 0.5))
        elif isinstance(shape, Triangle | Mesh):
            corners = (
                shape.vertices if isinstance(shape, Triangle) else shape.vertices[draws.choice(shape.faces.tolist())]
            )
            first, second = sorted((draws.uniform(), draws.uniform()))
            point = np.array((first, second - first, 1 - second)) @ np.asarray(corners, dtype=np.float64)
        else:
            point = np.array((draws.uniform(-0.5, 0.5), draws.uniform(-0.5, 0.5), 0.0))
        return mapped(shape.to_world, vector(point))

    def inner_point(self, index: int) -> Vector:
        """Return a point well inside a sphere or a cube."""
        shape = self.shapes[index]
        center, size = (shape.center, shape.radius) if isinstance(shape, Sphere) else ((0.0, 0.0, 0.0), 0.5)
        point = np.asarray(center) + 0.5 * size * np.asarray(self.draws.direction())
        return mapped(shape.to_world, vector(point))

    @property
    def distance(self) -> float:
        """Return the distance [m] of the target from the eye."""
        return float(np.linalg.norm(np.subtract(self.target, self.eye)))

    def scene(self) -> Scene:
        """Return the scene, moved and scaled."""
        whole = compose(translation(*self.offset), scaling(self.scale, self.scale, self.scale))
        unmoved = self.scale == 1.0 and self.offset == (0.0, 0.0, 0.0)
        brighter = self.scale**2 if self.shading == "inverse_square" else 1.0
        eye, target = mapped(whole, self.eye), mapped(whole, self.target)
        if eye == target:  # so far away float64 has no place for both
            target = (eye[0] + self.scale, eye[1], eye[2])
        return Scene(
            camera=Camera(
                eye=eye,
                target=target,
                up=upward(eye, target, self.up),
                fovy=self.fovy,
                width=self.width,
                height=self.height,
                near=self.near * self.scale,
                far=max(self.far, 1.01 * self.near) * self.scale,  # a frustum has some depth
            ),
            shapes=tuple(
                shape if unmoved else replace(shape, to_world=compose(whole, shape.to_world)) for shape in self.shapes
            ),
            lights=tuple(
                PointLight(
                    position=mapped(whole, light.position),
                    flux=(light.flux[0] * brighter, light.flux[1] * brighter, light.flux[2] * brighter),
                )
                for light in self.lights
            ),
            shading=self.shading,
            clip=self.clip,
        )


def upward(eye: Vector, target: Vector, up: Vector) -> Vector:
    """Return `up`, or another direction if it is too nearly parallel to the view."""
    forward = np.subtract(target, eye)
    cosine = abs(float(forward @ np.asarray(up))) / float(np.linalg.norm(forward) * np.linalg.norm(up))
    return up if cosine < PARALLEL - 1e-3 else (up[1], up[2], up[0])


def plain_draft(draws: Draws) -> Draft:
    """Return a draft of one to six shapes, some lights, and a camera that looks at one of the shapes."""
    kinds = (Sphere, Cube, Square, Triangle, Mesh)
    draft = Draft(draws=draws)
    for _ in range(draws.whole(1, 5)):
        draft.shapes.append(shape_of(draws.choice(kinds), draws, placement(draws)))
    if draws.chance(0.3):
        tilt = rotation(draws.direction(), draws.uniform(0, 12))
        draft.shapes.insert(draws.whole(0, 1), shape_of(Plane, draws, compose(translation(0, 0, -1.5), tilt)))
    for _ in range(draws.whole(1, 3)):
        away = np.asarray(draws.direction()) * draws.uniform(2.5, 5)
        position = (float(away[0]), float(away[1]), abs(float(away[2])))
        draft.lights.append(PointLight(position=position, flux=rgb(draws, 0.5 * FLUX, 2 * FLUX)))
    outward = np.asarray(draws.direction()) * draws.uniform(3, 7)
    draft.eye = (float(outward[0]), float(outward[1]), abs(float(outward[2])) + 0.2)
    draft.target = mapped(draws.choice(draft.shapes).to_world, (0.0, 0.0, 0.0))
    draft.up = draws.direction()
    draft.fovy = draws.uniform(25, 60)
    draft.width, draft.height = draws.choice(SIZES)
    return draft
