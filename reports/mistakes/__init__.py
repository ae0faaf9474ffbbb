"""`MISTAKES`: known mistakes of ray tracers, each the oracle with one wrong step.

To add a mistake, write a subclass of `Mistake` that overrides one method of `reference.analytic.Analytic`, and register
it with `known`: its name, a verb phrase that describes such a renderer, and the items of the specification that it
breaks. The mistake then applies to all computations of the oracle: whole images, nearby problems, and stages continued
from a renderer's own. A `Family` has parameters that are fitted to a renderer's images.

`together` combines two mistakes into a class that inherits from both; `for_kinds` limits a mistake to some kinds of
shapes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, TypeVar

import numpy as np

from rayproof.cases.registry import Registry
from rayproof.cases.scene import PointLight, Scene, Shape
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic, RaysFromEye, RaysToLight, Rows
from rayproof.reference.analytic.surfaces import Crossing


class Mistake(Analytic):
    """The oracle with one wrong step."""

    name: ClassVar[str] = ""
    sentence: ClassVar[str] = ""  # a verb phrase whose grammatical subject is the renderer
    items: ClassVar[tuple[str, ...]] = ()
    parameters: ClassVar[Mapping[str, float]] = {}
    parts: ClassVar[tuple[type["Mistake"], ...]] = ()  # the mistakes that are combined, if several
    fitted_to: ClassVar[str] = ""  # the case to which its parameters were fitted
    of_several_stages: ClassVar[bool] = False  # whether it needs images of several stages, and only some are wrong
    variants: ClassVar[tuple[type["Mistake"], ...]] = ()  # the same wrong step with other steps around it


MISTAKES: Registry[type[Mistake]] = Registry("mistake", package="rayproof.reports.mistakes")
FAMILIES: "Registry[type[Family]]" = Registry("family of mistakes", package="rayproof.reports.mistakes")
_KNOWN: dict[str, type[Mistake]] = {}  # the mistakes registered so far, while the modules are being imported
Kind = TypeVar("Kind", bound=type[Mistake])


def known(name: str, sentence: str, *items: str) -> Callable[[Kind], Kind]:
    """Return a decorator that registers a mistake."""

    def register(mistake: Kind) -> Kind:
        mistake.name, mistake.sentence, mistake.items = name, sentence, items
        _KNOWN[name] = mistake
        return MISTAKES.register(name)(mistake)

    return register


def variant(name: str) -> Callable[[Kind], Kind]:
    """Return a decorator that registers a variant of the mistake called `name`."""

    def register(mistake: Kind) -> Kind:
        first = _KNOWN[name]
        mistake.name, mistake.sentence, mistake.items = name, first.sentence, first.items
        first.variants = (*first.variants, mistake)
        return mistake

    return register


class Family(Mistake):
    """Mistakes of one kind that differ in fitted parameters; each subclass has a wrong step that reads `numbers`.

    A search starts at every combination of `starts`, and refines each parameter between the adjacent starting values.
    """

    numbers: ClassVar[tuple[float, ...]] = ()
    starts: ClassVar[tuple[tuple[float, ...], ...]] = ()  # the starting values of each parameter, ascending
    jumps: ClassVar[bool] = False  # whether pixels jump with the parameters, so that derivatives do not exist
    named: ClassVar[Mapping[float, str]] = {}  # names of special values

    @classmethod
    def of(cls, numbers: Sequence[float]) -> "type[Family]":
        """Return the mistake with these parameters."""
        words = [
            next(
                (word for value, word in cls.named.items() if abs(number - value) <= NAMED * abs(value)),
                f"{number:.4g}",
            )
            for number in numbers
        ]
        parameters = {str(place): number for place, number in enumerate(numbers)}
        parameters = (
            {cls.name: numbers[0]} if len(numbers) == 1 else {f"{cls.name} {k}": v for k, v in parameters.items()}
        )
        changed = {"numbers": tuple(numbers), "sentence": cls.sentence.format(*words), "parameters": parameters}
        return type(cls.__name__, (cls,), changed)


NAMED = 1e-4  # relative distance within which a fitted parameter gets the name of a special value


FamilyKind = TypeVar("FamilyKind", bound=type[Family])


def family(
    name: str, sentence: str, *items: str, starts: Sequence[Sequence[float]], named: Mapping[float, str] | None = None
) -> Callable[[FamilyKind], FamilyKind]:
    """Return a decorator that registers a family."""

    def register(mistake: FamilyKind) -> FamilyKind:
        mistake.name, mistake.sentence, mistake.items = name, sentence, items
        mistake.starts, mistake.named = tuple(map(tuple, starts)), named or {}
        return FAMILIES.register(name)(mistake)

    return register


# The oracle's steps up to hits and visibility, without the writing of images.
BEFORE_LIGHT = (
    "scene", "image_points", "rays", "clip_interval", "nearest", "crossing", "distances", "positions", "normals",
    "outward_normals", "planes", "shadow_starts", "above_horizon", "blocked", "visibility", "samples",
)  # fmt: skip


def lights_only(mistake: type[Analytic]) -> bool:
    """Return whether a mistake changes only the light: its hits and visibility are those of the oracle."""
    return all(getattr(mistake, step) is getattr(Analytic, step) for step in BEFORE_LIGHT)


def together(first: type[Mistake], second: type[Mistake]) -> type[Mistake]:
    """Return the oracle with both mistakes; if they change the same step, the first is applied after the second."""
    made = type(f"{first.__name__}And{second.__name__}", (first, second), {})
    made.name = f"{first.name}+{second.name}"
    made.sentence = f"{first.sentence}, and {second.sentence}"
    made.items = tuple(dict.fromkeys((*first.items, *second.items)))
    made.parameters = {**first.parameters, **second.parameters}
    made.parts = (first, second)
    return made


# The steps that are computed for one shape, or whose results belong to shapes: a mistake in these can be limited to
# kinds of shapes.
BY_SHAPE = ("scene", "crossing", "blocked", "outward_normals", "normals", "facing", "albedo", "above_horizon")


def for_kinds(mistake: type[Mistake], kinds: Sequence[type[Shape]]) -> type[Mistake] | None:
    """Return a mistake limited to shapes of some kinds; None if its wrong step does not depend on shapes."""
    if not any(vars(base).get(step) for base in mistake.__mro__ if issubclass(base, Mistake) for step in BY_SHAPE):
        return None
    words = [f"{kind.__name__.lower()}s".replace("meshs", "meshes") for kind in kinds]
    of = " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
    made = type(f"{mistake.__name__}Some", (_Some, mistake), {"kinds": tuple(kinds)})
    made.sentence = f"{mistake.sentence}, for {of}"
    return made


class _Some(Mistake):
    """Limits a mistake to some kinds of shapes; it precedes the mistake in the method resolution order."""

    kinds: ClassVar[tuple[type[Shape], ...]] = ()

    def _of(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        """Return a mask (N, 1) of the objects (N, 2) that belong to shapes of the kinds."""
        concerned = np.array([*(isinstance(shape, self.kinds) for shape in scene.shapes), False])
        return concerned[np.clip(objects[:, :1], -1, len(scene.shapes)).astype(int)]

    def scene(self, scene: Scene) -> Scene:
        changed = super().scene(scene)
        if len(changed.shapes) != len(scene.shapes):
            return changed
        pairs = zip(changed.shapes, scene.shapes, strict=True)
        return replace(changed, shapes=tuple(new if isinstance(old, self.kinds) else old for new, old in pairs))

    def crossing(self, scene: Scene, index: int, rays: RaysFromEye) -> Crossing:
        oracle = super() if isinstance(scene.shapes[index], self.kinds) else Analytic()
        return oracle.crossing(scene, index, rays)

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        oracle = super() if isinstance(scene.shapes[index], self.kinds) else Analytic()
        return oracle.blocked(scene, index, rays)

    def outward_normals(self, scene: Scene, index: int, positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        oracle = super() if isinstance(scene.shapes[index], self.kinds) else Analytic()
        return oracle.outward_normals(scene, index, positions, faces)

    def normals(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, positions: np.ndarray) -> np.ndarray:
        arguments = scene, directions, objects, positions
        return np.where(self._of(scene, objects), super().normals(*arguments), Analytic().normals(*arguments))

    def facing(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray) -> np.ndarray:
        arguments = scene, directions, objects, normals
        return np.where(self._of(scene, objects)[:, 0], super().facing(*arguments), Analytic().facing(*arguments))

    def albedo(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        return np.where(self._of(scene, objects), super().albedo(scene, objects), Analytic().albedo(scene, objects))

    def above_horizon(self, scene: Scene, light: PointLight, starts: np.ndarray, rows: Rows) -> np.ndarray:
        arguments = scene, light, starts, rows
        concerned = self._of(scene, rows[Stage.OBJECT])[:, 0]
        return np.where(concerned, super().above_horizon(*arguments), Analytic().above_horizon(*arguments))
