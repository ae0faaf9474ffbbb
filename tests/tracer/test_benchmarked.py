"""What is judged on request is traced as what is timed: by the same plan."""

import pytest

from rayproof.cases.benchmark_scenes import QUICK_SIZES, SCENES
from rayproof.cases.families import select
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.plan import Plan, plan

JUDGED = {plan(case.scene, Configuration()) for case in select(["benchmarked"])}


@pytest.mark.parametrize("name", [bench.name for bench in SCENES if bench.quick])
@pytest.mark.parametrize("size", QUICK_SIZES, ids=str)
def test_every_quick_scene_of_the_benchmark_has_a_case_of_its_plan(name: str, size: tuple[int, int]) -> None:
    (bench,) = (one for one in SCENES if one.name == name)

    assert plan(bench.scene(*size), Configuration()) in JUDGED


def test_they_take_several_samples_a_lane_unrolled_and_in_trees() -> None:
    assert all(isinstance(one, Plan) and one.columns * one.rows > 1 and not one.split for one in JUDGED)
    assert {bool(one.trees) for one in JUDGED} == {False, True}
