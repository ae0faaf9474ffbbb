"""Where faces of one mesh surround a pixel's point one of them is seen, however many pixels are edges."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import cases_of
from rayproof.cases.families.watertight import ORIGIN, beside, camera, net, wall
from rayproof.cases.scene import Mesh, PointLight, Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import of_what_is_supported
from rayproof.reports.results.outcomes import Outcome
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.render import render
from tests.reports.judge.scenes import ORACLE, candidate, rounded, witness

WIDTH, HEIGHT = 24, 16
MESH = net(ORIGIN, width=WIDTH, height=HEIGHT, thirds=1.0, across=(1.0, 0.0), upward=(0.0, 1.0), relief=1 / 128)
SCENE = Scene(
    camera=camera(ORIGIN, width=WIDTH, height=HEIGHT, far=32.0),
    shapes=(MESH, wall(ORIGIN, 6.0)),
    lights=(beside(ORIGIN, 1.0, 300.0),),
)
PIXEL = (7, 11)


def case_of(scene: Scene) -> Case:
    """Return a scene that nobody tuned: so many pixels are edges that little of it can be decided."""
    return Case(
        name="test/net",
        scene=scene,
        stresses="A vertex on each ray.",
        covers=("HIT-5",),
        least_interior=0,
        most_explained=0.5,
        tuned=False,
    )


def truth_of(scene: Scene) -> dict:
    return ORACLE.render(scene, stages_of(scene))


def outcome(scene: Scene, ours: dict) -> tuple[Outcome, Stage | None]:
    given = replace(candidate(ours), unsupported={one: "It has none." for one in stages_of(scene) if one not in ours})
    found = judge_case(case_of(scene), [given], [witness(truth_of(scene))], ORACLE, {})
    found = of_what_is_supported(found, [given])
    return found.outcome, found.stage


def with_object(scene: Scene, shape: float, face: float, where: tuple[int, int] = PIXEL) -> dict:
    """Return a float32 renderer's answers that sees another object in one pixel, and what follows from it."""
    ours = truth_of(scene)
    ours[Stage.OBJECT] = ours[Stage.OBJECT].copy()
    ours[Stage.OBJECT][where] = (shape, face)
    for stage in list(Stage)[list(Stage).index(Stage.OBJECT) + 1 :]:
        ours[stage] = ORACLE.continue_from(scene, stage, ours)
    return rounded(ours)


def test_each_face_at_a_vertex_may_be_seen():
    row, column = PIXEL
    around = ORACLE.surroundings(SCENE, np.array([(column + 0.5, row + 0.5)]), np.array([1e-7]))
    images = tuple(stage for stage in stages_of(SCENE) if stage is not Stage.CAMERA)
    seen = ORACLE.at(SCENE, images, around.places[:, 0])

    assert len(np.unique(seen[Stage.OBJECT], axis=0)) == 6
    for number in range(0, len(around.places), 3):
        ours = truth_of(SCENE)
        for stage in images:
            ours[stage] = ours[stage].copy()
            ours[stage][PIXEL] = seen[stage][number]
        ours = rounded(ours)
        assert outcome(SCENE, ours)[0] is not Outcome.FAIL
        assert outcome(SCENE, {Stage.RADIANCE: ours[Stage.RADIANCE]})[0] is not Outcome.FAIL


@pytest.mark.parametrize(("shape", "face"), [(-1.0, -1.0), (1.0, 0.0)], ids=["a-miss", "the-wall-behind"])
def test_neither_a_miss_nor_what_lies_behind_may(shape, face):
    ours = with_object(SCENE, shape, face)

    assert outcome(SCENE, ours) == (Outcome.FAIL, Stage.OBJECT)
    assert outcome(SCENE, {Stage.RADIANCE: ours[Stage.RADIANCE]}) == (Outcome.FAIL, Stage.RADIANCE)
    assert outcome(SCENE, {Stage.DISTANCE: ours[Stage.DISTANCE]}) == (Outcome.FAIL, Stage.DISTANCE)


def test_the_far_side_of_the_same_mesh_may_not():
    behind = np.concatenate([MESH.vertices, 2 * MESH.vertices])
    faces = np.concatenate([MESH.faces, MESH.faces + len(MESH.vertices)])
    scene = replace(SCENE, shapes=(replace(MESH, vertices=behind, faces=faces),))
    face = truth_of(scene)[Stage.OBJECT][(*PIXEL, 1)] + len(MESH.faces)

    assert outcome(scene, with_object(scene, 0.0, face)) == (Outcome.FAIL, Stage.OBJECT)


def test_cramers_rule_in_float32_leaves_holes_that_fail_by_radiance_alone_too():
    answers = render(SCENE, stages_of(SCENE), Configuration.parse("float32/triangle=moeller_trumbore"))

    assert outcome(SCENE, answers) == (Outcome.FAIL, Stage.OBJECT)
    assert outcome(SCENE, {Stage.RADIANCE: answers[Stage.RADIANCE]}) == (Outcome.FAIL, Stage.RADIANCE)


def of_one_face_less() -> Scene:
    """Return the scene with a face less at the pixel's vertex: what is left ends there."""
    face = int(truth_of(SCENE)[Stage.OBJECT][(*PIXEL, 1)])
    return replace(SCENE, shapes=(replace(MESH, faces=np.delete(MESH.faces, face, axis=0)), SCENE.shapes[1]))


def clipped() -> Scene:
    """Return the scene seen from where the net is before the near plane in places."""
    return replace(SCENE, camera=replace(SCENE.camera, near=3.09))


@pytest.mark.parametrize("make", [of_one_face_less, clipped], ids=["a-rim", "a-clipped-net"])
def test_where_the_mesh_ends_what_lies_behind_may_be_seen(make):
    scene = make()
    around = ORACLE.surroundings(scene, np.array([(PIXEL[1] + 0.5, PIXEL[0] + 0.5)]), np.array([1e-4]))

    assert not around.enclosed[0]
    assert outcome(scene, with_object(scene, 1.0, 0.0))[0] is not Outcome.FAIL


def turned_away() -> Scene:
    """Return the scene with one face at the vertex turned around: from the front it is black."""
    face = int(truth_of(SCENE)[Stage.OBJECT][(*PIXEL, 1)])
    faces = MESH.faces.copy()
    faces[face] = faces[face, ::-1]
    return replace(SCENE, shapes=(replace(MESH, faces=faces), SCENE.shapes[1]))


def unlit() -> Scene:
    """Return the scene under a light so low that some faces are below its horizon."""
    low = PointLight(position=(20.0, 18.0, 2.0), flux=(90000.0, 80000.0, 70000.0))
    return replace(SCENE, lights=(low,))


@pytest.mark.parametrize("make", [turned_away, unlit])
def test_a_face_that_is_dark_may_be_seen_where_another_is_lit(make):
    scene = make()
    radiance = truth_of(scene)[Stage.RADIANCE].copy()
    pixels = ((row, column) for row, column in np.ndindex(HEIGHT, WIDTH) if radiance[row, column].any())
    radiance[next(pixel for pixel in pixels if not _all_lit(scene, *pixel))] = 0.0

    assert outcome(scene, {Stage.RADIANCE: radiance})[0] is not Outcome.FAIL


def _all_lit(scene: Scene, row: int, column: int) -> bool:
    around = ORACLE.surroundings(scene, np.array([(column + 0.5, row + 0.5)]), np.array([1e-4]))
    return bool(ORACLE.at(scene, [Stage.RADIANCE], around.places[:, 0])[Stage.RADIANCE].any(axis=1).all())


def test_a_reference_that_leaks_between_the_faces_before_a_light_has_no_say_there():
    (case,) = (case for case in cases_of("watertight") if case.name == "watertight/feelers")
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    row, column = np.argwhere(truth[Stage.VISIBILITY][..., 0] == 0)[100]
    bright = float(truth[Stage.RADIANCE].max())

    def spoilt(stage: Stage, value: float) -> dict:
        image = truth[stage].copy()
        image[row, column] = value
        return truth | {stage: image}

    for stage, value in ((Stage.VISIBILITY, 1.0), (Stage.RADIANCE, bright)):
        leaking = witness(spoilt(stage, value), name="second", precision="float32")
        right = judge_case(case, [candidate(rounded(truth))], [witness(truth), leaking], ORACLE, {})
        wrong = judge_case(case, [candidate(rounded(spoilt(stage, value)))], [witness(truth), leaking], ORACLE, {})
        assert right.outcome is Outcome.PASS, right.reason
        assert (wrong.outcome, wrong.stage) == (Outcome.FAIL, stage)


def test_a_wrong_word_elsewhere_still_accuses_the_reference():
    (case,) = (case for case in cases_of("watertight") if case.name == "watertight/feelers")
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    row, column = np.argwhere(truth[Stage.VISIBILITY][..., 0] == 1)[100]
    image = truth[Stage.VISIBILITY].copy()
    image[row, column] = 0.0
    others = [witness(truth | {Stage.VISIBILITY: image}, name="second"), witness(truth, name="third")]

    found = judge_case(case, [candidate(rounded(truth))], [witness(truth), *others], ORACLE, {})

    assert found.outcome is Outcome.REFERENCE_SUSPECT
    assert isinstance(case.scene.shapes[1], Mesh)
