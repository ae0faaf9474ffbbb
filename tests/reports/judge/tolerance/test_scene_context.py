"""What a scene's context keeps is what would be computed anew, for each kind of rounding and each party."""

from dataclasses import fields, replace

import numpy as np
import pytest

from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.stages import Stage
from rayproof.reports.judge.copies import with_equal_answers_shared
from rayproof.reports.judge.forward.limits import Roundoff
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.pixel_classes import classify
from rayproof.reports.judge.scene_truth import scene_truth
from tests.reports.judge import scenes
from tests.reports.judge.scenes import ORACLE, SCENE, candidate


@pytest.mark.parametrize(
    "name", ["nearest/coincident", "acne/light_on_a_blocker", "several_lights/simplified", "cameras/wide"]
)
def test_classes_of_several_roundings_and_epsilons_are_those_of_each_alone(name):
    scene = next(case.scene for case in CASE_FAMILIES[name.split("/")[0]]() if case.name == name)
    base = scene_truth(scene, stages_of(scene), ORACLE, known={})
    about = (scene, base.truth, base.edges, base.conditioning)

    for g in (Roundoff("float32"), Roundoff("float64"), Roundoff("float32", scale=4.0)):
        limits = base.limits(g, by_matrices=False)
        for epsilon in (0.0, 1e-4):
            kept = base.classes(limits, g, epsilon, key=(g,))
            alone = classify(*about, limits, g, shadow_epsilon=epsilon)

            for field in fields(alone):
                assert np.array_equal(getattr(kept, field.name), getattr(alone, field.name)), field.name


def test_two_answers_of_one_name_are_not_taken_for_each_other():
    truth, base = scenes.truth(), scene_truth(SCENE, stages_of(SCENE), ORACLE, known=scenes.truth())
    ours, other = candidate(truth), candidate(truth | {Stage.RADIANCE: 2 * truth[Stage.RADIANCE]})

    assert base.author(ours, Stage.RADIANCE) == base.author(ours, Stage.RADIANCE) == ours.name
    assert base.author(replace(ours, answers={}), Stage.RADIANCE) is None
    with pytest.raises(ValueError, match="two answers to radiance"):
        base.author(other, Stage.RADIANCE)
    assert base.forgetful().author(other, Stage.RADIANCE) == ours.name


def test_equal_answers_go_by_the_name_of_the_first_who_gave_them():
    truth = scenes.truth()
    again = {stage: np.copy(image) if stage is not Stage.CAMERA else image for stage, image in truth.items()}
    again[Stage.RADIANCE] = 2 * truth[Stage.RADIANCE]
    first, second = replace(candidate(truth), name="first"), replace(candidate(again), name="second")

    first, second = with_equal_answers_shared([first, second])

    assert first.authors == {}
    assert second.authors == dict.fromkeys(set(truth) - {Stage.RADIANCE}, "first")
