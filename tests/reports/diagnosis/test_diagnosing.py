"""What of a run's record a diagnosis goes by."""

import base64
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Camera, Mesh, Plane, PointLight, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis.answering import seen_from_a_surface
from rayproof.reports.diagnosis.diagnosing import _mask, _rounding, _worst
from rayproof.reports.diagnosis.trials import NOTHING, Continued, Evidence
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.comparison import roundoff
from rayproof.reports.judge.forward.limits import CALIBRATED
from tests.reports.checks import recorded


def case(name: str, **failing: int) -> Any:
    """Return a case's record in which each configuration fails so many checks."""
    checks = [recorded(configuration=one, verdict="fail") for one, count in failing.items() for _ in range(count)]
    renders = [{"renderer": f"tracer-{one}", "configuration": one} for one in failing]
    return {"name": name, "checks": [*checks, recorded(configuration="float64")], "renders": renders}


CAMERA = Camera(
    eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=40.0, width=4, height=1, near=0.1, far=100.0
)


def test_who_fails_most_is_diagnosed() -> None:
    cases = [case("a/one", float64=1, float32=2), case("a/two", float64=1, float32=1)]

    assert _worst({"cases": cases}) == ("tracer-float32", "float32")  # type: ignore[typeddict-item]
    assert _worst({"cases": [case("a/one")]}) == (None, "")  # type: ignore[typeddict-item]


@pytest.mark.parametrize(("configuration", "known"), [("float32", True), ("float64", False)])
def test_undecided_pixels_are_those_of_the_configuration_that_they_are_kept_of(configuration: str, known: bool) -> None:
    flags = np.array([[0, 1, 0], [4, 0, 0]], dtype=np.uint8)
    kept = {"configuration": "float32", "height": 2, "width": 3}
    kept["data"] = base64.b64encode(zlib.compress(flags.tobytes())).decode()

    found = _mask({"masks": kept}, configuration)  # type: ignore[typeddict-item]

    assert (found is not None) is known
    if found is not None:
        assert np.array_equal(found, flags > 0)


@pytest.mark.parametrize("name", ["tracer", *CALIBRATED])
@pytest.mark.parametrize("world", [False, True])
def test_a_renderer_is_diagnosed_by_the_rounding_by_which_it_is_judged(name: str, world: bool) -> None:
    # Baked corners of references were left out: their normals were beyond the limits of the diagnosis alone.
    subject = Answers(name=name, precision="float32", world_normals=world)

    diagnosed = _rounding({"subject": name, "declared": {"world_normals": world}})  # type: ignore[typeddict-item]

    assert diagnosed == roundoff(subject)


def test_what_feelers_meet_from_where_two_faces_of_a_mesh_are_is_decided_by_rounding() -> None:
    corners = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 3.0, 0.0), (2.0, 3.0, 0.0)])
    faces = np.array([(0, 1, 2), (1, 2, 0), (2, 4, 3)])  # the first one again, from another corner
    mesh = Mesh(albedo=(0.5, 0.5, 0.5), vertices=corners, faces=faces)
    light = PointLight(position=(0.0, 0.0, 3.0), flux=(1.0, 1.0, 1.0))
    scene = Scene(camera=CAMERA, shapes=(mesh,), lights=(light,))
    objects = np.array([[(0, 0), (0, 1), (0, 2), (-1, -1)]], dtype=float)
    places = np.array([[(0.0, 0.0, 0.0), (0.1, -0.5, 0.0), (0.7, 2.5, 0.0), (9.0, 0.0, 0.0)]])

    found = seen_from_a_surface(scene, {Stage.OBJECT: objects, Stage.RAY: places - (0.0, 0.0, 5.0)})

    assert found.tolist() == [[True, True, False, False]]


def test_a_feeler_along_the_rim_of_an_open_mesh_is_decided_by_rounding() -> None:
    corners = np.array([(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 2.0, 1.0), (-1.0, 2.0, 1.0)])
    sheet = Mesh(albedo=(0.5, 0.5, 0.5), vertices=corners, faces=np.array([(0, 1, 2), (0, 2, 3)]))
    light = PointLight(position=(0.0, 0.0, 3.0), flux=(1.0, 1.0, 1.0))
    eye = (0.0, -4.0, 0.9)  # below the sheet
    scene = Scene(
        camera=replace(CAMERA, eye=eye, up=(0.0, 0.0, 1.0)),
        shapes=(Plane(albedo=(0.5, 0.5, 0.5)), sheet),
        lights=(light,),
    )
    point = np.array([[(-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, -0.5, 0.0)]])  # two below the rim
    own = {
        Stage.RAY: (point - eye) / np.linalg.norm(point - eye, axis=-1, keepdims=True),
        Stage.OBJECT: np.zeros((1, 4, 2)),
        Stage.POSITION: point,
        Stage.NORMAL: np.broadcast_to((0.0, 0.0, 1.0), (1, 4, 3)),
    }
    own[Stage.VISIBILITY] = np.ones((1, 4, 1))
    blank = np.zeros((1, 4), dtype=bool)
    evidence = Evidence(case="rim", scene=scene, load=lambda: own, failed=True, oracle=Analytic(), undecided=blank)

    decided_by_rounding = Continued(evidence=evidence)._by_rounding(NOTHING, Stage.VISIBILITY, own=True)

    assert decided_by_rounding[0].tolist() == [True, True, False, False]
