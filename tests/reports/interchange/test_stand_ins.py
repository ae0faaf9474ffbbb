"""What is handed over in place of something else has the same image, or is what the case is judged as."""

from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.placement import camera_around, translation
from rayproof.cases.scene import Mesh, Plane, Scene, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange.stand_ins import (
    SPHERE_TRIANGLES,
    NoStandInError,
    is_untouched,
    tessellated,
)
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.run.plan import within_reach
from rayproof.reports.subjects.protocol import Capabilities
from tests.reports.subjects.conftest import GREY, SCENE

REPLACING = {
    "no clip planes": Capabilities(clip=("none",)),
    "clip by depth": Capabilities(clip=("depth",)),
    "both sides": Capabilities(two_sided="always"),
    "one side": Capabilities(two_sided=False),
}


def replaced(able: Capabilities) -> list[Case]:
    """Return the cases of which a program gets a scene that is another one than asked."""
    return [case for case in all_cases() if able.handed(case.scene) != case.scene and able.refusal(case.scene) is None]


@pytest.mark.parametrize(("able", "least"), [*zip(REPLACING.values(), (198, 1, 100, 10), strict=True)], ids=REPLACING)
def test_what_is_replaced_has_the_same_image(able: Capabilities, least: int) -> None:
    cases = replaced(able)

    assert len(cases) >= least
    for case in cases[::5]:
        stages = [stage for stage in able.stages or stages_of(case.scene) if stage in IMAGE_STAGES]
        stages = [stage for stage in stages if stage in stages_of(case.scene)]
        ours, theirs = (Analytic().render(scene, stages) for scene in (case.scene, able.handed(case.scene)))
        for stage in stages:
            assert np.array_equal(ours[stage], theirs[stage], equal_nan=True), (case.name, stage)
        assert able.told(case.scene)


def test_a_program_without_clip_planes_gets_what_no_plane_touches() -> None:
    able = Capabilities(clip=("none",))
    drawn = [case.scene.clip for case in all_cases() if able.refusal(case.scene) is None]

    assert len(drawn) >= 215
    assert drawn.count("shell") == 0


@pytest.mark.parametrize(("planes", "untouched"), [((1.0, 5.0), True), ((1.9999, 5.0), False), ((2.1, 5.0), False)])
def test_planes_that_come_near_are_not_left_out(planes: tuple[float, float], untouched: bool) -> None:
    camera = camera_around((0.0, 0.0, 0.0), distance=3.0, azimuth=0.0, elevation=0.0, width=31, height=31)
    scene = Scene(camera=replace(camera, near=planes[0], far=planes[1]), shapes=(Sphere(albedo=GREY),))

    assert is_untouched(scene, "depth") == untouched


def test_what_is_behind_is_not_cut_and_what_lies_between_pixels_is_looked_at() -> None:
    camera = camera_around((0.0, 0.0, 0.0), distance=3.0, azimuth=0.0, elevation=0.0, width=3, height=3, roll=0.0)
    behind = Sphere(albedo=GREY, to_world=translation(30.0, 0.0, 0.0))
    # It ends beyond the far plane, at a third of a pixel's width from the middle of the image.
    small = Sphere(albedo=GREY, radius=0.1, to_world=translation(-7.0, 0.81, 0.0))
    scene = Scene(camera=replace(camera, far=5.0), shapes=(Sphere(albedo=GREY, radius=0.1), behind))

    assert is_untouched(scene, "depth")
    assert not is_untouched(replace(scene, shapes=(*scene.shapes, small)), "depth")


def test_a_sphere_becomes_a_mesh_with_its_place_and_outward_faces() -> None:
    asked = tessellated(SCENE, ("sphere",), squares=False)

    sphere, mesh = SCENE.shapes[0], asked.shapes[0]
    assert isinstance(sphere, Sphere)
    assert isinstance(mesh, Mesh)
    assert asked.shapes[1:] == SCENE.shapes[1:]
    assert len(mesh.faces) == SPHERE_TRIANGLES == 20480
    outward = mesh.vertices.astype(float) - sphere.center
    assert np.allclose(np.linalg.norm(outward, axis=1), sphere.radius, rtol=1e-6)
    corners = outward[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((normals * corners.mean(axis=1)).sum(axis=1) > 0).all()
    # Closed: each edge belongs to two faces, once in each direction.
    edges = np.concatenate([mesh.faces[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    assert {tuple(edge) for edge in edges.tolist()} == {tuple(edge[::-1]) for edge in edges.tolist()}
    assert len(np.unique(edges, axis=0)) == len(edges)


@pytest.mark.parametrize(
    "case",
    [case for case in all_cases() if any(isinstance(s, Plane) for s in case.scene.shapes)][::4],
    ids=lambda case: case.name,
)
def test_a_square_shows_and_shades_what_its_plane_does(case: Case) -> None:
    try:
        squares = tessellated(case.scene, ("plane",), squares=True)
    except NoStandInError:
        assert case.scene.clip == "none"
        return
    assert not any(isinstance(shape, Plane) for shape in squares.shapes)
    assert sum(isinstance(shape, Square) for shape in squares.shapes) > 0

    stages = [Stage.OBJECT, *([Stage.VISIBILITY] if case.scene.lights else [])]
    ours, theirs = (Analytic().render(scene, stages) for scene in (case.scene, squares))

    assert all((ours[stage] != theirs[stage]).mean() < 0.002 for stage in stages)  # at an edge, by rounding


def test_a_case_is_judged_as_the_meshes_that_were_handed_over() -> None:
    case = select(["primitives/sphere"])[0]
    asked = within_reach(case, Capabilities(shapes=("mesh",)))

    assert isinstance(asked.scene.shapes[0], Mesh)
    assert "HIT-1" in case.covers
    assert not {"HIT-1", "NRM-1"} & {*asked.covers}
    assert "HIT-6" in asked.covers
    assert not asked.expectations
    assert "a mesh of flat triangles for each sphere" in asked.stresses
    # A sphere is drawn by others as it is.
    assert within_reach(case, Capabilities(shapes=("sphere", "mesh"))).scene == case.scene
