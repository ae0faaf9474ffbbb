"""What a ground keeps of a scene is what would be computed anew for each kind of rounding."""

from dataclasses import fields

import numpy as np
import pytest

from rayproof.cases.families import CASE_FAMILIES
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.tolerance.limits import Roundoff
from rayproof.reports.judge.tolerance.pixel_classes import classify
from rayproof.reports.judge.tolerance.scene_context import ground
from tests.reports.judge.scenes import ORACLE


@pytest.mark.parametrize(
    "name", ["nearest/coincident", "acne/light_on_a_blocker", "several_lights/simplified", "cameras/wide"]
)
def test_classes_of_several_roundings_and_epsilons_are_those_of_each_alone(name):
    scene = next(case.scene for case in CASE_FAMILIES[name.split("/")[0]]() if case.name == name)
    base = ground(scene, stages_of(scene), ORACLE, known={})
    about = (scene, base.truth, base.edges, base.conditioning)

    for g in (Roundoff("float32"), Roundoff("float64"), Roundoff("float32", scale=4.0)):
        limits = base.limits(g, by_matrices=False)
        for epsilon in (0.0, 1e-4):
            kept = base.classes(limits, g, epsilon, key=(g.key,))
            alone = classify(*about, limits, g, shadow_epsilon=epsilon)

            for field in fields(alone):
                assert np.array_equal(getattr(kept, field.name), getattr(alone, field.name)), field.name
