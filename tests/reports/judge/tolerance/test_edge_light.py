"""At an edge light has the value of a side or it is wrong: no garbage hides there, staged or not."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.scene import PointLight
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.comparison import Comparison
from rayproof.reports.judge.edge_values import Lights, _met, _Ranges
from rayproof.reports.judge.measurement import Kind, most_interval
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.reports.results.case_records import Check, Examined
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.scenes import case_of_file
from tests.reports.judge.scenes import CASE, ORACLE, candidate, rounded, witness

EXAMPLES = Path(__file__).parents[4] / "examples"
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@cache
def case_named(name: str) -> Case:
    """Return a case of the suite, or an example's."""
    if name == "still_life":
        return case_of_file(EXAMPLES / "still_life.json")
    if name == "ball":
        return CASE
    return next(case for case in CASE_FAMILIES[name.split("/")[0]]() if case.name == name)


@cache
def truth_of(name: str) -> dict:
    """Return the oracle's answers, not to be spoilt."""
    return ORACLE.render(case_named(name).scene, stages_of(case_named(name).scene))


def party(ours: dict, *, staged: bool, **more) -> Answers:
    """Return a program's answers: all of them, by passes of their own, or radiance alone."""
    kept = ours if staged else {Stage.RADIANCE: ours[Stage.RADIANCE]}
    unable = {stage: "radiance alone" for stage in Stage if stage not in kept}
    return replace(candidate(kept), chained=False, unsupported=unable, **({"shadow_epsilon": 0.0} | more))


def checked(name: str, mine: Answers, stage: Stage = Stage.RADIANCE) -> Check:
    """Return the check of one stage before the oracle."""
    judged = judge_case(case_named(name), [mine], [witness(truth_of(name))], ORACLE, {})
    return next(check for check in judged.checks if check.stage is stage)


def ledger(check: Check) -> Examined:
    """Return what a check examined."""
    assert check.examined is not None
    return check.examined


def kinds_of(check: Check) -> np.ndarray:
    """Return each pixel's kind, end to end."""
    assert check.end_to_end is not None
    return check.end_to_end.kinds


def terms(name: str, mine: Answers) -> Comparison:
    """Return the terms before the oracle, whose classes say where the edges are."""
    scene = case_named(name).scene
    base = scene_truth(scene, stages_of(scene), ORACLE, known=truth_of(name))
    return Comparison(base=base, subject=mine, reference=witness(truth_of(name)))


@pytest.mark.parametrize("staged", [True, False], ids=["staged", "radiance-alone"])
@pytest.mark.parametrize("name", ["still_life", "acne/light_on_a_blocker", "nearest/coincident"])
def test_garbage_at_edges_fails(name, staged):
    ours = rounded(truth_of(name))
    faultless = checked(name, party(ours, staged=staged))
    edge = terms(name, party(ours, staged=staged)).classes.edge(Stage.RADIANCE)
    spoilt = ours | {stage: np.where(edge[..., np.newaxis], 1e30, ours[stage]) for stage in LIGHT}

    assert faultless.outcome is Outcome.PASS, faultless.reason
    assert edge.sum() > 10
    for stage in LIGHT if staged else (Stage.RADIANCE,):
        check = checked(name, party(spoilt, staged=staged), stage)
        assert check.outcome is Outcome.FAIL
        assert ledger(check).wrong == edge.sum()


@pytest.mark.parametrize("part", [0.0, 0.5, 1.0], ids=["shadowed", "half", "whole"])
@pytest.mark.parametrize("stage", LIGHT, ids=str)
def test_at_a_shadows_edge_a_light_counts_wholly_or_not_at_all(stage, part):
    ours = rounded(truth_of("ball"))
    mine = party(ours, staged=True, shadow_epsilon=3e-3)
    classes = terms("ball", mine).classes
    row, column = np.argwhere(classes.light[..., 0] & ~classes.outline & (ours[Stage.RADIANCE].sum(axis=-1) > 0))[0]
    image = ours[stage].copy()
    image[row, column] *= part

    kinds = kinds_of(checked("ball", replace(mine, answers=ours | {stage: image}), stage))

    # Nothing but the declared epsilon leaves the pixel undecided.
    wanted = {0.0: (Kind.EPSILON,), 0.5: (Kind.WRONG,), 1.0: (Kind.SIDE,)}[part]
    assert kinds[row, column] in wanted


def test_of_two_lights_only_the_undecided_one_may_be_seen_or_not():
    mine = party(rounded(truth_of("still_life")), staged=True, shadow_epsilon=5e-3)
    classes = terms("still_life", mine).classes
    kinds = {}
    for light in (0, 1):
        row, column = np.argwhere(classes.light[..., 0] & ~classes.light[..., 1] & ~classes.outline)[0]
        image = truth_of("still_life")[Stage.VISIBILITY].copy()
        image[row, column, light] = 1 - image[row, column, light]
        other = replace(mine, answers=mine.answers | {Stage.VISIBILITY: image})
        kinds[light] = kinds_of(checked("still_life", other, Stage.VISIBILITY))[row, column]

    assert kinds[0] != Kind.WRONG
    assert kinds[1] == Kind.WRONG


def test_all_channels_come_from_one_choice_of_lights():
    case = case_named("still_life")
    ours = rounded(truth_of("still_life"))
    mine = party(ours, staged=False, shadow_epsilon=5e-3)
    classes = terms("still_life", mine).classes
    both = classes.light.all(axis=-1) & ~classes.outline
    alone = []
    for light in case.scene.lights:
        lit = replace(case.scene, lights=(light,), shapes=case.scene.shapes)
        given = truth_of("still_life") | {Stage.VISIBILITY: np.ones((*both.shape, 1))}
        for stage in LIGHT:
            given = given | {stage: ORACLE.continue_from(lit, stage, given)}
        alone.append(given[Stage.RADIANCE])
    row, column = max(np.argwhere(both), key=lambda at: min(image[tuple(at)].min() for image in alone))
    first, second = (image[row, column] for image in alone)
    kinds = []
    for value in (first, second, first + second, 0 * first, np.array([first[0], second[1], second[2]])):
        image = ours[Stage.RADIANCE].copy()
        image[row, column] = value
        kinds.append(checked("still_life", party({Stage.RADIANCE: image}, staged=False, shadow_epsilon=5e-3)))

    assert min(first.min(), second.min()) > 0
    assert [kinds_of(check)[row, column] == Kind.WRONG for check in kinds] == [False] * 4 + [True]


def test_of_many_undecided_lights_the_interval_is_taken_and_counted():
    lamps = tuple(
        PointLight(position=(1.5 + 0.01 * k, -1.0, 4.0), flux=(10.0 + k, 8.0, 6.0 + 0.1 * k)) for k in range(10)
    )
    scene = replace(CASE.scene, lights=lamps)
    case = replace(CASE, scene=scene)
    answers = ORACLE.render(scene, stages_of(scene))
    ours = rounded(answers)
    mine = party(ours, staged=False)
    base = scene_truth(scene, stages_of(scene), ORACLE, known=answers)
    outline = Comparison(base=base, subject=replace(mine, shadow_epsilon=0.02), reference=witness(answers)).classes
    lit = ours[Stage.RADIANCE].min(axis=-1) > 0
    rows, columns = np.nonzero(outline.light.all(axis=-1) & ~outline.outline & lit)
    assert len(rows) > 3
    results = []
    for factor, count in ((0.37, 1), (0.37, len(rows)), (1e30, 1)):
        image = ours[Stage.RADIANCE].copy()
        image[rows[:count], columns[:count]] *= factor
        spoilt = party({Stage.RADIANCE: image}, staged=False, shadow_epsilon=0.02)
        judged = judge_case(case, [spoilt], [witness(answers)], ORACLE, {})
        results.append(next(check for check in judged.checks if check.stage is Stage.RADIANCE))
    held, too_many, beyond = results

    assert ledger(held).interval == 1 <= most_interval(ledger(held).pixels)
    assert held.outcome is Outcome.WARN, "for the epsilon"
    assert (too_many.outcome, ledger(too_many).interval > 1) == (Outcome.ERROR, True)
    assert (beyond.outcome, ledger(beyond).wrong) == (Outcome.FAIL, 1)


@pytest.mark.parametrize("count", [10, 20])
def test_of_many_undecided_lights_some_choice_gives_the_value_or_none_does(count):
    generator = np.random.default_rng(count)
    parts = generator.uniform(0.1, 5.0, (1, count, 3))
    ranges = _Ranges(low=parts * (1 - 1e-6), high=parts * (1 + 1e-6), most=parts)
    lights = Lights(
        decided=np.zeros((1, count), dtype=bool),
        free=np.ones((1, count), dtype=bool),
        close=np.zeros((1, count), dtype=bool),
        relative=np.zeros((1, count)),
        rounding=0.0,
        step=np.zeros((1, 3)),
    )
    for _ in range(10):
        value = parts[:, generator.random(count) < 0.5].sum(axis=1)
        assert _met(value, ranges, lights).all()
        assert not _met(value * (1.001, 0.999, 1.002), ranges, lights).any()
    # Where each part may be anything up to itself, choices tell nothing: an interval is left.
    assert not _met(parts.sum(axis=1), replace(ranges, low=np.zeros_like(parts)), lights).any()
