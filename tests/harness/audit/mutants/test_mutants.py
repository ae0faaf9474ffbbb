"""What mutants are made of is the right renderer where nothing is changed, and a wrong one where something is."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import pixel_centers
from tests.harness.audit.mutants import ORACLE, Mutant
from tests.harness.audit.mutants.frames import _rays
from tests.harness.audit.mutants.trials import WAYS, MutantOrder, Question, work

(CROWD,) = select(["crowds/of_several_kinds"])
QUESTION = Question(CROWD)
SCENE, RIGHT = CROWD.scene, QUESTION.right


def test_frames_make_the_right_rays_where_nothing_is_changed() -> None:
    for case in (CROWD, *select(["cameras/slanted_up", "cameras/panorama"])):
        right = ORACLE.rays(case.scene, pixel_centers(case.scene.camera))

        assert _rays(case.scene, {}) == pytest.approx(right, abs=1e-15)


def _killed(*names: str, cases: tuple[str, ...]) -> set[tuple[str, str]]:
    report = work(MutantOrder(wanted=tuple((name, WAYS) for name in names), cases=cases))
    return {(kill.mutant, kill.way) for kill in report.kills}


def test_a_wrong_renderer_is_killed_and_a_right_one_is_not() -> None:
    wrong, right = "mutant/camera.frame/right_not_normalised", "mutant/camera.frame/up_normalised_first"

    cases = tuple(case.name for case in select(["combined"])[:6])

    assert _killed(wrong, right, cases=cases) == {(wrong, way) for way in WAYS}


def test_the_oracle_itself_is_no_mutant_and_passes() -> None:
    itself = Mutant(name="itself", field="", what="", steps=lambda _: {})

    assert itself.answer(SCENE, RIGHT) is None
    assert list(QUESTION.kills(itself, WAYS)) == []
    stages = [stage for stage in RIGHT if stage is not Stage.CAMERA]
    assert QUESTION._kill(itself, "stages", stages, {s: r.astype(np.float32) for s, r in RIGHT.items()}) is None


@pytest.mark.parametrize(
    ("case", "tolerance"),
    [
        ("slit", "shadow_ray.start/relative_1e-8"),
        ("lamp", "shadow_ray.end_behind/relative_1e-4"),
        ("skimmed_mesh", "triangle.parallel/relative_1e-4"),
        ("on_axis", "sphere.box/relative_1e-8"),
        ("low_light", "shadow_ray.horizon/1e-4"),
        ("uneven", "camera.far/16_bits"),
    ],
)
def test_each_case_of_tolerances_shows_what_it_was_made_for(case: str, tolerance: str) -> None:
    assert (f"mutant/{tolerance}", "radiance") in _killed(f"mutant/{tolerance}", cases=(f"tolerances/{case}",))
