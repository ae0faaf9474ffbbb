"""Scenes drawn at random over the whole vocabulary, with hostile features: `random/SEED/NUMBER` names one for ever.

Nothing of a scene depends on the scenes before it: its numbers are drawn from a stream that is seeded by seed and
number alone. Number n of any seed has the feature n mod (number of features) of a turn that the seed shuffles, so that
each feature has its share of any long run; others join it by chance.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from rayproof.cases.case import Case, covering
from rayproof.cases.random.draft import plain_draft
from rayproof.cases.random.draws import Draws
from rayproof.cases.random.features import FEATURES, Step
from rayproof.cases.scene import Scene

FAMILY = "random"
EDITION = 1  # of the scenes that names stand for; another one says that they changed
BESIDE = 0.035  # the chance of each further feature
MOST_EDGE = 0.5  # as of scene files: nobody tuned the view
LARGEST = 2**31 - 1  # seed and number


@dataclass(frozen=True, kw_only=True)
class RandomScene:
    """A scene and the names of the features that it was given, the kinds of its shapes apart."""

    scene: Scene
    features: tuple[str, ...]


def random_scene(seed: int, number: int) -> RandomScene:
    """Return scene `number` of `seed`."""
    draws = Draws(EDITION, seed, number)
    chosen = _chosen(seed, number, draws)
    draft = plain_draft(draws)
    for name in chosen:
        FEATURES[name](draft)
    return RandomScene(scene=draft.scene(), features=tuple(sorted(chosen)))


def random_case(seed: int, number: int) -> Case:
    """Return the case `random/SEED/NUMBER`."""
    return case_named(f"{FAMILY}/{seed}/{number}")


@lru_cache(maxsize=1024)
def case_named(name: str) -> Case:
    """Return the case that a name `random/SEED/NUMBER` stands for.

    Raises:
        LookupError: it does not read so.

    """
    seed, number = numbers(name)
    drawn = random_scene(seed, number)
    return Case(
        name=f"{FAMILY}/{seed}/{number}",
        scene=drawn.scene,
        stresses=f"Drawn at random: {', '.join(drawn.features).replace('_', ' ')}.",
        covers=covering(drawn.scene),
        least_interior=0,
        most_edge=MOST_EDGE,
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
    drawn = random_scene(*numbers(name))
    kinds = {type(shape).__name__.lower() for shape in drawn.scene.shapes}
    return (*drawn.features, *sorted(kinds))


def counted(names: Iterable[str]) -> dict[str, int]:
    """Return how many of the scenes have each feature; all features are there, by name."""
    counts = Counter(feature for name in names for feature in features_of(name))
    return {name: counts[name] for name in sorted({*FEATURES, *counts})}


def _chosen(seed: int, number: int, draws: Draws) -> list[str]:
    """Return the features of a scene in the order in which they are applied: the one whose turn it is, and others."""
    turn = _turn(seed)
    first = turn[number % len(turn)]
    chosen = [first, *(name for name in FEATURES if name != first and draws.chance(BESIDE))]
    kept: list[str] = []
    for name in chosen:
        if not any(_exclude(name, other) or _exclude(other, name) for other in kept):
            kept.append(name)
    order = list(FEATURES)
    return sorted(kept, key=lambda name: (FEATURES.about(name)["step"], order.index(name)))


def _exclude(name: str, other: str) -> bool:
    """Return whether a scene that has the first feature cannot have the second."""
    group = FEATURES.about(name).get("group")
    if group is not None and group == FEATURES.about(other).get("group"):
        return True
    if name == "empty":
        return not FEATURES.about(other).get("bare", False)
    return name == "no_light" and FEATURES.about(other)["step"] is Step.LIGHTS


@lru_cache(maxsize=16)
def _turn(seed: int) -> tuple[str, ...]:
    """Return the features in a seed's own order (Fisher and Yates, 1938)."""
    names, draws = list(FEATURES), Draws(EDITION, seed)
    for last in range(len(names) - 1, 0, -1):
        other = draws.whole(0, last)
        names[last], names[other] = names[other], names[last]
    return tuple(names)
