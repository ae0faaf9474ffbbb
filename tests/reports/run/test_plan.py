"""The plan asks every specification item, and a record goes by all the code that a verdict goes by."""

from dataclasses import replace
from itertools import pairwise

import pytest

from rayproof.cases.case import ITEMS
from rayproof.cases.families import all_cases, select
from rayproof.cases.scene import SHADINGS
from rayproof.reports.judge.nearby.clouds import LIGHT
from rayproof.reports.run.plan import ALTERNATIVES, alternatives, plan, with_some_twice, within_reach
from rayproof.reports.subjects import PROGRAM, SERVED, Subject
from rayproof.reports.subjects.protocol import Capabilities


def test_every_item_is_covered_by_a_case_with_a_configuration_whose_formulas_cover_it():
    from rayproof.tracer.configuration import Configuration

    planned = plan(all_cases(), ())

    asked = {
        item
        for one in planned
        for name in one.configurations
        for item in Configuration.parse(name).items & set(one.case.covers)
    }
    assert set(ITEMS) - asked == set()


def test_one_early_case_is_rendered_twice_and_it_is_small_and_lit() -> None:
    cases = select(["antialiased/sphere", "primitives/sphere", "primitives/plane"])
    dark = tuple(replace(case, scene=replace(case.scene, lights=())) for case in cases)

    planned = with_some_twice(plan(cases, ("float32",)))

    assert [one.case.name for one in planned if one.twice] == ["primitives/sphere"]
    assert sum(one.twice for one in with_some_twice(plan(dark, ("float32",)))) == 1
    (one,) = plan(cases[-1:], ("float32",))
    camera = replace(one.case.scene.camera, width=1000, height=1000)
    large = replace(one, case=replace(one.case, scene=replace(one.case.scene, camera=camera)))
    assert not any(one.twice for one in with_some_twice((large,)))
    assert all(
        one.twice for one in with_some_twice((large,), Subject(name=PROGRAM, transport=PROGRAM, title="exec:mine"))
    )


@pytest.mark.parametrize(("count", "twice"), [(3, 3), (20, 20), (257, 20)])
def test_of_a_program_that_stays_alive_twenty_cases_all_over_the_plan_are_asked_again(count: int, twice: int) -> None:
    (sphere,) = plan(select(["primitives/sphere"]), ("float32",))

    planned = with_some_twice((sphere,) * count, Subject(name=SERVED, transport=SERVED, title="serve:mine"))

    places = [place for place, one in enumerate(planned) if one.twice]
    assert len(places) == twice
    assert {after - before for before, after in pairwise(places)} <= {count // twice, count // twice + 1}


@pytest.mark.parametrize(("name", "twice"), [(PROGRAM, 1), (SERVED, 7)])
def test_what_a_program_says_that_it_cannot_draw_is_not_asked_twice(name: str, twice: int) -> None:
    (cube,), (sphere,) = (plan(select([f"primitives/{shape}"]), ("float32",)) for shape in ("cube", "sphere"))
    subject = Subject(name=name, transport=name, title="mine", capabilities=Capabilities(shapes=("sphere",)))

    planned = with_some_twice((cube,) * 40 + (sphere,) * 7, subject)

    assert [one.case.name for one in planned if one.twice] == ["primitives/sphere"] * twice


def test_every_case_runs_the_default_in_both_precisions():
    assert all(one.configurations[:2] == ("float32", "float64") for one in plan(all_cases(), ()))


def test_each_alternative_covers_an_item_of_its_own():
    items = [item for found in alternatives().values() for item in found]

    assert len(alternatives()) == len(ALTERNATIVES)
    assert len(items) == len(set(items))


@pytest.mark.parametrize("light", SHADINGS)
def test_a_program_of_one_light_is_asked_every_case_under_it_with_what_holds_there(light):
    asked = [within_reach(case, Capabilities(shading=(light,))) for case in all_cases()]

    for ours, case in zip(asked, all_cases(), strict=True):
        assert ours.scene == replace(case.scene, shading=light)
        assert (ours is case) == (case.scene.shading == light)
        lit = ("RAD-3",) if light == "simplified" else ("RAD-1", "RAD-2", "RAD-4")
        strange = {"RAD-1", "RAD-2", "RAD-3", "RAD-4"} - {*lit}
        assert ours is case or not strange & {*ours.covers}
        assert bool({*lit} & {*ours.covers}) == bool(case.scene.lights)
        assert ours is case or not any(getattr(one, "stage", None) in LIGHT for one in ours.expectations)


def test_a_cube_that_is_handed_over_as_a_mesh_covers_triangles_and_no_cube():
    (case,) = (case for case in all_cases() if case.name == "transforms/cube_sheared")

    asked = within_reach(case, Capabilities(shapes=("sphere", "mesh")))

    assert asked.scene is case.scene
    assert {*case.covers} - {*asked.covers} == {"HIT-3", "NRM-2", "NRM-3", "XF-1", "XF-2"}
    assert {*asked.covers} - {*case.covers} == {"HIT-6"}
