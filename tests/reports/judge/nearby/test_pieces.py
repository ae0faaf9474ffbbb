"""Between two nearby answers lies a right one only where both are of one smooth piece of the object that is named."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.sentinels import BORDER, EDGE_CASE, SIDE, edge_scene
from tests.reports.judge.nearby.scenes import MIDDLE, above, edge_on, flipped, lamp, level
from tests.reports.judge.scenes import ORACLE, followed, kind, kinds, naming, put, rounded, seen_around, truth_of_scene

EDGE = edge_on()


def test_at_a_cubes_edge_either_side_is_seen_and_nothing_between():
    truth, around = truth_of_scene(EDGE).truth, list(seen_around(EDGE, MIDDLE))
    sides = {
        tuple(np.round(normal, 6)): normal
        for normal in (truth[Stage.NORMAL][MIDDLE[0], MIDDLE[1] + beside] for beside in (-1, 1))
    }
    between = sum(sides.values())

    assert len(sides) == 2
    assert around
    for normal in sides.values():
        ours = followed(EDGE, truth, Stage.NORMAL, put(truth[Stage.NORMAL], MIDDLE, normal))
        assert Kind.WRONG not in kinds(EDGE, ours, MIDDLE).values()
    for wrong in (between / np.linalg.norm(between), between / 2):
        ours = rounded(truth | {Stage.NORMAL: put(truth[Stage.NORMAL], MIDDLE, wrong)})
        assert kind(EDGE, ours, Stage.NORMAL, MIDDLE) is Kind.WRONG


def test_at_a_cubes_edge_light_is_that_of_a_side():
    truth = truth_of_scene(EDGE).truth
    sides = [truth[Stage.RADIANCE][MIDDLE[0], MIDDLE[1] + beside] for beside in (-1, 1)]
    values = {}
    for normal, name in ((truth[Stage.NORMAL][MIDDLE[0], MIDDLE[1] + beside], beside) for beside in (-1, 1)):
        ours = followed(EDGE, truth, Stage.NORMAL, put(truth[Stage.NORMAL], MIDDLE, normal))
        values[name] = ours[Stage.RADIANCE][MIDDLE]

    def of(value: np.ndarray) -> Kind:
        image = {Stage.RADIANCE: put(truth[Stage.RADIANCE], MIDDLE, value)}
        return kind(EDGE, rounded(image), Stage.RADIANCE, MIDDLE)

    assert abs(sides[0] - sides[1]).min() > 0.1 * max(sides[0].max(), sides[1].max())
    assert Kind.WRONG not in [of(value) for value in values.values()]
    between = (values[-1] + values[1]) / 2
    assert [of(value) for value in (between, 0.5 * max(values.values(), key=np.max))] == [Kind.WRONG] * 2


@pytest.mark.parametrize("stage", [Stage.VISIBILITY, Stage.IRRADIANCE, Stage.RADIANCE])
def test_of_a_renderer_that_names_an_object_only_that_objects_light_is_right(stage):
    # The square lies over the plane, whose lamp below the square lights nothing above it.
    scene = replace(EDGE_CASE.scene, lights=(lamp(0.3, 0.2, 6.0), lamp(3.0, 0.5, -0.2)))
    square, plane = (
        rounded(ORACLE.render(replace(scene, shapes=edge_scene(SIDE * part).shapes), stages_of(scene)))
        for part in (1 + 1e-9, 1 - 1e-9)
    )
    # What the oracle itself shows is within its limits whatever is named: a renderer names that, lit as the other is.
    shown = truth_of_scene(scene).truth[Stage.OBJECT][(*BORDER, 0)]
    own, other = (square, plane) if shown == 0 else (plane, square)
    mixed = own | {stage: other[stage]}

    assert np.any(square[stage][BORDER] != plane[stage][BORDER])
    assert Kind.WRONG not in kinds(scene, square, BORDER).values()
    assert Kind.WRONG not in kinds(scene, plane, BORDER).values()
    assert kind(scene, mixed, stage, BORDER) is Kind.WRONG
    assert kind(scene, mixed, stage, BORDER, chained=False) is not Kind.WRONG
    if stage is Stage.RADIANCE:
        assert kind(scene, {stage: other[stage]}, stage, BORDER) is not Kind.WRONG


class Creased(Analytic):
    """An oracle to whom the plane through the origin is creased along x = 0: one piece, and two normals."""

    def outward_normals(self, scene, index, positions, faces):
        """Return normals that lean to either side."""
        lean = np.where(positions[:, :1] > 0, 0.05, -0.05) * np.array([1.0, 0.0, 0.0])
        normals = super().outward_normals(scene, index, positions, faces) + lean
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_pixel_in_which_nothing_but_the_normal_changes_is_asked_about_as_well():
    oracle, scene = Creased(), above(level(0.0, 0.0, 0.0, side=16.0), lights=(lamp(0.3, 0.2, 6.0),))
    truth = truth_of_scene(scene, oracle).truth
    other = truth[Stage.NORMAL][MIDDLE] * (-1.0, 1.0, 1.0)
    ours = rounded(truth | {Stage.NORMAL: put(truth[Stage.NORMAL], MIDDLE, other)})

    assert kind(scene, ours, Stage.NORMAL, MIDDLE, oracle=oracle) is Kind.ROUNDING
    beside = MIDDLE[0], MIDDLE[1] - 1
    ours = rounded(truth | {Stage.NORMAL: put(truth[Stage.NORMAL], beside, other)})
    assert kind(scene, ours, Stage.NORMAL, beside, oracle=oracle) is Kind.WRONG


LIT = lamp(0.6, 0.8, 4.0)
BACK_TO_BACK = above(level(0, 0, 0), flipped(level(0, 0, 0)), level(0, 0, -1, side=16.0), lights=(LIT,))


@pytest.mark.parametrize("shape", [0.0, 1.0])
def test_of_coinciding_faces_either_is_right_with_the_light_that_it_has_itself(shape):
    ours, other = naming(BACK_TO_BACK, MIDDLE, shape), naming(BACK_TO_BACK, MIDDLE, 1.0 - shape)

    assert ours[Stage.RADIANCE][MIDDLE].any() == (shape == 0)
    assert Kind.WRONG not in kinds(BACK_TO_BACK, ours, MIDDLE).values()
    # The oracle names the first, whose values are within their limits whatever is named.
    for stage in (Stage.NORMAL, Stage.VISIBILITY, Stage.IRRADIANCE, Stage.RADIANCE) if shape == 0 else ():
        assert kind(BACK_TO_BACK, ours | {stage: other[stage]}, stage, MIDDLE) is Kind.WRONG
    assert kind(BACK_TO_BACK, naming(BACK_TO_BACK, MIDDLE, 2.0), Stage.OBJECT, MIDDLE) is Kind.WRONG
