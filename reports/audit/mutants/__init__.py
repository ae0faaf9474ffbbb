"""Mutants: wrong renderers that are made by rules from the scene vocabulary, and measure what the suite can see.

A mutant of a field is the oracle, at one place of use or everywhere, on a scene whose field was changed by a rule of
`operations`: `fields` walks the fields, `frames` the camera's axes and pixels, `spaces` what is in the wrong space. A
mutant of a tolerance is an intersection or feeler with one number put where none belongs (`tolerances`). Equivalent
mutants and known survivors have their reasons in `reasons`. `trials` judges one, `campaign` all of them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.nearest import nearest
from rayproof.reference.analytic.stages import NEXT

PREFIX = "mutant/"
Rows = Mapping[Stage, np.ndarray]  # stage -> (pixels, channels)
# A wrong stage, from the scene and the rows before it. The object's step returns shape, face and distance, for they are
# one search; one of the distance finds in its own row what that search said.
Step = Callable[[Scene, Rows], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One wrong renderer. `steps` returns what it computes otherwise in a scene; nothing where it is right there."""

    name: str  # "mutant/FIELD/RULE", and "/PLACE" where the rule holds at one place of use alone
    field: str  # such as "light.position", or the formula of a tolerance
    what: str  # what it does, in words that complete "a renderer that ..."
    steps: Callable[[Scene], Mapping[Stage, Step]]

    def answer(self, scene: Scene, right: Rows) -> dict[Stage, np.ndarray] | None:
        """Return the rows of every stage in `right`, the oracle's own; None where the mutant changes nothing."""
        steps = self.steps(scene)
        order = list(right)
        places = [order.index(stage) for stage in steps if stage in right]
        if not places:
            return None
        rows = {stage: right[stage] for stage in order[: min(places)]}
        distances = right.get(Stage.DISTANCE)
        for stage in order[min(places) :]:
            if stage is Stage.OBJECT:
                found = steps.get(stage, hits)(scene, rows)
                rows[stage], distances = found[:, :2], found[:, 2:]
            elif stage is Stage.DISTANCE:
                assert distances is not None
                rows[stage] = distances
                if stage in steps:
                    rows[stage] = steps[stage](scene, rows)
            else:
                rows[stage] = (steps.get(stage) or NEXT[stage])(scene, rows)
        return rows


def hits(scene: Scene, rows: Rows) -> np.ndarray:
    """Return shape, face and distance of the rays in `rows`, shape (pixels, 3)."""
    objects, distances = nearest(scene, rows[Stage.RAY])
    return np.column_stack([objects, distances])
