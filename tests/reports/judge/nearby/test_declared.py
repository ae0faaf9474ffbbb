"""What a renderer declares to overlook explains what follows from it, is counted apart, and explains nothing else."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.measurement import Kind
from tests.reports.judge.nearby.scenes import MIDDLE, above, lamp, level, upright
from tests.reports.judge.scenes import followed, kinds, naming, put, rounded, truth_of_scene

FLOOR = level(0.0, 0.0, 0.0, side=16.0)
FAR, NEAR = 1e-3, 1e-6  # m, or shares: an epsilon that reaches what is overlooked, and one that does not


@dataclass(frozen=True)
class Overlooked:
    """A scene in which something is overlooked in the middle pixel, and the epsilon by which."""

    epsilon: str
    scene: Scene
    stage: Stage
    value: Any = None
    shown: Scene | None = None  # what is seen instead

    @cached_property
    def answers(self) -> dict:
        """Return what a renderer answers that overlooks it."""
        if self.shown is not None:
            return rounded(truth_of_scene(self.shown).truth)
        if self.stage is Stage.OBJECT:
            return naming(self.scene, MIDDLE, *self.value)
        truth = truth_of_scene(self.scene).truth
        return followed(self.scene, truth, self.stage, put(truth[self.stage], MIDDLE, self.value))


WALL = Overlooked("shadow_epsilon", above(FLOOR, upright(3e-4), lights=(lamp(3.0, 0.1, 3.0),)), Stage.VISIBILITY, 1.0)
SHADE = Overlooked(
    "light_epsilon",
    above(FLOOR, level(0.0, 0.0, 3.0 - 1e-3), height=1.0, lights=(lamp(0.0, 0.0, 3.0),)),
    Stage.VISIBILITY,
    1.0,
)
BEFORE = Overlooked(
    "ray_epsilon",
    above(level(0.0, 0.0, 4.0 - 5e-4, side=2e-3), FLOOR, near=1e-4, lights=(lamp(0.4, 0.2, 6.0),)),
    Stage.OBJECT,
    (1.0, 0.0),
)
CLOSE = Overlooked(
    "tie_epsilon", above(FLOOR, level(0.0, 0.0, -5e-4), lights=(lamp(0.4, 0.2, 6.0),)), Stage.OBJECT, (1.0, 0.0)
)
BORDER = Overlooked(
    "edge_epsilon",
    above(level(-2.0 - 5e-4, 0.0, 0.0), level(0.0, 0.0, -1.0, side=16.0), lights=(lamp(0.4, 0.2, 6.0),)),
    Stage.OBJECT,
    shown=above(level(-2.0 + 5e-4, 0.0, 0.0), level(0.0, 0.0, -1.0, side=16.0), lights=(lamp(0.4, 0.2, 6.0),)),
)
ALL = (WALL, SHADE, BEFORE, CLOSE, BORDER)


@pytest.mark.parametrize("each", ALL, ids=lambda each: each.epsilon)
def test_what_lies_within_a_declared_epsilon_may_be_overlooked_and_is_counted_apart(each):
    without = kinds(each.scene, each.answers, MIDDLE)
    short = kinds(each.scene, each.answers, MIDDLE, **{each.epsilon: NEAR * 1e-3})
    declared = kinds(each.scene, each.answers, MIDDLE, **{each.epsilon: FAR if each is not SHADE else 1e-2})

    assert without[each.stage] is short[each.stage] is Kind.WRONG
    assert declared[each.stage] is Kind.EPSILON
    assert Kind.WRONG not in declared.values()


@pytest.mark.parametrize("each", ALL, ids=lambda each: each.epsilon)
def test_an_epsilon_that_is_declared_explains_no_other_value(each):
    light = {stage: put(each.answers[stage], MIDDLE, 1e30) for stage in (Stage.IRRADIANCE, Stage.RADIANCE)}
    found = kinds(each.scene, each.answers | light, MIDDLE, **{each.epsilon: FAR}, chained=False)

    assert [found[stage] for stage in light] == [Kind.WRONG] * 2


@pytest.mark.parametrize("each", ALL, ids=lambda each: each.epsilon)
def test_what_is_right_needs_no_epsilon(each):
    right = rounded(truth_of_scene(each.scene).truth)

    assert set(kinds(each.scene, right, MIDDLE, **{each.epsilon: FAR}).values()) <= {Kind.STRICT, Kind.WIDE}


def test_a_shadow_ray_that_starts_higher_may_pass_over_a_low_step():
    # The step is farther away than the epsilon, so that no ray skips it, and lower.
    step = replace(
        upright(1e-2), to_world=((0, 0, -1, 1e-2), (4, 0, 0, 0), (0, 4e-4, 0, 2e-4), (0, 0, 0, 1)), two_sided=True
    )
    scene = above(FLOOR, step, lights=(lamp(3.0, 0.0, 0.06),))
    truth = truth_of_scene(scene).truth
    ours = followed(scene, truth, Stage.VISIBILITY, put(truth[Stage.VISIBILITY], MIDDLE, 1.0))

    assert truth[Stage.VISIBILITY][MIDDLE] == 0
    assert np.isfinite(truth[Stage.DISTANCE][MIDDLE])
    assert kinds(scene, ours, MIDDLE)[Stage.VISIBILITY] is Kind.WRONG
    assert kinds(scene, ours, MIDDLE, shadow_epsilon=FAR)[Stage.VISIBILITY] is Kind.EPSILON
