"""Where in their pixels a program's samples lie: the oracle samples there, as far as the program says."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.scene import Camera
from rayproof.cases.scene_json import scene_from_json, scene_to_json
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.radiance import Radiance
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.plan import within_reach
from rayproof.reports.subjects.protocol import STAYS, Capabilities, capabilities_of
from tests.reports.judge.scenes import CASE, ORACLE, SCENE, candidate, rounded, witness

PLACE = (0.25, -0.125)


def moved(camera: Camera, offset: tuple[float, float]) -> Camera:
    return replace(camera, sample_offset=offset)


def images(offset: tuple[float, float]) -> StageImages:
    scene = replace(SCENE, camera=moved(SCENE.camera, offset))
    return rounded(ORACLE.render(scene, [stage for stage in stages_of(scene) if stage is not Stage.CAMERA]))


def judged(able: Capabilities, answers: StageImages) -> Judged:
    case: Case = within_reach(CASE, able)
    subject = replace(
        candidate(answers),
        sample_radius=able.sample_offset[2],
        chained=False,
        unsupported={Stage.CAMERA: "It is no image."},
    )
    truth = witness(ORACLE.render(case.scene, stages_of(case.scene)))
    return of_what_is_supported(judge_case(case, [subject], [truth], ORACLE, {}), [subject])


def test_samples_lie_in_the_middle_of_a_quarter_of_the_pixel() -> None:
    """The image of twice the size has its pixels' centres there."""
    large = replace(SCENE, camera=replace(SCENE.camera, width=2 * SCENE.camera.width, height=2 * SCENE.camera.height))
    expected = ORACLE.render(large, [Stage.DISTANCE])[Stage.DISTANCE][::2, 1::2]

    found = images((0.25, -0.25))[Stage.DISTANCE]

    assert np.allclose(found, expected, rtol=1e-6)


def test_a_program_is_judged_where_it_says_that_it_samples() -> None:
    declared = Capabilities(sample_offset=(*PLACE, 0.0))

    assert judged(declared, images(PLACE)).outcome is Outcome.PASS
    assert judged(declared, images((0.0, 0.0))).outcome is Outcome.FAIL
    assert judged(Capabilities(), images(PLACE)).outcome is Outcome.FAIL


@pytest.mark.parametrize(("radius", "outcome"), [(2.0**-11, Outcome.PASS), (2.0**-13, Outcome.FAIL)])
def test_samples_may_lie_within_the_radius(radius: float, outcome: Outcome) -> None:
    """Blender Cycles samples 1/2048 px off the centre."""
    answers = images((0.0, 2.0**-11))

    assert judged(Capabilities(sample_offset=(0.0, 0.0, radius)), answers).outcome is outcome


def test_the_program_gets_the_scene_without_the_place_of_its_samples() -> None:
    able = capabilities_of({"protocol": STAYS, "sample_offset": [*PLACE, 0.001]}, STAYS)
    scene = able.asked(SCENE)

    assert scene.camera.sample_offset == PLACE
    assert scene_from_json(scene_to_json(scene), None, "scene") == scene
    assert scene_to_json(able.handed(scene)) == scene_to_json(SCENE)


@pytest.mark.references
def test_radiance_samples_where_the_oracle_does() -> None:
    if (why := Radiance.missing()) is not None:
        pytest.skip(why)
    scene = replace(SCENE, camera=moved(SCENE.camera, PLACE))

    for samples in (1, 2):
        mine, other = (
            one.render(scene, [Stage.RADIANCE], samples=samples)[Stage.RADIANCE] for one in (ORACLE, Radiance())
        )
        # One pixel in a thousand may lie on an edge.
        assert np.isclose(mine, other, rtol=1e-5, atol=1e-6).mean() > 0.999
