"""The family's rays meet its vertices and edges as nearly as float64 can tell, and it sorts formulas by their leaks."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import cases_of
from rayproof.cases.families.watertight import ORIGIN, camera, net
from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import of_what_is_supported
from rayproof.reports.results.outcomes import Outcome
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.render import render
from tests.reports.judge.scenes import candidate, witness

ORACLE = Analytic()
CASES = {case.name.partition("/")[2]: case for case in cases_of("watertight")}
TRIANGLES = [formula for formula in FORMULAS.variants("triangle") if formula.kind == "right"]


def nearness(case: Case) -> np.ndarray:
    """Return each pixel's smallest barycentric coordinate, and smallest but one, in the face that it sees, (n, 2)."""
    found = ORACLE.render(case.scene, [Stage.RAY, Stage.OBJECT])
    objects, rays = found[Stage.OBJECT].reshape(-1, 2).astype(int), found[Stage.RAY].reshape(-1, 3)
    eye, parts = np.asarray(case.scene.camera.eye), []
    for index, shape in enumerate(case.scene.shapes):
        here = objects[:, 0] == index
        if hasattr(shape, "faces") and here.any():
            corners = world_triangles(shape).astype(np.float64)[objects[here, 1]] - eye
            volumes = [np.cross(corners[:, k], corners[:, k - 2]) for k in (1, 2, 0)]
            areas = np.abs(np.stack([(rays[here] * each).sum(axis=1) for each in volumes], axis=1))
            parts.append(np.sort(areas / areas.sum(axis=1, keepdims=True), axis=1)[:, :2])
    return np.concatenate(parts)


@pytest.mark.parametrize(
    ("name", "at_edges", "at_vertices"),
    [
        ("vertices", 58, 58),
        ("vertices_far_away", 58, 58),
        ("middles", 58, 0),
        ("middles_far_away", 58, 0),
        ("fans", 41, 5),
        ("diagonal", 28, 0),
        ("whole_metres", 100, 1),
    ],
)
def test_rays_meet_inner_edges_and_vertices_to_a_trillionth_and_few_others_do(name, at_edges, at_vertices):
    near, view = nearness(CASES[name]), CASES[name].scene.camera

    assert (near[:, 0] < 1e-12).sum() >= at_edges
    assert (near < 1e-12).all(axis=1).sum() >= at_vertices
    # In float32 only they are undecided, however the others lie.
    assert (near[:, 0] < 1e-4).sum() <= 0.1 * view.width * view.height


def test_shadow_rays_meet_the_vertices_before_the_light():
    scene = CASES["shadow_rays"].scene
    positions = ORACLE.render(scene, [Stage.POSITION])[Stage.POSITION].reshape(-1, 3)
    shaded = positions[ORACLE.render(scene, [Stage.VISIBILITY])[Stage.VISIBILITY].ravel() == 0]
    light = np.asarray(scene.lights[0].position)
    vertices = world_triangles(scene.shapes[1]).reshape(-1, 3).astype(np.float64) - light
    units = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)

    shadow_rays = (shaded - light) / np.linalg.norm(shaded - light, axis=1, keepdims=True)
    sines = np.linalg.norm(np.cross(shadow_rays[:, np.newaxis], units[np.newaxis]), axis=2).min(axis=1)

    assert len(shaded) == 18 * 18
    assert sines.max() < 1e-14


def lost(scene: Scene, formula: str) -> int:
    """Return how many pixels see another shape than the mesh that surrounds them."""
    truth = ORACLE.render(scene, [Stage.OBJECT])[Stage.OBJECT][..., 0]
    seen = render(scene, [Stage.OBJECT], Configuration(formulas={"triangle": formula}))[Stage.OBJECT][..., 0]
    return int((seen != truth).sum())


@pytest.mark.parametrize("formula", TRIANGLES, ids=lambda formula: formula.variant)
def test_a_formula_leaks_if_and_only_if_it_says_so(formula):
    dense = net(ORIGIN, width=64, height=48, thirds=1.0, across=(1.0, 0.0), upward=(0.0, 1.0), relief=1 / 128)
    scenes = (
        Scene(camera=camera(ORIGIN, width=64, height=48, far=32.0), shapes=(dense,)),
        *(CASES[name].scene for name in ("middles", "middles_far_away", "vertices_far_away")),
    )

    assert (sum(lost(scene, formula.variant) for scene in scenes) > 0) == (formula.leaks is not None)


@pytest.mark.parametrize("alone", [False, True], ids=["by-all-stages", "by-radiance-alone"])
@pytest.mark.parametrize("formula", ["moeller_trumbore"])
def test_a_formula_that_leaks_fails(formula, alone):
    case = CASES["middles"]
    stages = stages_of(case.scene)
    answers = render(case.scene, stages, Configuration(formulas={"triangle": formula}))
    asked = {Stage.RADIANCE: answers[Stage.RADIANCE]} if alone else answers
    given = replace(candidate(asked), unsupported={one: "It has none." for one in stages if one not in asked})

    found = judge_case(case, [given], [witness(ORACLE.render(case.scene, stages))], ORACLE, {})

    assert of_what_is_supported(found, [given]).outcome is Outcome.FAIL
