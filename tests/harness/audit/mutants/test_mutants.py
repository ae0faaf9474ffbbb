"""What mutants are made of is the right renderer where nothing is changed, and a wrong one where something is."""

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.camera import pixel_centers
from tests.harness.audit.mutants import ORACLE, Mutant, hits
from tests.harness.audit.mutants.frames import _rays
from tests.harness.audit.mutants.operations import LINEAR, MATRIX, POINT, plain, rounded
from tests.harness.audit.mutants.tolerances import BOTH, CUTS, _cut_hits, _cut_shadow_rays, _fixed, _nearest
from tests.harness.audit.mutants.trials import WAYS, MutantOrder, Question, mutants, work

(CROWD,) = select(["crowds/of_several_kinds"])
QUESTION = Question(CROWD)
SCENE, RIGHT = CROWD.scene, QUESTION.right


def test_there_are_hundreds_of_mutants_of_every_field() -> None:
    fields = {mutant.field for mutant in mutants().values()}

    assert len(mutants()) > 500
    assert {f"camera.{name}" for name in ("eye", "target", "up", "fovy", "near", "far", "pixel")} <= fields
    assert {"shape.albedo", "shape.to_world", "shape.two_sided", "sphere.center", "sphere.radius"} <= fields
    assert {"triangle.vertices", "mesh.vertices", "mesh.faces", "light.position", "light.flux"} <= fields
    assert {"scene.shading", "scene.clip"} <= fields


def test_frames_make_the_right_rays_where_nothing_is_changed() -> None:
    for case in (CROWD, *select(["cameras/slanted_up", "cameras/panorama"])):
        right = ORACLE.rays(case.scene, pixel_centers(case.scene.camera))

        assert _rays(case.scene, {}) == pytest.approx(right, abs=1e-15)


@pytest.mark.parametrize("relative", BOTH, ids=["absolute", "relative"])
@pytest.mark.parametrize("formula", CUTS)
def test_a_tolerance_of_nothing_changes_nothing(formula: str, relative: bool) -> None:
    _, where, cut = CUTS[formula]
    outside = formula.endswith(("box", "inside"))  # hits lie on edges and boxes to within rounding
    changed = _fixed(cut, -1e-12 if outside else 0.0, relative)

    # A shrunk face is decided anew, by other roundings: not by the pixel that one of them changes.
    assert np.mean(_cut_hits(where, changed, SCENE, RIGHT) != hits(SCENE, RIGHT)) < 1e-3
    assert np.mean(_cut_shadow_rays(where, changed, SCENE, RIGHT) != RIGHT[Stage.VISIBILITY]) < 1e-3


def test_the_nearest_of_all_is_found_where_a_tie_has_no_width() -> None:
    assert np.array_equal(_nearest("nearest.later", 0.0, True, SCENE, RIGHT), hits(SCENE, RIGHT))


@pytest.mark.parametrize("rules", [POINT, MATRIX, LINEAR], ids=["point", "matrix", "linear"])
def test_rules_change_a_value_in_no_special_place(rules) -> None:
    value = np.array([[3.0, -120.7, 0.3, 150.1], [-170.3, 1.3, 2.2, -3.7], [0.6, 2.9, 2.4, 8.8], [0, 0, 0, 1]])
    value = value[0, :3] if rules is POINT else value[:3, :3] if rules is LINEAR else value

    assert np.linalg.det(value) < 0 if rules is not POINT else True
    assert [name for name, rule in rules.items() if np.array_equal(rule(value), value)] == []


def test_rounding_keeps_so_many_bits() -> None:
    assert plain(rounded(8)(np.array([1.00390625, -3.0, 0.0, 255.5]))) == (1.0, -3.0, 0.0, 256.0)


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


def test_random_scenes_kill_what_the_order_names() -> None:
    wrong = "mutant/camera.frame/up_as_given"

    report = work(MutantOrder(wanted=((wrong, ("radiance",)),), seed=31, numbers=(0, 8)))

    assert [kill.way for kill in report.kills] == ["radiance"]
    assert report.kills[0].case.startswith("random_wide/31/")


@pytest.mark.parametrize(
    ("case", "tolerance"),
    [
        ("slit", "shadow_ray.start/relative_1e-8"),
        ("crumbs", "square.parallel/absolute_1e-8"),
        ("lamp", "shadow_ray.end_behind/relative_1e-4"),
        ("skimmed_square", "square.parallel/relative_1e-4"),
        ("skimmed_mesh", "triangle.parallel/relative_1e-4"),
        ("skimmed_cube", "cube.parallel/relative_1e-4"),
        ("skimmed_plane", "plane.parallel/relative_1e-4"),
        ("hall", "cube.parallel/absolute_1e-8"),
        ("on_axis", "sphere.box/relative_1e-8"),
        ("low_light", "shadow_ray.horizon/1e-4"),
        ("rim", "sphere.discriminant/relative_1e-4"),
        ("uneven", "camera.far/16_bits"),
    ],
)
def test_each_case_of_tolerances_shows_what_it_was_made_for(case: str, tolerance: str) -> None:
    assert (f"mutant/{tolerance}", "radiance") in _killed(f"mutant/{tolerance}", cases=(f"tolerances/{case}",))
