"""At a shadow's edge each light counts wholly or not at all, however many there are."""

import numpy as np
import pytest

from rayproof.cases.scene import Scene, Square
from rayproof.cases.stages import Stage
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from tests.reports.judge.nearby.scenes import GREY, MIDDLE, above, lamp, level
from tests.reports.judge.scenes import ORACLE, against, kind, put, rounded, truth_of_scene

LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
BLOCKER = Square(albedo=GREY, to_world=((2, 0, 0, -1), (0, 8, 0, 0), (0, 0, 1, 2), (0, 0, 0, 1)))
SINGLE, COUNTS = 1, (10, 20)


def scene_of(count: int) -> Scene:
    """Return a floor on which the shadows of so many lights end together, on the middle pixel's ray."""
    generator = np.random.default_rng(count)
    lights = tuple(lamp(0.0, 0.0, 4.0, flux=tuple(generator.uniform(10.0, 90.0, 3).tolist())) for _ in range(count))
    return above(level(0.0, 0.0, 0.0, side=16.0), BLOCKER, height=1.0, lights=lights)


def shares(scene: Scene) -> np.ndarray:
    """Return each light's own part of the middle pixel's radiance, (lights, 3)."""
    parts = []
    for light in scene.lights:
        alone = above(*scene.shapes[:1], height=1.0, lights=(light,))
        parts.append(ORACLE.render(alone, stages_of(alone))[Stage.RADIANCE][MIDDLE])
    return np.array(parts)


def judged(scene: Scene, value) -> Kind:
    """Return the kind of a radiance in the middle pixel, of a program that shows nothing else."""
    image = put(truth_of_scene(scene).truth[Stage.RADIANCE], MIDDLE, value)
    return kind(scene, rounded({Stage.RADIANCE: image}), Stage.RADIANCE, MIDDLE)


@pytest.mark.parametrize("stage", LIGHT)
def test_a_light_counts_wholly_or_not_at_all(stage):
    scene = scene_of(SINGLE)
    truth = truth_of_scene(scene).truth
    lit = truth[stage][MIDDLE[0], MIDDLE[1]].max() > 0
    whole = truth[stage][MIDDLE] if lit else truth[stage][MIDDLE[0], MIDDLE[1] + 1]
    found = []
    for part in (0.0, 0.5, 1.0):
        image = put(truth[stage], MIDDLE, part * whole)
        found.append(kind(scene, rounded(truth | {stage: image}), stage, MIDDLE, chained=False))

    assert found[1] is Kind.WRONG
    assert found[0] is not Kind.WRONG
    assert not lit or found[2] is not Kind.WRONG


def test_all_channels_come_from_one_choice_of_lights():
    scene = scene_of(2)
    first, second = shares(scene)

    assert [judged(scene, value) for value in (first, second)] == [Kind.ROUNDING] * 2
    assert judged(scene, (first[0], second[1], second[2])) is Kind.WRONG


@pytest.mark.parametrize("staged", [True, False], ids=["staged", "radiance-alone"])
def test_garbage_at_every_shadows_edge_is_wrong(staged):
    scene = scene_of(SINGLE)
    truth = truth_of_scene(scene).truth
    column = np.arange(truth[Stage.OBJECT].shape[1]) == MIDDLE[1]
    seen = (column & np.ones(truth[Stage.OBJECT].shape[:2], dtype=bool))[..., np.newaxis]
    spoilt = {stage: np.where(seen, 1e30, truth[stage]) for stage in LIGHT}
    ours = rounded(truth | spoilt) if staged else {Stage.RADIANCE: spoilt[Stage.RADIANCE]}

    for stage, pixels in against(scene, ours, chained=False).end_to_end.items():
        assert np.count_nonzero(pixels.wrong) == (seen.sum() if stage in LIGHT else 0)
