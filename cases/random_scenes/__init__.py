"""Random scenes: the name `random/SEED/NUMBER` determines a scene for good.

A scene does not depend on the scenes before it: its numbers are drawn from a stream that is seeded only by seed and
number. Number n of any seed has the feature n mod (number of features) of a list that the seed shuffles, so that each
feature has its share of any long run; further features are added by chance.

`wide_case` draws the fields of such a scene over their whole ranges: `up` of any length, images of any shape, and so
on. The scene keeps its features and its visible shapes, but the representation, the camera's angle and image, and the
brightness change. This makes no difference to a renderer that reads each field by its meaning; a mutant is equivalent
only if it passes these.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rayproof.cases.case import RANDOM as FAMILY
from rayproof.cases.case import Case, covering
from rayproof.cases.placement import compose, scaling, vector
from rayproof.cases.random_scenes.draft import Draws, plain_draft, upward
from rayproof.cases.random_scenes.features import FEATURES, Step
from rayproof.cases.scene import Camera, Matrix, Mesh, PointLight, Rgb, Scene, Shape, Sphere, Triangle, Vector

EDITION = 1  # version of the scenes; it increases if any name gets another scene
BESIDE = 0.035  # the chance of each further feature
MOST_EXPLAINED = 0.5  # as for scene files, since the view is not tuned
LARGEST = 2**31 - 1  # seed and number
STREAM = 1  # the stream of the wide fields; the scene's own stream does not change
MOST_PIXELS = 600  # of a wide image
LONGEST = 96  # px


def random_scene(seed: int, number: int) -> tuple[Scene, tuple[str, ...]]:
    """Return scene `number` of `seed` and the names of its features, the kinds of its shapes apart."""
    draws = Draws(EDITION, seed, number)
    chosen = _chosen(seed, number, draws)
    draft = plain_draft(draws)
    for name in chosen:
        FEATURES[name](draft)
    return draft.scene(), tuple(sorted(chosen))


def random_case(seed: int, number: int) -> Case:
    """Return the case `random/SEED/NUMBER`."""
    return case_named(f"{FAMILY}/{seed}/{number}")


@lru_cache(maxsize=1024)
def case_named(name: str) -> Case:
    """Return the case with the name `random/SEED/NUMBER`.

    Raises:
        LookupError: the name has another form.

    """
    seed, number = numbers(name)
    scene, features = random_scene(seed, number)
    return Case(
        name=f"{FAMILY}/{seed}/{number}",
        scene=scene,
        stresses=f"Drawn at random: {', '.join(features).replace('_', ' ')}.",
        covers=covering(scene),
        least_interior=0,
        most_explained=MOST_EXPLAINED,
        tuned=False,
    )


def numbers(name: str) -> tuple[int, int]:
    """Return seed and number of a name `random/SEED/NUMBER`; raise LookupError if it does not read so."""
    family, *parts = name.split("/")
    if family != FAMILY or len(parts) != 2 or not all(part.isascii() and part.isdigit() for part in parts):
        raise LookupError(f"random scenes are called {FAMILY}/SEED/NUMBER in whole numbers, got {name[:80]!a}")
    seed, number = map(int, parts)
    if max(seed, number) > LARGEST:
        raise LookupError(f"seed and number of a random scene are at most {LARGEST}, got {name[:80]!a}")
    return seed, number


def features_of(name: str) -> tuple[str, ...]:
    """Return the features of a random scene by its name, and the kinds of its shapes."""
    scene, features = random_scene(*numbers(name))
    kinds = {type(shape).__name__.lower() for shape in scene.shapes}
    return (*features, *sorted(kinds))


def counted(names: Iterable[str]) -> dict[str, int]:
    """Return the number of scenes with each feature, for all features in the order of their names."""
    counts = Counter(feature for name in names for feature in features_of(name))
    return {name: counts[name] for name in sorted({*FEATURES, *counts})}


def _chosen(seed: int, number: int, draws: Draws) -> list[str]:
    """Return the features of a scene in the order of application: that of its number, and random others."""
    turn = _turn(seed)
    first = turn[number % len(turn)]
    chosen = [first, *(name for name in FEATURES if name != first and draws.chance(BESIDE))]
    kept: list[str] = []
    for name in chosen:
        if not any(_exclude(name, another) or _exclude(another, name) for another in kept):
            kept.append(name)
    order = list(FEATURES)
    return sorted(kept, key=lambda name: (FEATURES.about(name)["step"], order.index(name)))


def _exclude(name: str, another: str) -> bool:
    """Return whether a scene that has the first feature cannot have the second."""
    group = FEATURES.about(name).get("group")
    if group is not None and group == FEATURES.about(another).get("group"):
        return True
    if name == "empty":
        return not FEATURES.about(another).get("bare", False)
    return name == "no_light" and FEATURES.about(another)["step"] is Step.LIGHTS


@lru_cache(maxsize=16)
def _turn(seed: int) -> tuple[str, ...]:
    """Return the features in a seed's own order (Fisher and Yates, 1938)."""
    names, draws = list(FEATURES), Draws(EDITION, seed)
    for last in range(len(names) - 1, 0, -1):
        place = draws.whole(0, last)
        names[last], names[place] = names[place], names[last]
    return tuple(names)


@lru_cache(maxsize=64)
def wide_case(seed: int, number: int) -> Case:
    """Return the case of a random scene with every field drawn over its range."""
    scene = widened(random_scene(seed, number)[0], Draws(EDITION, seed, number, STREAM))
    return Case(
        name=f"{FAMILY}_wide/{seed}/{number}",
        scene=scene,
        stresses="Drawn at random, every field over its whole range.",
        covers=covering(scene),
        least_interior=0,
        most_explained=MOST_EXPLAINED,
        tuned=False,
    )


def widened(scene: Scene, draws: Draws) -> Scene:
    """Return a scene with the same shapes and lights in the same places, everything else drawn anew."""
    return Scene(
        camera=_camera(scene.camera, draws),
        shapes=tuple(_shape(shape, draws) for shape in scene.shapes),
        lights=tuple(_light(light, draws) for light in scene.lights),
        shading=scene.shading,
        clip=scene.clip,
    )


def _camera(camera: Camera, draws: Draws) -> Camera:
    width = int(draws.logarithmic(1, LONGEST + 1))
    height = min(int(draws.logarithmic(1, LONGEST + 1)), max(1, MOST_PIXELS // width))
    length = draws.logarithmic(1e-3, 1e3)
    up = upward(camera.eye, camera.target, draws.direction())
    # The target may be anywhere on the central ray, from close to the eye to far behind the visible shapes.
    share = draws.logarithmic(0.05, 20)
    eye, ahead = np.asarray(camera.eye), np.subtract(camera.target, camera.eye)
    return replace(
        camera,
        target=vector(eye + share * ahead) if draws.chance(0.5) else camera.target,
        up=vector(length * np.asarray(up)),
        # A telescope keeps its angle, since a wider view might show nothing.
        fovy=draws.uniform(5, 170) if camera.fovy > 1 and draws.chance(0.5) else camera.fovy,
        width=width,
        height=height,
    )


def _shape(shape: Shape, draws: Draws) -> Shape:
    """Return the shape in other units of its object space, with albedos that may exceed 1."""
    shape = replace(shape, albedo=_colour(shape.albedo, draws.vector(0, 3)))
    unit = draws.logarithmic(1e-3, 1e3)
    to_world: Matrix = compose(shape.to_world, scaling(1 / unit, 1 / unit, 1 / unit))
    if isinstance(shape, Sphere):
        return replace(
            shape, center=vector(unit * np.asarray(shape.center)), radius=unit * shape.radius, to_world=to_world
        )
    if isinstance(shape, Triangle):
        first, second, third = (vector(unit * np.asarray(corner)) for corner in shape.vertices)
        return replace(shape, vertices=(first, second, third), to_world=to_world)
    if isinstance(shape, Mesh):
        return replace(shape, vertices=shape.vertices.astype(np.float64) * unit, to_world=to_world)
    return shape


def _light(light: PointLight, draws: Draws) -> PointLight:
    factor = draws.logarithmic(1e-4, 1e4)
    return replace(light, flux=_colour(light.flux, (factor, factor, factor)))


def _colour(colour: Rgb, factors: Vector) -> Rgb:
    red, green, blue = (part * factor for part, factor in zip(colour, factors, strict=True))
    return red, green, blue
