"""A failing scene becomes as small as what fails in it allows, and what fails stays what it was."""

from dataclasses import replace

import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import Cube, Mesh, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.shrinking.attempts import SearchLimits
from rayproof.reports.shrinking.failure import Renderer, Way, failure, renderer
from rayproof.reports.shrinking.search import shrink
from rayproof.reports.subjects import THE_TRACER
from rayproof.tracer.configuration import Configuration


def scene(name: str) -> Scene:
    (case,) = select([name])
    return case.scene


def tracer(formula: str = "") -> Renderer:
    return renderer(THE_TRACER, Configuration.parse("/".join(["float32", *([formula] if formula else [])])))


def test_of_a_scene_of_five_shapes_the_sphere_is_left_whose_root_is_wrong() -> None:
    found = shrink(scene("shadows/every_blocker"), tracer("sphere=fault_far_root"))

    camera = found.scene.camera
    assert [type(shape) for shape in found.scene.shapes] == [Sphere]
    assert (camera.width, camera.height, found.scene.lights) == (1, 1, ())
    assert all(float(number).is_integer() for number in (*camera.eye, *camera.target))
    assert (found.failure.stage, found.failure.way) == (Stage.DISTANCE, Way.VALUE)
    assert "HIT-1" in found.failure.items
    assert found.tries <= 60


# What one pixel cannot show, one shape, one light: the smallest scene has what it takes.
@pytest.mark.parametrize(
    ("case", "formula", "stage", "shapes", "lights", "pixels"),
    [
        ("primitives/sphere", "half_extent=fault_whole_angle", Stage.RAY, 0, 0, 2),
        ("parallel_rays/flat", "nearest=fault_first", Stage.OBJECT, 2, 0, 1),
        ("several_lights/simplified", "sum_lights=fault_mean", Stage.IRRADIANCE, 1, 2, 1),
        ("transforms/mesh_stretched", "exitance=fault_albedo_squared", Stage.EXITANCE, 1, 1, 1),
    ],
)
def test_what_it_takes_to_fail_is_kept(
    case: str, formula: str, stage: Stage, shapes: int, lights: int, pixels: int
) -> None:
    found = shrink(scene(case), tracer(formula), stage=stage, limits=SearchLimits(tries=120))

    assert found.failure.stage is stage
    assert (len(found.scene.shapes), len(found.scene.lights)) == (shapes, lights)
    assert found.scene.camera.width * found.scene.camera.height == pixels


def test_a_mesh_becomes_the_triangle_that_is_hit() -> None:
    found = shrink(scene("meshes/wavy_sheet"), tracer("triangle=fault_no_sum"), limits=SearchLimits(tries=120))

    assert not [shape for shape in found.scene.shapes if isinstance(shape, Mesh)]
    assert [type(shape) for shape in found.scene.shapes] == [Triangle]


def test_a_cube_becomes_the_square_that_is_seen_where_the_cube_is_not_to_blame() -> None:
    given = scene("primitives/cube")
    found = shrink(given, tracer("radiance=fault_no_pi"), limits=SearchLimits(tries=60))

    assert isinstance(given.shapes[0], Cube)
    assert not [shape for shape in found.scene.shapes if not isinstance(shape, Square | Sphere | Triangle)]


def test_nothing_is_tried_when_tries_or_time_are_over() -> None:
    given = scene("primitives/sphere")

    few = shrink(given, tracer("sphere=fault_far_root"), limits=SearchLimits(tries=3))
    late = shrink(given, tracer("sphere=fault_far_root"), limits=SearchLimits(seconds=1e-9))

    assert (few.tries, late.tries, late.scene) == (3, 1, given)


def test_a_number_that_is_none_stays_none() -> None:
    right = tracer()

    def lost(given: Scene) -> Answers:
        answered = right(given)
        normals = answered.answers[Stage.NORMAL].copy()
        normals[normals[..., 0] > 0.2] = float("nan")
        return replace(answered, answers={**answered.answers, Stage.NORMAL: normals})

    found = shrink(scene("primitives/sphere"), lost, limits=SearchLimits(tries=80))

    assert found.failure.way is Way.NUMBER
    assert found.scene.camera.width == found.scene.camera.height == 1


def test_a_failure_of_another_kind_is_not_the_same() -> None:
    given = scene("primitives/sphere")
    far, unit = (failure(given, tracer(one)) for one in ("sphere=fault_far_root", "exitance=fault_albedo_squared"))
    assert far is not None
    assert unit is not None

    assert far.same(far)
    assert not far.same(unit)
    assert far.same(replace(far, items=frozenset({"HIT-1"})))
    assert not far.same(replace(far, items=frozenset({"NRM-2"})))
    assert not far.same(replace(far, way=Way.NUMBER))
