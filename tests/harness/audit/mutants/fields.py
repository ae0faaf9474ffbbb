"""Mutants of fields: the oracle with one field of the scene changed, everywhere or at one place of use.

`FIELDS` says where each field is used and by which rules it is changed; `OTHERS` are changes of one field alone, and of
the lists of shapes and lights.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from rayproof.cases.scene import Mesh, Scene, Shape, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import pixel_centers, view_of
from tests.harness.audit.mutants import ORACLE, PREFIX, Mutant, Step, hits
from tests.harness.audit.mutants.operations import COLOUR, MATRIX, NUMBER, POINT, Operation, altered, clamped, plain

Change = Callable[[Scene], Scene]
# Where a field is used: the words of the table, and the stages there.
FRAME, HITS, POINTS, NORMALS = "frame", "hits", "points", "normals"
SHADOW_RAYS, LIGHT, EXITANCE, LEAVING = "shadow_rays", "light", "exitance", "leaving"
STAGES: Mapping[str, tuple[Stage, ...]] = {
    FRAME: (Stage.RAY,),
    HITS: (Stage.OBJECT, Stage.DISTANCE),
    POINTS: (Stage.POSITION,),
    NORMALS: (Stage.NORMAL,),
    SHADOW_RAYS: (Stage.VISIBILITY,),
    LIGHT: (Stage.IRRADIANCE,),
    EXITANCE: (Stage.EXITANCE,),
    LEAVING: (Stage.RADIANCE,),
}
GEOMETRY = (HITS, NORMALS, SHADOW_RAYS)


@dataclass(frozen=True, kw_only=True)
class Field:
    """A field of the scene, where it is used, and by which rules it is changed everywhere, and at one place alone."""

    part: str  # "camera", "shapes" or "lights"
    attribute: str
    places: tuple[str, ...]
    rules: Mapping[str, Operation]
    at_one_place: tuple[str, ...] = ()  # names of rules
    kind: type[Any] = object  # of the parts that have it

    @property
    def name(self) -> str:
        """Return such as "light.position" or "sphere.radius"."""
        owner = {"camera": "camera", "lights": "light", "shapes": "shape"}[self.part]
        return f"{owner if self.kind is object else self.kind.__name__.lower()}.{self.attribute}"


PLACED = (
    "ignored",
    "inverse",
    "linear_transposed",
    "linear_inverse_transposed",
    "linear_not_mirrored",
    "linear_scale_even",
    "translation_ignored",
    "moved_first",
    "of_the_next",
)
SOME = ("ignored", "negated", "x_y_swapped", "normalised", "of_the_next")
FIELDS = (
    Field(part="camera", attribute="eye", places=(FRAME, HITS, POINTS), rules=POINT, at_one_place=SOME[:4]),
    Field(part="camera", attribute="target", places=(FRAME,), rules=POINT),
    Field(part="camera", attribute="up", places=(FRAME,), rules=POINT),
    Field(
        part="camera",
        attribute="fovy",
        places=(FRAME,),
        rules={**NUMBER, "clamped_to_20_90": clamped(20, 90), "doubled": lambda fovy: fovy * 2},
    ),
    Field(
        part="camera",
        attribute="near",
        places=(HITS,),
        rules={**NUMBER, "ignored": np.zeros_like, "doubled": lambda near: near * 2, "clamped": clamped(0.01, 1)},
    ),
    Field(
        part="camera",
        attribute="far",
        places=(HITS,),
        rules={
            **NUMBER,
            "ignored": lambda far: np.full_like(far, np.inf),
            "halved": lambda far: far / 2,
            "clamped": clamped(0, 100),
        },
    ),
    Field(part="shapes", attribute="albedo", places=(EXITANCE,), rules=COLOUR),
    Field(part="shapes", attribute="to_world", places=GEOMETRY, rules=MATRIX, at_one_place=PLACED),
    Field(part="shapes", attribute="center", places=GEOMETRY, rules=POINT, at_one_place=SOME, kind=Sphere),
    Field(
        part="shapes",
        attribute="radius",
        places=GEOMETRY,
        rules={**NUMBER, "ignored": np.ones_like, "clamped": clamped(0.1, 10)},
        at_one_place=("ignored", "inverted", "of_the_next"),
        kind=Sphere,
    ),
    Field(part="shapes", attribute="vertices", places=GEOMETRY, rules=POINT, at_one_place=SOME, kind=Triangle),
    Field(part="shapes", attribute="vertices", places=GEOMETRY, rules=POINT, at_one_place=SOME[1:4], kind=Mesh),
    Field(part="lights", attribute="position", places=(SHADOW_RAYS, LIGHT), rules=POINT, at_one_place=SOME),
    Field(part="lights", attribute="flux", places=(LIGHT,), rules=COLOUR),
)
NEIGHBOURS: Mapping[str, int] = {"of_the_next": 1, "of_the_first": 0}  # 0: not the neighbour's, always the first one's


def mutants() -> Iterator[Mutant]:
    """Yield the mutants of all fields, and of the lists of shapes and lights."""
    for field in FIELDS:
        for rule, change in _changes(field).items():
            yield _everywhere(field, rule, change)
            if len(field.places) > 1 and rule in field.at_one_place:
                yield from (_at(field, rule, change, place) for place in field.places)
    for name, (places, change) in OTHERS.items():
        field, _, rule = name.partition("/")
        yield mutant(field, rule, f"takes {field} {words(rule)}", partial(_steps, change, places))


def words(rule: str) -> str:
    """Return a rule's name as words of a sentence."""
    return rule.replace("_", " ")


def mutant(field: str, rule: str, what: str, steps: Callable[[Scene], Mapping[Stage, Step]]) -> Mutant:
    """Return the mutant of a rule, and a place after it where the rule holds at one place alone."""
    return Mutant(name=f"{PREFIX}{field}/{rule}", field=field, what=what, steps=steps)


def _everywhere(field: Field, rule: str, change: Change) -> Mutant:
    what = f"takes {field.name} {words(rule)}"
    return mutant(field.name, rule, what, partial(_steps, change, field.places))


def _at(field: Field, rule: str, change: Change, place: str) -> Mutant:
    what = f"takes {field.name} {words(rule)} for {place} alone"
    return mutant(field.name, f"{rule}/{place}", what, partial(_steps, change, (place,)))


def _steps(change: Change, places: Sequence[str], scene: Scene) -> dict[Stage, Step]:
    """Return the stages of some places on the changed scene; none where it is the same."""
    changed = change(scene)
    if changed == scene:
        return {}
    return {stage: _on(changed, stage) for place in places for stage in STAGES[place] if stage is not Stage.DISTANCE}


def _on(changed: Scene, stage: Stage) -> Step:
    """Return a stage's step on another scene than the one that it is asked about."""
    if stage is Stage.RAY:
        return lambda scene, _: directions(changed, scene)
    if stage is Stage.OBJECT:
        return lambda _, rows: hits(changed, rows)
    return lambda _, rows: ORACLE.continued(changed, stage, rows)


def directions(changed: Scene, scene: Scene) -> np.ndarray:
    """Return the unit directions through the pixels of one scene by the camera of another."""
    found = view_of(changed.camera).directions(pixel_centers(scene.camera))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def _changes(field: Field) -> dict[str, Change]:
    """Return a field's rules as changes of scenes: those of its value, and those that take another part's."""
    changes = {
        rule: partial(_changed, field, lambda value, _, rule=rule: field.rules[rule](value)) for rule in field.rules
    }
    if field.part != "camera":
        for rule, step in NEIGHBOURS.items():
            changes[rule] = partial(_taken_from_another, field, step)
    return changes


def _value(field: Field, part: Any) -> np.ndarray:
    return np.asarray(getattr(part, field.attribute), dtype=np.float64)


def _with(field: Field, part: Any, value: np.ndarray) -> Any:
    """Return a part of the scene with another value of the field."""
    if field.attribute == "vertices":  # they are float32 numbers whatever was computed
        value = value.astype(np.float32)
        return altered(part, vertices=value if isinstance(part, Mesh) else plain(value.astype(np.float64)))
    return altered(part, **{field.attribute: plain(value)})


def _parts(field: Field, scene: Scene) -> list[Any]:
    return [scene.camera] if field.part == "camera" else list(getattr(scene, field.part))


def _put(field: Field, scene: Scene, parts: Sequence[Any]) -> Scene:
    return altered(scene, **{field.part: parts[0] if field.part == "camera" else tuple(parts)})


def _changed(field: Field, operation: Callable[[np.ndarray, int], np.ndarray], scene: Scene) -> Scene:
    """Return the scene with the field changed in every part that has it."""
    parts = _parts(field, scene)
    for index, part in enumerate(parts):
        if isinstance(part, field.kind):
            parts[index] = _with(field, part, operation(_value(field, part), index))
    return _put(field, scene, parts)


def _taken_from_another(field: Field, step: int, scene: Scene) -> Scene:
    """Return the scene in which every part has the field's value of the next one that has it, or of the first."""
    parts = _parts(field, scene)
    owners = [index for index, part in enumerate(parts) if isinstance(part, field.kind)]
    values = [_value(field, parts[index]) for index in owners]
    for place, index in enumerate(owners):
        other = values[(place + 1) % len(owners) if step else 0]
        if field.kind is not Mesh or len(other) == len(values[place]):  # the faces' indices must stay valid
            parts[index] = _with(field, parts[index], other)
    return _put(field, scene, parts)


def _each_shape(change: Callable[[Shape], Shape]) -> Change:
    return lambda scene: altered(scene, shapes=tuple(change(shape) for shape in scene.shapes))


def _each_mesh(change: Callable[[np.ndarray], np.ndarray]) -> Change:
    return _each_shape(lambda shape: replace(shape, faces=change(shape.faces)) if isinstance(shape, Mesh) else shape)


def _each_triangle(order: Sequence[int]) -> Change:
    return _each_shape(
        lambda shape: (
            altered(shape, vertices=tuple(shape.vertices[corner] for corner in order))
            if isinstance(shape, Triangle)
            else shape
        )
    )


def _two_sided(of_another: Callable[[Sequence[Shape], int], bool]) -> Change:
    return lambda scene: altered(
        scene,
        shapes=tuple(altered(shape, two_sided=of_another(scene.shapes, at)) for at, shape in enumerate(scene.shapes)),
    )


def _without_flux(chosen: Callable[[int, int], bool]) -> Change:
    """Return the change that lets some of so many lights bring nothing."""
    return lambda scene: altered(
        scene,
        lights=tuple(
            altered(light, flux=(0.0, 0.0, 0.0)) if chosen(at, len(scene.lights)) else light
            for at, light in enumerate(scene.lights)
        ),
    )


def _brighter_by_their_number(scene: Scene) -> Scene:
    """Return the scene whose lights share their flux, as a mean over lights would."""
    count = len(scene.lights)
    return altered(
        scene, lights=tuple(altered(light, flux=tuple(part / count for part in light.flux)) for light in scene.lights)
    )


OTHERS: Mapping[str, tuple[tuple[str, ...], Change]] = {
    "camera.near/swapped_with_far": (
        (HITS,),
        lambda scene: altered(scene, camera=altered(scene.camera, near=scene.camera.far, far=scene.camera.near)),
    ),
    "triangle.vertices/rolled_corners": (GEOMETRY, _each_triangle((1, 2, 0))),
    "triangle.vertices/reversed": (GEOMETRY, _each_triangle((2, 1, 0))),
    "triangle.vertices/first_twice": (GEOMETRY, _each_triangle((0, 0, 2))),
    "mesh.faces/rolled_corners": (GEOMETRY, _each_mesh(lambda faces: np.roll(faces, 1, axis=1))),
    "mesh.faces/reversed": (GEOMETRY, _each_mesh(lambda faces: faces[:, ::-1])),
    "mesh.faces/last_dropped": (GEOMETRY, _each_mesh(lambda faces: faces[: max(1, len(faces) - 1)])),
    "mesh.faces/from_one": (GEOMETRY, _each_mesh(lambda faces: np.maximum(faces - 1, 0))),
    "mesh.faces/of_8_bits": (GEOMETRY, _each_mesh(lambda faces: faces % 256)),
    "mesh.faces/of_15_bits": (GEOMETRY, _each_mesh(lambda faces: faces % 32768)),
    "mesh.faces/first_corner_twice": (GEOMETRY, _each_mesh(lambda faces: faces[:, [0, 0, 2]])),
    "shape.two_sided/ignored": ((NORMALS,), _two_sided(lambda shapes, at: False)),
    "shape.two_sided/always": ((NORMALS,), _two_sided(lambda shapes, at: True)),
    "shape.two_sided/negated": ((NORMALS,), _two_sided(lambda shapes, at: not shapes[at].two_sided)),
    "shape.two_sided/of_the_next": (
        (NORMALS,),
        _two_sided(lambda shapes, at: shapes[(at + 1) % len(shapes)].two_sided),
    ),
    "shape.two_sided/of_the_first": ((NORMALS,), _two_sided(lambda shapes, at: shapes[0].two_sided)),
    "scene.shading/inverse_square": ((LIGHT, LEAVING), lambda scene: altered(scene, shading="inverse_square")),
    "scene.shading/simplified": ((LIGHT, LEAVING), lambda scene: altered(scene, shading="simplified")),
    "scene.shading/inverse_square_light": ((LIGHT,), lambda scene: altered(scene, shading="inverse_square")),
    "scene.shading/inverse_square_leaving": ((LEAVING,), lambda scene: altered(scene, shading="inverse_square")),
    "scene.clip/depth": ((HITS,), lambda scene: altered(scene, clip="depth")),
    "scene.clip/shell": ((HITS,), lambda scene: altered(scene, clip="shell")),
    "scene.clip/none": ((HITS,), lambda scene: altered(scene, clip="none")),
    "scene.shapes/last_dropped": ((HITS, SHADOW_RAYS), lambda scene: altered(scene, shapes=scene.shapes[:-1])),
    "scene.shapes/last_blocks_nothing": ((SHADOW_RAYS,), lambda scene: altered(scene, shapes=scene.shapes[:-1])),
    "scene.shapes/nothing_blocks": ((SHADOW_RAYS,), lambda scene: altered(scene, shapes=())),
    "scene.lights/last_dropped": ((LIGHT,), _without_flux(lambda at, count: at == count - 1)),
    "scene.lights/first_alone": ((LIGHT,), _without_flux(lambda at, count: at > 0)),
    "scene.lights/four_alone": ((LIGHT,), _without_flux(lambda at, count: at > 3)),
    "scene.lights/mean_for_sum": ((LIGHT,), _brighter_by_their_number),
}
