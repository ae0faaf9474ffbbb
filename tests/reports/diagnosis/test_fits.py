"""What no list has is found by a fit: a camera through rays or an image, a curve of one variable, which hit counts."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.placement import camera_around, scaling
from rayproof.cases.scene import Mesh, PointLight, Scene, Sphere
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES, Given, Way
from rayproof.reports.diagnosis.fits import Fitting, from_images, rounded, sum_of
from rayproof.reports.diagnosis.mistakes.light import Lights, Share
from rayproof.reports.diagnosis.mistakes.pinhole_fit import Free, Law, laws_of, through
from rayproof.reports.diagnosis.mistakes.shapes import Counting
from rayproof.reports.diagnosis.search import _holds, search
from rayproof.reports.diagnosis.trials import Evidence

ORACLE = Analytic()
CASES = {case.name: case.scene for case in select(["primitives/sphere", "primitives/plane", "inside/sphere"])}
CAMERAS = [
    camera_around((0, 0, 0), distance=4, azimuth=20, elevation=30, width=width, height=height, fovy=fovy)
    for width, height, fovy in ((64, 48, 20), (48, 60, 50), (90, 40, 80))
]


def shown(name: str, way: Way, *, failed: bool = True) -> Evidence:
    """Return the radiance that a renderer which answers in a way writes."""
    scene = CASES[name]
    blank = Evidence(case=name, scene=scene, load=dict, failed=failed, oracle=ORACLE, undecided=None)
    light = {Stage.RADIANCE: blank.under(way).answers[Stage.RADIANCE]}
    found = Evidence(case=name, scene=scene, load=lambda: light, failed=failed, oracle=ORACLE, undecided=blank.never)
    vars(found)["right"] = blank.right
    return found


def ways_of(name: str, cases: list[Fitting]) -> list[Way]:
    fitted = MISTAKES[name].fitted
    assert fitted is not None
    return list(fitted(cases))


def rays_of(free: Free, scene: Scene) -> np.ndarray:
    given = Given(scene=scene, answers={}, right=np.zeros(0), parameter=0.0)
    return np.asarray(free.way.stages[Stage.RAY](given)).astype(np.float32).astype(np.float64)


@pytest.mark.parametrize("camera", CAMERAS)
def test_scales_shifts_and_axes_of_a_camera_are_found_through_its_rays(camera) -> None:
    free = Free(
        scales=(Law(factor=1.2), Law(variable="the aspect ratio", exponent=-1.0)),
        shifts=(0.25, -0.5),
        turns=(0.01, 0.2, -0.1),
    )

    found = through(camera, rays_of(free, Scene(camera=camera, shapes=(), lights=())))

    assert found is not None
    assert found.scales == pytest.approx((1.2, 1 / camera.aspect), rel=1e-5)
    assert found.shifts == pytest.approx((0.25, -0.5), abs=1e-3)
    assert found.turns == pytest.approx((0.01, 0.2, -0.1), abs=1e-5)


def test_rays_of_no_pinhole_have_no_camera() -> None:
    camera = CAMERAS[0]
    rays = rays_of(Free(), Scene(camera=camera, shapes=(), lights=()))
    bent = rays + 1e-3 * np.sin(9 * rays[..., ::-1])

    assert through(camera, bent / np.linalg.norm(bent, axis=-1, keepdims=True)) is None


def test_a_law_of_several_cameras_is_one_that_all_of_them_follow() -> None:
    linear = [camera.alpha / math.tan(camera.alpha) for camera in CAMERAS]
    fixed = [math.tan(math.radians(25)) / math.tan(camera.alpha) for camera in CAMERAS]

    (law,) = laws_of(linear, CAMERAS, 0)
    assert (law.variable, law.exponent, law.factor) == ("tan(fovy/2) / (fovy/2)", -1.0, 1.0)
    (law,) = laws_of(fixed, CAMERAS, 0)
    assert (law.variable, law.exponent, law.factor) == ("tan(fovy/2)", -1.0, pytest.approx(0.46631, rel=1e-3))
    assert laws_of([1.0, 1.1, 1.3], CAMERAS, 0) == []


def test_a_camera_is_named_by_an_image_alone() -> None:
    law = Law(variable="cos(fovy/2)", exponent=1.0)
    way = Free(scales=(law, law)).way

    found = search([shown(name, way) for name in CASES]).found

    assert {one.hypothesis.mistakes for one in found} == {("another_camera",)}
    assert "cos(fovy/2) times as wide and as high" in found[0].hypothesis.sentence


def falls_off(fall) -> Way:
    share = Share(physical=lambda squared, cosine, _: squared * fall(np.sqrt(squared)))
    return Way(stages={Stage.IRRADIANCE: Lights((share,))})


@pytest.mark.parametrize(
    ("fall", "said"),
    [
        (lambda r: 1 / (1 + r) ** 2, "1/(1 + r)^2"),
        (lambda r: 1 / (1 + 0.09 * r + 0.032 * r**2), "1/(1 + 0.09 r + 0.032 r^2)"),
        (lambda r: np.exp(-0.1 * r) / r**2, "exp(-0.1 r)/r^2"),
        (lambda r: (2 + np.sin(r)) / r**2, "whose ratio to the right one depends on the distance alone"),
    ],
)
def test_light_that_depends_on_the_distance_alone_is_said_to(fall, said: str) -> None:
    cases = [shown(name, falls_off(fall)) for name in CASES]

    ways = ways_of("curve_of_distance", from_images(cases))

    assert [said in (way.says or "") for way in ways] == [True]


def test_a_curve_is_held_against_the_cases_that_it_was_not_estimated_from() -> None:
    cases = [shown(name, falls_off(lambda r: 1 / (1 + r) ** 2)) for name in ("primitives/sphere", "primitives/plane")]
    right = shown("inside/sphere", Way(), failed=False)

    assert {one.hypothesis.mistakes for one in search(cases).found} == {("curve_of_distance",)}
    assert search([*cases, right]).found == ()


def test_light_that_depends_on_more_than_one_variable_has_no_formula() -> None:
    share = Share(physical=lambda squared, cosine, _: np.sqrt(cosine) * squared / (1 + squared))
    cases = [shown(name, Way(stages={Stage.IRRADIANCE: Lights((share,))})) for name in CASES]

    for name in ("curve_of_distance", "curve_of_cosine", "curve_of_albedo", "curve_of_flux", "curve_of_number"):
        ways = ways_of(name, from_images(cases))
        # A table may be drawn of few cases, for on one sphere the cosine follows from the distance.
        assert [way.says for way in ways if "whose ratio" not in (way.says or "")] == []


def test_terms_that_are_not_needed_are_none_and_one_alone_is_no_sum() -> None:
    x = np.linspace(0.5, 3, 200)
    terms = np.stack([np.ones_like(x), x, x**2], axis=-1)

    assert sum_of(terms / (2 + 3 * x**2)[:, np.newaxis]).tolist() == [2.0, 0.0, 3.0]
    assert sum_of(terms / x[:, np.newaxis]) is None
    assert sum_of(terms / np.exp(x)[:, np.newaxis]) is None
    assert (rounded(0.19999), rounded(1.2345678)) == (0.2, 1.2345678)


@pytest.mark.parametrize("rule", ["first", "last", "farthest"])
def test_of_the_faces_of_a_mesh_that_a_ray_meets_another_than_the_nearest_counts(rule: str) -> None:
    # Three walls one behind the other, not in the order of their distances.
    corners = np.array([(-9, -9, 0), (9, -9, 0), (0, 9, 0)], dtype=np.float32)
    depths = (1.0, 3.0, 2.0)
    vertices = np.concatenate([corners - (0, 0, depth) for depth in depths]).astype(np.float32)
    mesh = Mesh(albedo=(1, 1, 1), vertices=vertices, faces=np.arange(9, dtype=np.int32).reshape(3, 3))
    camera = camera_around((0, 0, -2), distance=4, azimuth=0, elevation=90, width=8, height=6, fovy=10)
    scene = Scene(camera=camera, shapes=(mesh,), lights=(PointLight(position=(0, 0, 5), flux=(1, 1, 1)),))
    rays = ORACLE.render(scene, [Stage.RAY])

    given = Given(scene=scene, answers=rays, right=np.zeros(0), parameter=0.0)
    objects, distances = (wrong(given) for wrong in Counting(of_faces=rule).stages.values())

    assert set(objects[..., 1].ravel()) == {{"first": 0, "last": 2, "farthest": 1}[rule]}
    assert np.all(np.isfinite(distances))


def test_a_greatest_distance_is_a_number_of_few_digits_between_what_is_seen_and_what_is_not() -> None:
    scene = Scene(
        camera=camera_around((0, 0, 0), distance=18, azimuth=10, elevation=20, width=48, height=40, fovy=30),
        shapes=(Sphere(albedo=(1, 1, 1), to_world=scaling(5, 3, 4)),),
        lights=(PointLight(position=(20, 9, 9), flux=(1, 1, 1)),),
    )
    case = Evidence(case="a/b", scene=scene, load=dict, failed=True, oracle=ORACLE, undecided=None)
    ours = case.under(Counting(below=15.0).way).answers
    fitting = Fitting(evidence=case, right=case.right.answers, ours=ours, plain=~case.right.edge)

    said = [way.says for way in ways_of("another_hit", [fitting])]

    assert any("15 m away or farther" in (words or "") for words in said), said
    assert set(ours) >= {stage for stage in IMAGE_STAGES if stage in case.right.answers}


def test_undrawn_parts_are_sought_in_cases_with_different_numbers_of_lights() -> None:
    images = {Stage.VISIBILITY: np.zeros((2, 3, 2)), Stage.DISTANCE: np.ones((2, 3, 1))}
    case: Any = SimpleNamespace(wrong=np.ones((2, 3), dtype=bool), stages=tuple(images), ours=images)

    assert _holds(case, {Stage.VISIBILITY: np.zeros(4), Stage.DISTANCE: np.ones(1)}).all()
