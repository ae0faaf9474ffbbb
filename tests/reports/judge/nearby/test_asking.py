"""Which pixels are asked, and what becomes of those that are not."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Cube, Mesh
from rayproof.cases.stages import Stage
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.nearby import explaining
from rayproof.reports.judge.nearby.explaining import MOST_ASKED
from tests.reports.judge.nearby.scenes import netted
from tests.reports.judge.scenes import CASE, FLOOR, against, followed, rounded, truth_of_scene

(FANS,) = (case.scene for case in select(["watertight/fans"]))


def hubs() -> list[tuple[int, int]]:
    """Return the pixels whose rays go through the hub of a fan of many triangles."""
    mesh = FANS.shapes[0]
    assert isinstance(mesh, Mesh)
    truth = truth_of_scene(FANS).truth
    used, counts = np.unique(mesh.faces, return_counts=True)
    found = []
    for vertex in used[counts > 16]:
        away = mesh.vertices[vertex].astype(np.float64) - np.asarray(FANS.camera.eye)
        angle = truth[Stage.RAY] @ (away / np.linalg.norm(away))
        row, column = np.unravel_index(int(angle.argmax()), angle.shape)
        if 1 - angle[row, column] < 1e-12:
            found.append((int(row), int(column)))
    return found


def faces_at(pixel: tuple[int, int]) -> np.ndarray:
    """Return the faces of the fan around a pixel's hub."""
    mesh, truth = FANS.shapes[0], truth_of_scene(FANS).truth
    assert isinstance(mesh, Mesh)
    hub = mesh.faces[int(truth[Stage.OBJECT][(*pixel, 1)])][0]
    return np.flatnonzero((mesh.faces == hub).any(axis=1))


def naming_at(places: dict[tuple[int, int], int]) -> dict:
    """Return the objects of a renderer that names other faces in some pixels."""
    objects = truth_of_scene(FANS).truth[Stage.OBJECT].copy()
    for pixel, face in places.items():
        objects[pixel] = 0.0, face
    return {Stage.OBJECT: objects}


def test_each_thin_face_at_the_hub_of_a_fan_is_found_however_few_problems_there_are(monkeypatch):
    monkeypatch.setattr(explaining, "ROUNDS", (1, 1, 1))
    monkeypatch.setattr(explaining, "AGAIN", 1)
    pixel = max(hubs(), key=lambda pixel: len(faces_at(pixel)))
    faces = faces_at(pixel)

    assert len(faces) > 100
    for face in faces[::29]:
        found = against(FANS, naming_at({pixel: int(face)})).end_to_end[Stage.OBJECT]
        assert found.kinds[pixel] != Kind.WRONG, face


def test_where_some_that_were_asked_are_wrong_all_of_them_count():
    scene = netted(width=32, height=24)
    truth = truth_of_scene(scene).truth
    missed = followed(scene, truth, Stage.OBJECT, np.broadcast_to([1.0, 0.0], truth[Stage.OBJECT].shape))

    found = against(scene, {stage: missed[stage] for stage in (Stage.RAY, Stage.OBJECT)}).end_to_end[Stage.OBJECT]

    assert found.kinds.size > MOST_ASKED
    assert np.count_nonzero(found.wrong) == found.kinds.size


@pytest.mark.parametrize(("far", "lost"), [(1e8, True), (0.0, False)])
def test_where_rounding_turns_rays_by_more_than_the_image_is_large_nothing_is_examined(far, lost):
    shifted = ((1.0, 0.0, 0.0, far), (0.0, 1.0, 0.0, -far), (0.0, 0.0, 1.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    camera = replace(CASE.scene.camera, eye=(far + 3.0, -far - 4.0, 2.5), target=(far, -far, 0.3))
    scene = replace(CASE.scene, camera=camera, shapes=(Cube(albedo=(0.5, 0.5, 0.5), to_world=shifted), FLOOR))
    truth = truth_of_scene(scene).truth
    rolled = rounded(truth | {Stage.NORMAL: np.roll(truth[Stage.NORMAL], 3, axis=0)})
    mine = against(scene, rolled)
    found = mine.end_to_end[Stage.NORMAL].kinds[mine.over(Stage.NORMAL)]

    assert len(found) > 20
    assert (mine.reach.image > sum(mine.reach.image.shape)).all() == lost
    assert ((found == Kind.UNEXAMINED).all(), (found == Kind.WRONG).any()) == (lost, not lost)
