"""Mutants of the camera's frame: which axes are unit vectors and at right angles, its angle, aspect and pixels.

A ray is F + sx tx R + sy ty U with F forward, R right, U up, tx and ty the tangents of half the angles, and (sx, sy)
the pixel in normalised device coordinates (CAM-1 to CAM-4). Each mutant changes one of these.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rayproof.cases.scene import IDENTITY, Camera, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import pixel_centers
from tests.harness.audit.mutants import ORACLE, PREFIX, Mutant, Rows, Step
from tests.harness.audit.mutants.fields import LEAVING, LIGHT, NORMALS, SHADOW_RAYS, STAGES, mutant, words
from tests.harness.audit.mutants.operations import LINEAR, Operation, altered, plain, rounded


@dataclass(frozen=True, kw_only=True)
class Frame:
    """What a ray is made of."""

    forward: np.ndarray  # (3,)
    right: np.ndarray  # (3,)
    up: np.ndarray  # (3,)
    across: float  # tangent of half the horizontal angle
    upward: float  # tangent of half the vertical angle


Axes = Callable[[Camera], Frame]
# The image's coordinates (n, 2) of points (n, 2) [px].
Coordinates = Callable[[Camera, np.ndarray], np.ndarray]


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _whole(vector: np.ndarray) -> np.ndarray:
    return vector


def _frame(
    camera: Camera,
    *,
    forward: Callable[[np.ndarray], np.ndarray] = _unit,
    right: Callable[[np.ndarray], np.ndarray] = _unit,
    given_up: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda up, forward: up,
    up: Callable[[np.ndarray], np.ndarray] = _whole,
) -> Frame:
    """Return the frame of a camera, each of whose axes is made a unit vector or not, `given_up` before it is used."""
    ahead = forward(np.subtract(camera.target, camera.eye))
    aside = right(np.cross(ahead, given_up(np.asarray(camera.up, dtype=np.float64), ahead)))
    tangent = np.tan(camera.alpha)
    return Frame(
        forward=ahead, right=aside, up=up(np.cross(aside, ahead)), across=tangent * camera.aspect, upward=tangent
    )


def _perpendicular(up: np.ndarray, forward: np.ndarray) -> np.ndarray:
    return up - forward * (up @ forward) / (forward @ forward)


def _up_as_given(camera: Camera, *, unit: bool) -> Frame:
    up = np.asarray(camera.up, dtype=np.float64)
    return replace(_frame(camera), up=_unit(up) if unit else up)


def _right_of_given_up_alone(camera: Camera) -> Frame:
    """Return the frame whose right axis is at right angles to `up` and to the z axis, whatever the view is."""
    frame = _frame(camera)
    right = np.cross(frame.forward, (0.0, 0.0, 1.0))
    if not np.linalg.norm(right) > 0:
        return frame
    return replace(frame, right=_unit(right), up=np.cross(_unit(right), frame.forward))


def _transposed(camera: Camera) -> Frame:
    frame = _frame(camera)
    right, up, forward = np.array([frame.right, frame.up, frame.forward]).T
    return replace(frame, right=right, up=up, forward=forward)


def _changed(change: Callable[[Camera, Frame], Frame]) -> Axes:
    return lambda camera: change(camera, _frame(camera))


def _tangents(change: Callable[[Camera, float], tuple[float, float]]) -> Axes:
    """Return the frame whose tangents are made of half the vertical angle [rad]."""

    def frame(camera: Camera) -> Frame:
        across, upward = change(camera, camera.alpha)
        return replace(_frame(camera), across=across, upward=upward)

    return frame


def _of_size(width: Callable[[Camera], float], height: Callable[[Camera], float]) -> Axes:
    """Return the frame whose aspect is that of another image."""
    return _tangents(lambda camera, alpha: (np.tan(alpha) * width(camera) / height(camera), np.tan(alpha)))


def _padded(size: int, multiple: int) -> int:
    return -(-size // multiple) * multiple


FRAMES: Mapping[str, tuple[str, Axes]] = {
    "forward_not_normalised": ("does not make forward a unit vector", lambda c: _frame(c, forward=_whole)),
    "forward_not_normalised_at_last": (
        "makes right and up of a forward that is no unit vector",
        lambda c: replace(_frame(c, forward=_whole), forward=_frame(c).forward),
    ),
    "right_not_normalised": ("does not make right a unit vector", lambda c: _frame(c, right=_whole, up=_unit)),
    "right_and_up_not_normalised": ("makes neither right nor up a unit vector", lambda c: _frame(c, right=_whole)),
    "up_normalised_first": (
        "makes the given up a unit vector",
        lambda c: _frame(c, given_up=lambda up, forward: _unit(up)),
    ),
    "up_perpendicular_first": (
        "turns the given up at right angles to forward",
        lambda c: _frame(c, given_up=_perpendicular),
    ),
    "up_normalised_but_right_not": (
        "makes the given up a unit vector, and right not",
        lambda c: _frame(c, given_up=lambda up, forward: _unit(up), right=_whole, up=_unit),
    ),
    "up_as_given": ("takes the given up, of whatever direction and length", lambda c: _up_as_given(c, unit=False)),
    "up_as_given_normalised": ("takes the given up, made a unit vector", lambda c: _up_as_given(c, unit=True)),
    "up_is_z": ("takes up to be the z axis", _right_of_given_up_alone),
    "forward_negated": ("looks backwards", _changed(lambda c, f: replace(f, forward=-f.forward))),
    "right_negated": ("has right on the left", _changed(lambda c, f: replace(f, right=-f.right))),
    "up_negated": ("has up below", _changed(lambda c, f: replace(f, up=-f.up))),
    "right_and_up_swapped": ("exchanges right and up", _changed(lambda c, f: replace(f, right=f.up, up=f.right))),
    "transposed": ("takes the transposed matrix of axes", _transposed),
    "aspect_ignored": ("takes every image for a square", _of_size(lambda c: 1, lambda c: 1)),
    "aspect_inverted": ("takes height / width for the aspect", _of_size(lambda c: c.height, lambda c: c.width)),
    "aspect_squared": ("takes the aspect twice", _of_size(lambda c: c.width**2, lambda c: c.height**2)),
    "aspect_whole": (
        "divides width by height as whole numbers",
        _of_size(lambda c: max(1, c.width // c.height), lambda c: 1),
    ),
    "aspect_at_least_1": (
        "takes an aspect of 1 at least",
        _of_size(lambda c: max(c.width, c.height), lambda c: c.height),
    ),
    "aspect_of_1_less": (
        "takes (width - 1) / (height - 1)",
        _of_size(lambda c: max(c.width - 1, 1), lambda c: max(c.height - 1, 1)),
    ),
    "aspect_of_an_even_image": (
        "makes width and height even",
        _of_size(lambda c: _padded(c.width, 2), lambda c: _padded(c.height, 2)),
    ),
    "aspect_of_blocks_of_8": (
        "makes width and height multiples of 8",
        _of_size(lambda c: _padded(c.width, 8), lambda c: _padded(c.height, 8)),
    ),
    "fovy_of_the_width": (
        "takes fovy for the horizontal angle",
        _tangents(lambda c, alpha: (np.tan(alpha), np.tan(alpha) / c.aspect)),
    ),
    "fovy_of_the_longer_side": (
        "takes fovy for the angle of the longer side",
        _tangents(lambda c, alpha: (np.tan(alpha) * min(c.aspect, 1), np.tan(alpha) / max(c.aspect, 1))),
    ),
    "fovy_of_the_shorter_side": (
        "takes fovy for the angle of the shorter side",
        _tangents(lambda c, alpha: (np.tan(alpha) * max(c.aspect, 1), np.tan(alpha) / min(c.aspect, 1))),
    ),
    "fovy_not_halved": (
        "takes fovy for half the angle",
        _tangents(lambda c, alpha: (np.tan(2 * alpha) * c.aspect, np.tan(2 * alpha))),
    ),
    "tangent_halved": (
        "halves the tangent, not the angle",
        _tangents(lambda c, alpha: (np.tan(2 * alpha) / 2 * c.aspect, np.tan(2 * alpha) / 2)),
    ),
    "fovy_in_radians": (
        "takes degrees for radians",
        _tangents(lambda c, alpha: (np.tan(c.fovy / 2) * c.aspect, np.tan(c.fovy / 2))),
    ),
    "sine_for_tangent": (
        "takes the sine of the angle",
        _tangents(lambda c, alpha: (np.sin(alpha) * c.aspect, np.sin(alpha))),
    ),
    "angle_for_tangent": ("takes the angle itself", _tangents(lambda c, alpha: (alpha * c.aspect, alpha))),
}


def _centers(camera: Camera, points: np.ndarray) -> np.ndarray:
    return (2 * points / (camera.width, camera.height) - 1) * (1, -1)


def _linear_in_the_angle(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Return coordinates whose angle, and not whose tangent, grows evenly over the image."""
    half = np.arctan(np.tan(camera.alpha) * np.array([camera.aspect, 1.0]))
    return np.tan(_centers(camera, points) * half) / np.tan(half)


PIXELS: Mapping[str, tuple[str, Coordinates]] = {
    "corner": ("samples pixels at their corners", lambda c, p: _centers(c, p - 0.5)),
    "other_corner": ("samples pixels at their right and lower corners", lambda c, p: _centers(c, p + 0.5)),
    "edge_to_edge": (
        "spreads the pixels over width - 1 and height - 1",
        lambda c, p: (2 * (p - 0.5) / (max(c.width - 1, 1), max(c.height - 1, 1)) - 1) * (1, -1),
    ),
    "column_negated": ("mirrors the image", lambda c, p: _centers(c, p) * (-1, 1)),
    "row_negated": ("turns the image upside down", lambda c, p: _centers(c, p) * (1, -1)),
    "swapped": ("exchanges columns and rows", lambda c, p: _centers(c, p[:, ::-1])),
    "sizes_swapped": (
        "divides columns by the height and rows by the width",
        lambda c, p: (2 * p / (c.height, c.width) - 1) * (1, -1),
    ),
    "height_for_both": ("divides columns by the height", lambda c, p: (2 * p / (c.height, c.height) - 1) * (1, -1)),
    "linear_in_the_angle": ("spreads the pixels evenly in the angle", _linear_in_the_angle),
    "rounded_to_8_bits": ("rounds image coordinates to 8 bits", lambda c, p: rounded(8)(_centers(c, p))),
    "rounded_to_11_bits": ("rounds image coordinates to half precision", lambda c, p: rounded(11)(_centers(c, p))),
}

DIRECTIONS: Mapping[str, tuple[str, Callable[[np.ndarray], np.ndarray]]] = {
    "not_normalised": ("does not make rays unit vectors", _whole),
    "negated": ("sends rays backwards", lambda rays: -rays),
    **{
        f"{bits}_bits": (f"rounds rays to {bits} bits", lambda rays, bits=bits: rounded(bits)(_units(rays)))
        for bits in (8, 11, 16)
    },
}


def _units(rays: np.ndarray) -> np.ndarray:
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _rays(
    scene: Scene,
    _rows: Rows,
    *,
    axes: Axes = _frame,
    coordinates: Coordinates = _centers,
    finished: Callable[[np.ndarray], np.ndarray] = _units,
) -> np.ndarray:
    """Return the rays of all pixels by a wrong frame, wrong image coordinates, or wrong at the end."""
    camera = scene.camera
    frame, (sx, sy) = axes(camera), coordinates(camera, pixel_centers(camera)).T[:, :, np.newaxis]
    return finished(frame.forward + sx * frame.across * frame.right + sy * frame.upward * frame.up)


def mutants() -> Iterator[Mutant]:
    """Yield the mutants of axes, angles and sizes, of image coordinates, and of finished rays."""
    for rule, (what, axes) in FRAMES.items():
        yield _mutant("camera.frame", rule, what, lambda scene, rows, axes=axes: _rays(scene, rows, axes=axes))
    for rule, (what, at) in PIXELS.items():
        yield _mutant("camera.pixel", rule, what, lambda scene, rows, at=at: _rays(scene, rows, coordinates=at))
    for rule, (what, finished) in DIRECTIONS.items():
        yield _mutant(
            "camera.ray", rule, what, lambda scene, rows, finished=finished: _rays(scene, rows, finished=finished)
        )


def _mutant(field: str, rule: str, what: str, step: Step) -> Mutant:
    steps = {Stage.RAY: step}
    return Mutant(name=f"{PREFIX}{field}/{rule}", field=field, what=what, steps=lambda _: steps)


# Mutants of the space: a point, direction or light in object space where the formula is one of world space.
#
# They change what no field of the scene holds, shape by shape: the rows that a stage reads, or the matrix by which an
# object normal becomes a world normal (XF-1, XF-2, NRM-3).


def _by_shape(
    stage: Stage, use: Callable[[Scene, Rows, int], tuple[Scene, Rows]], scene: Scene, rows: Rows
) -> np.ndarray:
    """Return a stage whose scene and rows are changed shape by shape, for the pixels that show it."""
    answer = ORACLE.continued(scene, stage, rows).copy()
    for index in range(len(scene.shapes)):
        here = rows[Stage.OBJECT][:, 0] == index
        if here.any():
            changed, those = use(scene, {name: row[here] for name, row in rows.items()}, index)
            answer[here] = ORACLE.continued(changed, stage, those)
    return answer


def _linear_and_offset(scene: Scene, index: int) -> tuple[np.ndarray, np.ndarray]:
    matrix = np.asarray(scene.shapes[index].to_world)
    return matrix[:3, :3], matrix[:3, 3]


def _to_object(scene: Scene, points: np.ndarray, index: int) -> np.ndarray:
    """Return points (n, 3) in a shape's object space."""
    linear, offset = _linear_and_offset(scene, index)
    return (points - offset) @ np.linalg.inv(linear).T


def _points_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    return scene, {**rows, Stage.POSITION: _to_object(scene, rows[Stage.POSITION], index)}


def _rays_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    linear, _ = _linear_and_offset(scene, index)
    return scene, {**rows, Stage.RAY: rows[Stage.RAY] @ np.linalg.inv(linear).T}


def _shape_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    """Return everything in object space but the ray: of a two-sided shape the normal turns by a mixture of both."""
    unplaced = altered(scene.shapes[index], to_world=IDENTITY)
    shapes = (*scene.shapes[:index], unplaced, *scene.shapes[index + 1 :])
    return altered(scene, shapes=shapes), _points_in_object_space(scene, rows, index)[1]


def _lights_in_object_space(scene: Scene, rows: Rows, index: int) -> tuple[Scene, Rows]:
    places = _to_object(scene, np.array([light.position for light in scene.lights]).reshape(-1, 3), index)
    lights = tuple(altered(light, position=plain(place)) for light, place in zip(scene.lights, places, strict=True))
    return altered(scene, lights=lights), rows


def _distances_in_object_space(scene: Scene, rows: Rows) -> np.ndarray:
    """Return distances along directions that were made unit vectors again in object space."""
    answer = rows[Stage.DISTANCE].copy()
    for index in range(len(scene.shapes)):
        here = rows[Stage.OBJECT][:, 0] == index
        stretched = rows[Stage.RAY][here] @ np.linalg.inv(_linear_and_offset(scene, index)[0]).T
        answer[here] *= np.linalg.norm(stretched, axis=1, keepdims=True)
    return answer


def mutants_in_space() -> Iterator[Mutant]:
    """Yield the mutants that use a point, direction or light in object space, and those of world normals."""
    uses = {
        "hit.position": (_points_in_object_space, (NORMALS, SHADOW_RAYS, LIGHT)),
        "hit.ray": (_rays_in_object_space, (NORMALS, LEAVING)),
        "hit.normal": (_shape_in_object_space, (NORMALS,)),
        "light.position": (_lights_in_object_space, (SHADOW_RAYS, LIGHT)),
    }
    for field, (use, places) in uses.items():
        for place in places:
            (stage,) = STAGES[place]
            steps = {stage: partial(_by_shape, stage, use)}
            what = f"takes {field} in object space for {place}"
            yield mutant(field, f"in_object_space/{place}", what, lambda _, steps=steps: steps)
    distances: dict[Stage, Step] = {Stage.DISTANCE: _distances_in_object_space}
    yield mutant("hit.distance", "in_object_space", "measures distances in object space", lambda _: distances)
    yield from _normals()


def _normals() -> Iterator[Mutant]:
    """Yield the mutants that take normals to world space by another matrix, or do not make them unit vectors."""
    for rule, operation in LINEAR.items():
        by = lambda linear, operation=operation: np.linalg.inv(operation(linear)).T  # noqa: E731
        yield _normal(rule, f"takes normals to world space by a matrix that is {words(rule)}", by, unit=True)
    yield _normal("not_normalised", "does not make world normals unit vectors", lambda linear: np.linalg.inv(linear).T)
    yield _normal("negated", "turns every normal round", lambda linear: -np.linalg.inv(linear).T, unit=True)


def _normal(rule: str, what: str, by: Operation, *, unit: bool = False) -> Mutant:
    """Return the mutant whose world normal is `by` of the model matrix's 3x3 part times the object normal."""

    def step(scene: Scene, rows: Rows) -> np.ndarray:
        answer = ORACLE.continued(scene, Stage.NORMAL, rows).copy()
        for index in range(len(scene.shapes)):
            here = rows[Stage.OBJECT][:, 0] == index
            linear, _ = _linear_and_offset(scene, index)
            local = answer[here] @ linear  # M^T n, along the object normal
            local /= np.linalg.norm(local, axis=1, keepdims=True)
            world = local @ by(linear).T
            answer[here] = world / np.linalg.norm(world, axis=1, keepdims=True) if unit else world
        return answer

    steps: dict[Stage, Step] = {Stage.NORMAL: step}
    return mutant("hit.normal", rule, what, lambda _: steps)
