"""Steps that simplify a scene's numbers: placements, defaults, fewer digits.

A shape's matrix is simplified in two ways: by moving only the shape, or by moving everything in the same way, so that
the ray stays the same in the shape's object space.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from rayproof.cases.placement import matrix, vector, world_triangles
from rayproof.cases.scene import IDENTITY, Camera, Matrix, Mesh, PointLight, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reports.shrinking.attempts import Search, Step, digits

DECIMALS = (1, 2, 3, 4, 6)  # significant digits of the largest number of a vector, in the order of the attempts
WHITE = (1.0, 1.0, 1.0)
FAR = 100.0  # m


def plainer_places(search: Search) -> None:
    """Simplify each shape's placement: at the origin, without rotation and scale; also a sphere's centre and radius."""
    for index in range(len(search.scene.shapes)):
        shape = search.scene.shapes[index]
        if isinstance(shape, Triangle | Mesh) and shape.to_world != IDENTITY:
            search.attempt(partial(_baked, search.scene, index))
        for place in _places(search.scene.shapes[index].to_world):
            now = search.scene
            if search.first([partial(_moved, now, index, place), partial(_carried, now, index, place)]):
                break
        shape = search.scene.shapes[index]
        if isinstance(shape, Sphere) and (shape.center, shape.radius) != ((0, 0, 0), 1):
            scale = 2.0 ** -round(math.log2(shape.radius))
            for factor in dict.fromkeys((1 / shape.radius, scale, 1.0)):
                motion = np.diag([factor, factor, factor, 1.0])
                motion[:3, 3] = -factor * np.asarray(shape.center)
                if search.attempt(partial(_in_another_frame, search.scene, motion)):
                    break


def _baked(scene: Scene, index: int) -> Scene:
    shape = scene.shapes[index]
    corners = world_triangles(shape).astype(np.float64)
    if isinstance(shape, Mesh):
        count = 3 * len(corners)
        baked: Shape = replace(
            shape, vertices=corners.reshape(count, 3), faces=np.arange(count).reshape(-1, 3), to_world=IDENTITY
        )
    else:
        assert isinstance(shape, Triangle)
        first, second, third = map(vector, corners[0])
        baked = replace(shape, vertices=(first, second, third), to_world=IDENTITY)
    return _with(scene, index, baked)


def _with(scene: Scene, index: int, shape: Shape) -> Scene:
    return replace(scene, shapes=(*scene.shapes[:index], shape, *scene.shapes[index + 1 :]))


def _places(to_world: Matrix) -> Iterator[Matrix]:
    """Yield simpler matrices, the simplest first."""
    whole = np.asarray(to_world, dtype=np.float64)
    linear, moved = whole[:3, :3], whole[:3, 3]
    lengths = np.linalg.norm(linear, axis=0)
    powers = 2.0 ** np.round(np.log2(lengths))
    middle = 2.0 ** np.round(np.log2(abs(np.linalg.det(linear))) / 3)
    turned = _quarter_turns(linear / lengths)
    linears = [np.eye(3), middle * np.eye(3), np.diag(powers), turned, middle * turned, turned * powers]
    linears += [np.diag(lengths), turned * lengths, _rounded(linear, 1), _rounded(linear, 2), linear]
    moves = (np.zeros(3), _rounded(moved, 1), moved)
    yielded = {to_world}
    for part in linears:
        for move in moves:
            place = matrix(np.block([[part, move[:, np.newaxis]], [np.zeros((1, 3)), np.ones((1, 1))]]))
            if place not in yielded:
                yielded.add(place)
                yield place


def _quarter_turns(linear: np.ndarray) -> np.ndarray:
    """Return the signed permutation of the axes that is closest to a matrix, from its largest entries."""
    left, turned = np.abs(linear), np.zeros((3, 3))
    for _ in range(3):
        row, column = np.unravel_index(int(np.argmax(left)), left.shape)
        turned[row, column] = np.copysign(1.0, linear[row, column])
        left[row, :] = left[:, column] = -1.0
    return turned


def _moved(scene: Scene, index: int, place: Matrix) -> Scene:
    return _with(scene, index, replace(scene.shapes[index], to_world=place))


def _carried(scene: Scene, index: int, place: Matrix) -> Scene:
    old = np.asarray(scene.shapes[index].to_world, dtype=np.float64)
    carried = _in_another_frame(scene, np.asarray(place) @ np.linalg.inv(old))
    return _moved(carried, index, place)


def _in_another_frame(scene: Scene, motion: np.ndarray) -> Scene:
    """Return the scene with everything moved by `motion` (4, 4); spheres and triangles without a matrix get none."""
    linear, camera = motion[:3, :3], scene.camera
    scale = float(np.cbrt(abs(np.linalg.det(linear))))

    def place(point: Any) -> Any:
        return vector((motion @ np.array([*point, 1.0]))[:3])

    def shape(old: Shape) -> Shape:
        if isinstance(old, Triangle) and old.to_world == IDENTITY:
            first, second, third = map(place, old.vertices)
            return replace(old, vertices=(first, second, third))
        if isinstance(old, Sphere) and old.to_world == IDENTITY and np.allclose(linear, scale * np.eye(3)):
            return replace(old, center=place(old.center), radius=old.radius * scale)
        return replace(old, to_world=matrix(motion @ np.asarray(old.to_world)))

    def light(old: PointLight) -> PointLight:
        flux = old.flux if scene.shading == "simplified" else vector(np.asarray(old.flux) * scale**2)
        return replace(old, position=place(old.position), flux=flux)

    moved = replace(
        camera,
        eye=place(camera.eye),
        target=place(camera.target),
        up=vector(linear @ np.asarray(camera.up)),
        near=camera.near * scale,
        far=camera.far * scale,
    )
    return replace(scene, camera=moved, shapes=tuple(map(shape, scene.shapes)), lights=tuple(map(light, scene.lights)))


def defaults(search: Search) -> None:
    """Set the far plane to 100 m; set clipping, shading, sidedness, albedo and flux to defaults, together or each."""

    def plain(scene: Scene) -> Scene:
        shapes = tuple(replace(shape, albedo=WHITE, two_sided=False) for shape in scene.shapes)
        lights = tuple(replace(light, flux=WHITE) for light in scene.lights)
        return replace(scene, shapes=shapes, lights=lights, clip="depth", shading="inverse_square")

    def every(**values: Any) -> Callable[[], Scene]:
        now = search.scene
        return lambda: replace(now, shapes=tuple(replace(shape, **values) for shape in now.shapes))

    search.attempt(partial(_of_camera, search.scene, far=FAR))
    if search.attempt(partial(plain, search.scene)):
        return
    search.attempt(every(albedo=WHITE))
    search.attempt(every(two_sided=False))
    now = search.scene
    search.attempt(lambda: replace(now, lights=tuple(replace(light, flux=WHITE) for light in now.lights)))
    search.attempt(partial(replace, search.scene, clip="depth"))
    search.attempt(partial(replace, search.scene, shading="inverse_square"))


def nearer_target(search: Search) -> None:
    """Move the camera's target to the hit point or one metre ahead, rounded, and its up vector to an axis."""
    scene, camera = search.scene, search.scene.camera
    if camera.width * camera.height == 1 and search.failure.pixels:
        ray = search.failure.truth[Stage.RAY][0, 0]
        points = search.failure.truth[Stage.POSITION][0, 0], np.asarray(camera.eye) + ray
        if np.isfinite(search.failure.truth[Stage.DISTANCE][0, 0, 0]):
            search.first([partial(_looking, scene, rounded, points[0]) for rounded in (1, 2, 3)])
        search.first([partial(_looking, search.scene, rounded, points[1]) for rounded in (1, 2, 3)])
    for up in ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)):
        if search.attempt(partial(_of_camera, search.scene, up=up)):
            break


def _looking(scene: Scene, decimals: int, target: np.ndarray) -> Scene:
    return _of_camera(scene, target=vector(_rounded(target, decimals)))


def _of_camera(scene: Scene, **values: Any) -> Scene:
    return replace(scene, camera=replace(scene.camera, **values))


@dataclass(frozen=True, kw_only=True)
class _Numbers:
    """A group of a scene's numbers, such as a vector, and a function that replaces them."""

    values: np.ndarray
    put: Callable[[Scene, np.ndarray], Scene]
    color: bool = False  # whether the simplest value is white instead of zero


KEPT = ("width", "height", "to_world", "faces", "albedo", "flux")  # fields that have no numbers or their own treatment


def groups(scene: Scene) -> list[_Numbers]:
    """Return the numbers of a scene in groups, mostly vectors."""
    numbers = [
        _field(("camera",), member.name, getattr(scene.camera, member.name))
        for member in fields(Camera)
        if _plain(member)
    ]
    for index, shape in enumerate(scene.shapes):
        numbers += [
            _field(("shapes", index), member.name, getattr(shape, member.name))
            for member in fields(shape)
            if _plain(member)
        ]
        numbers += [_part(index, shape.to_world, np.s_[:3, 3]), _part(index, shape.to_world, np.s_[:3, :3])]
    for index in range(len(scene.lights)):
        numbers.append(_field(("lights", index), "position", scene.lights[index].position))
    colors = [(("shapes", i), "albedo", shape.albedo) for i, shape in enumerate(scene.shapes)]
    colors += [(("lights", i), "flux", light.flux) for i, light in enumerate(scene.lights)]
    return numbers + [_field(*color) for color in colors]


def _plain(member: Any) -> bool:
    return member.name not in KEPT and member.name not in ("two_sided", "file")


def _field(place: tuple[Any, ...], name: str, value: Any) -> _Numbers:
    def put(scene: Scene, values: np.ndarray) -> Scene:
        new: Any = values if isinstance(value, np.ndarray) else _tuples(values)
        if place == ("camera",):
            return _of_camera(scene, **{name: new})
        kind, index = place
        parts = list(getattr(scene, kind))
        parts[index] = replace(parts[index], **{name: new})
        return replace(scene, **{kind: tuple(parts)})

    return _Numbers(values=np.asarray(value, dtype=np.float64), put=put, color=name in ("albedo", "flux"))


def _part(index: int, to_world: Matrix, part: Any) -> _Numbers:
    def put(scene: Scene, values: np.ndarray) -> Scene:
        whole = np.array(scene.shapes[index].to_world, dtype=np.float64)
        whole[part] = values
        return _moved(scene, index, matrix(whole))

    return _Numbers(values=np.asarray(to_world, dtype=np.float64)[part], put=put)


def _tuples(values: np.ndarray) -> Any:
    return tuple(map(_tuples, values)) if values.ndim else float(values)


def _rounded(values: Any, decimals: int) -> np.ndarray:
    """Return numbers rounded to the last place of the largest one, which keeps `decimals` significant digits."""
    array = np.asarray(values, dtype=np.float64)
    largest = float(np.max(np.abs(array), initial=0.0))
    if largest == 0:
        return array
    place = decimals - 1 - math.floor(math.log10(largest))
    # Python rounds correctly to decimal digits; NumPy multiplies by a power of ten, which adds an error.
    return np.array([round(float(number), place) for number in array.ravel()]).reshape(array.shape) + 0.0


def fewer_digits(search: Search) -> None:
    """Round all numbers; then each vector to 0, 1 or few digits; then each number, also to adjacent ones."""
    for decimals in DECIMALS[:4]:
        if search.attempt(partial(_all_rounded, search.scene, decimals)):
            break
    for number in range(len(groups(search.scene))):
        group = groups(search.scene)[number]
        if sum(map(digits, group.values.ravel())) <= group.values.size:
            continue
        values = [np.ones_like(group.values)] if group.values.ndim < 2 else []
        values = values if group.color else [np.zeros_like(group.values), *values]
        values += [_rounded(group.values, decimals) for decimals in DECIMALS]
        search.first([partial(group.put, search.scene, value) for value in values])
    for number in range(len(groups(search.scene))):
        for place in range(groups(search.scene)[number].values.size):
            _plainer_number(search, number, place)


def _all_rounded(scene: Scene, decimals: int) -> Scene:
    for number in range(len(groups(scene))):
        group = groups(scene)[number]
        scene = group.put(scene, _rounded(group.values, decimals))
    return scene


def _plainer_number(search: Search, number: int, place: int) -> None:
    group = groups(search.scene)[number]
    value = group.values.ravel()[place]
    if digits(value) <= 1:
        return
    neighbours = group.values.ravel()[max(0, place - 1) : place + 2]
    candidates = [
        *([] if group.color else [0.0]),
        math.copysign(1.0, value),
        *neighbours,
        *(float(_rounded(value, decimals)) for decimals in (1, 2)),
    ]
    builds = []
    for candidate in dict.fromkeys(candidates):
        changed = group.values.copy()
        changed.flat[place] = candidate
        builds.append(partial(group.put, search.scene, changed))
    search.first(builds)


STEPS: tuple[Step, ...] = (defaults, plainer_places, nearer_target, fewer_digits)
