"""Factors that pixels share: seen far below a pixel's own limit, and never in what rounding does in any order."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Cube, PointLight, Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.forward.common_factors import LEAST_DISTINCT, Factors
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.results.case_records import FactorGroup
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.pooled_factors import PooledFactors, wrong
from tests.reports.judge.scenes import (
    BALL,
    CAMERA,
    CASE,
    FLOOR,
    LIGHT,
    ORACLE,
    SCENE,
    against,
    candidate,
    rounded,
    witness,
)

F = np.float32
PI = F(np.pi)
LIGHT_STAGES = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
TURNED = ((0.8, -0.6, 0.0, 1.7), (0.6, 0.8, 0.0, 0.2), (0.0, 0.0, 1.0, -0.2), (0.0, 0.0, 0.0, 1.0))
BOX = Cube(albedo=(0.61, 0.37, 0.83), to_world=TURNED)
SHEET = Square(albedo=(0.3, 0.9, 0.5), to_world=((3, 0, 0, 0.7), (0, 3, 0, 0.9), (0, 0, 1, -0.3), (0, 0, 0, 1)))
OTHER = PointLight(position=(2.9, 1.3, 3.1), flux=(37.0, 91.0, 55.0))
FINE = replace(CAMERA, width=64, height=48)
TWO_LIGHTS = Scene(camera=FINE, shapes=(BALL, FLOOR, BOX, SHEET), lights=(LIGHT, OTHER))
SIMPLIFIED = replace(TWO_LIGHTS, shading="simplified")
SCENES = {"one-light": replace(SCENE, camera=FINE), "two-lights": TWO_LIGHTS, "simplified": SIMPLIFIED}


def in_float32(vector) -> tuple:
    """Return nested numbers, each rounded once to float32."""
    return tuple(in_float32(one) if isinstance(one, tuple) else float(F(one)) for one in vector)


def as_float32(scene: Scene) -> Scene:
    """Return the scene as a float32 program reads it: every datum rounded once."""
    camera = replace(scene.camera, **{n: in_float32(getattr(scene.camera, n)) for n in ("eye", "target", "up")})
    shapes = tuple(replace(s, albedo=in_float32(s.albedo), to_world=in_float32(s.to_world)) for s in scene.shapes)
    lights = tuple(PointLight(position=in_float32(one.position), flux=in_float32(one.flux)) for one in scene.lights)
    return replace(scene, camera=camera, shapes=shapes, lights=lights)


def quotient(scene: Scene, answers: dict, light: int) -> tuple[np.ndarray, ...]:
    """Return flux, n.d and r^2 of a light in float32; positions are the rays' own, eye + t d."""
    hit = answers[Stage.OBJECT][..., :1] >= 0
    t = np.where(hit, answers[Stage.DISTANCE], 0).astype(F)
    position = np.asarray(scene.camera.eye, F) + t * answers[Stage.RAY].astype(F)
    towards = np.asarray(scene.lights[light].position, F) - position
    x, y, z = (towards[..., axis] for axis in range(3))
    along = (answers[Stage.NORMAL].astype(F) * towards).sum(axis=-1, dtype=F)
    return np.asarray(scene.lights[light].flux, F), along[..., None], (z * z + (y * y + x * x))[..., None]


def by_definition(flux, along, square):
    return flux * (along / np.sqrt(square)) / (4 * PI * square)


def by_intensity(flux, along, square):
    return (flux * (1 / (4 * PI))) * (along / (square * np.sqrt(square)))


def by_inverse_root(flux, along, square):
    inverse = 1 / np.sqrt(square)
    return flux * (F(0.25) / PI) * (along * inverse) * inverse * inverse


ORDERS = {"definition": by_definition, "intensity": by_intensity, "inverse-root": by_inverse_root}
# Albedo and pi, applied in three orders: exitance first, folded into one constant, or radiance first.
FOLDS = {
    "exitance-first": lambda e, albedo: (albedo * e, (albedo * e) / PI),
    "folded": lambda e, albedo: (albedo * e, e * (albedo * (1 / PI))),
    "radiance-first": lambda e, albedo: ((e * (albedo / PI)) * PI, e * (albedo / PI)),
}


def float32_program(scene: Scene, order: str = "definition", fold: str = "exitance-first") -> dict:
    """Return a correct float32 renderer's answers, its light made in the named orders."""
    own = as_float32(scene)
    answers = rounded(ORACLE.render(own, stages_of(own)))
    table = np.array([*(shape.albedo for shape in own.shapes), (0, 0, 0)], F)
    albedo = table[answers[Stage.OBJECT][..., 0].astype(int)]
    arriving = np.zeros_like(albedo)
    with np.errstate(divide="ignore", invalid="ignore"):
        for light in range(len(own.lights)):
            flux, along, square = quotient(own, answers, light)
            simple = flux * np.minimum(along / np.sqrt(square), F(1))
            part = simple if own.shading == "simplified" else ORDERS[order](flux, along, square)
            arriving = arriving + np.where(answers[Stage.VISIBILITY][..., light, None] > 0, part, F(0))
        leaving, seen = FOLDS[fold](arriving, albedo)
    seen = leaving if own.shading == "simplified" else seen
    images = (arriving, leaving, np.where(answers[Stage.RADIANCE] > 0, seen, F(0)))
    return answers | {stage: image.astype(np.float64) for stage, image in zip(LIGHT_STAGES, images, strict=True)}


def judged(scene: Scene, answers: dict, **more):
    """Judge a candidate on a scene against the oracle alone."""
    case = replace(CASE, scene=scene)
    return judge_case(
        case, [replace(candidate(answers), **more)], [witness(ORACLE.render(scene, stages_of(scene)))], ORACLE, {}
    )


def alone(scene: Scene, image: np.ndarray):
    """Judge a program that shows its radiance and nothing else."""
    others = {stage: "It wrote no channel of it." for stage in stages_of(scene) if stage is not Stage.RADIANCE}
    return judged(scene, {Stage.RADIANCE: image}, unsupported=others, chained=False)


def check_of(found, stage: Stage):
    """Return the check of one stage."""
    return next(check for check in found.checks if check.stage is stage)


def factors_of(scene: Scene, answers: dict, stage: Stage) -> Factors:
    """Return all factors of a candidate's stage, of which a check tells some."""
    return against(scene, answers).common_factors.of(stage)


def over(group: FactorGroup) -> list[int]:
    """Return the channels in which a group is over its limit."""
    both = enumerate(zip(group.off, group.sees, strict=True))
    return [channel for channel, (off, sees) in both if off is not None and sees is not None and abs(off) > sees]


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("order", "fold"), list(zip(ORDERS, FOLDS, strict=True)))
def test_a_correct_renderer_shows_no_factor_in_whatever_order_it_multiplies(name, order, fold):
    answers = float32_program(SCENES[name], order, fold)

    chained, passes = judged(SCENES[name], answers), judged(SCENES[name], answers, chained=False)

    for found in (chained, passes):
        assert found.outcome is Outcome.PASS, found.reason
        for stage in LIGHT_STAGES:
            bias = check_of(found, stage).bias
            assert bias is not None
            assert bias.continued is not None
            assert bias.ratio < 0.5, bias.groups
            assert bias.continued.ratio < 1
            assert len(factors_of(SCENES[name], answers, stage).factors) >= 3 * len(SCENES[name].shapes)


def test_a_pi_that_is_off_after_four_digits_shows_in_radiance_alone():
    scene = SCENES["one-light"]
    image = float32_program(scene)[Stage.RADIANCE]

    found = alone(scene, (image.astype(F) * (PI / F(3.14152))).astype(np.float64))

    assert alone(scene, image).outcome is not Outcome.FAIL
    assert found.outcome is Outcome.FAIL
    measured = check_of(found, Stage.RADIANCE).end_to_end
    assert measured is not None
    assert measured.worst_ratio <= 1, "no pixel shows it"
    assert "radiance of shape " in found.reason
    assert "under light 0 is 1.0000" in found.reason


@pytest.mark.parametrize("stage", LIGHT_STAGES, ids=str)
def test_a_factor_is_blamed_on_the_stage_that_brings_it_in(stage):
    scene = SCENES["one-light"]
    answers = float32_program(scene)
    for after in LIGHT_STAGES[LIGHT_STAGES.index(stage) :]:
        answers[after] = (answers[after] * (1 + 3e-6)).astype(F).astype(np.float64)

    found = judged(scene, answers)

    assert (found.outcome, found.stage) == (Outcome.FAIL, stage)
    assert [one.stage for one in found.checks if one.alone] == [stage]
    both = [check_of(found, each).bias.continued.ratio for each in LIGHT_STAGES]
    assert [ratio > 1 for ratio in both] == [each is stage for each in LIGHT_STAGES]


def test_of_two_lights_in_the_same_pixels_the_one_with_the_wrong_flux_is_named():
    scene = TWO_LIGHTS
    wrong = replace(scene, lights=(LIGHT, replace(OTHER, flux=(37.0, 91.0 * (1 + 4e-5), 55.0))))

    found = judged(scene, float32_program(wrong))

    told = check_of(found, Stage.IRRADIANCE).bias.continued.groups
    assert {(group.fitted, channel) for group in told if group.fitted is not None for channel in over(group)} == {
        (1, 1)
    }
    assert found.outcome is Outcome.FAIL


def test_a_record_holds_the_group_that_is_nearest_to_its_limit_and_each_where_one_is_over():
    scene = SCENES["one-light"]
    doubled = float32_program(scene)
    for stage in LIGHT_STAGES:
        doubled[stage] = doubled[stage] * 2

    right = check_of(judged(scene, float32_program(scene)), Stage.IRRADIANCE).bias
    wrong = check_of(judged(scene, doubled), Stage.IRRADIANCE).bias

    assert right.groups is not None
    assert wrong.groups is not None
    assert len(right.groups) == 1
    assert {group.shape for group in wrong.groups} == {0, 1}
    for group in (*right.groups, *wrong.groups):
        assert group.pixels >= LEAST_DISTINCT
        assert group.lights == (0,)
    (nearest,) = right.groups
    ratios = [abs(off) / sees for off, sees in zip(nearest.off, nearest.sees, strict=True)]
    assert max(ratios) == pytest.approx(right.ratio, rel=1e-2)
    assert right.sees <= min(nearest.sees)
    assert wrong.sees == min(sees for group in wrong.groups for sees in group.sees)


def off_where_wide(name: str, part: float) -> dict:
    """Return float32 answers to a case of the suite, lit too brightly by a part of the limit where that is wide."""
    (case,) = select([name])
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    ours = rounded(truth)
    limits = against(case.scene, ours).limits.end_to_end
    for stage in LIGHT_STAGES:
        wide = np.any(limits[stage] > 0.01 * truth[stage], axis=-1, keepdims=True)
        ours[stage] = (ours[stage] + part * limits[stage] * wide).astype(F).astype(np.float64)
    return ours


def judged_case(name: str, answers: dict):
    """Judge a float32 program of passes of its own on a case of the suite."""
    (case,) = select([name])
    truth = witness(ORACLE.render(case.scene, stages_of(case.scene)))
    return judge_case(case, [replace(candidate(answers), chained=False)], [truth], ORACLE, {})


def test_light_that_is_off_by_most_of_its_limit_shows_where_many_limits_are_wide():
    name = "shadows/behind_the_light"

    right, spoilt = (judged_case(name, off_where_wide(name, part)) for part in (0.0, 0.9))

    assert right.outcome is Outcome.PASS, right.reason
    assert (spoilt.outcome, spoilt.stage) == (Outcome.FAIL, Stage.IRRADIANCE)
    assert "pixels with wide limits" in spoilt.reason


def test_light_that_is_off_by_most_of_few_wide_limits_shows_in_the_whole_run():
    names = ("acne/from_afar", "transforms/sphere_sheared", "primitives/sphere", "acne/terminator")
    told = {}
    for part in (0.0, 0.9):
        factors = PooledFactors()
        for name in names:
            found = judged_case(name, off_where_wide(name, part))
            assert found.outcome is Outcome.PASS, found.reason
            factors.add({"name": name, "checks": [check.recorded() for check in found.checks]})
        told[part] = factors.wide

    for entry in told[0.0]:
        assert (entry["verdict"], entry["above"], entry["below"]) == ("pass", 0, 0)
    for entry in told[0.9]:
        assert (entry["verdict"], entry["above"]) == ("fail", entry["pixels"])
    assert "is too large in" in wrong([], told[0.9])[0]
