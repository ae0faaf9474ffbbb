"""The truth against closed forms in exact rationals, and what must hold of any truth."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES
from rayproof.reference.certified import Certified
from rayproof.reference.certified.fields import UndecidedError
from tests.reference.analytic.scenes import camera, icosphere, looking_down, matrix, random_scene

ORACLE: Any = Certified()
GREY = (0.5, 0.25, 0.125)
# 16 digits more than float64 has, from below and from above.
PI = (Fraction("3.14159265358979323846264338327950288"), Fraction("3.14159265358979323846264338327950289"))


def every_pixel(scene: Scene) -> list[tuple[int, int]]:
    return [(x, y) for y in range(scene.camera.height) for x in range(scene.camera.width)]


def test_a_floor_seen_from_above_in_rationals() -> None:
    scene = Scene(
        camera=looking_down(3.0, fovy=90.0, width=14, height=10),
        shapes=(Plane(albedo=GREY),),
        lights=(PointLight(position=(0.5, 0.25, 2.0), flux=(7.0, 0.0, 3.0)),),
    )

    for record in ORACLE.enclose(scene, IMAGE_STAGES, every_pixel(scene)):
        column, row = record["pixel"]
        stages = record["stages"]
        x = (Fraction(2 * column + 1, 14) - 1) * Fraction(14, 10) * 3
        y = (1 - Fraction(2 * row + 1, 10)) * 3
        for (low, high), value in zip(stages["position"], (x, y, Fraction(0)), strict=True):
            assert low <= value <= high
        low, high = stages["distance"][0]
        assert Fraction(low) ** 2 <= x * x + y * y + 9 <= Fraction(high) ** 2
        # (4 pi E / Phi)^2 = cos^2 / r^4 is rational: h^2 / r^6.
        low, high = stages["irradiance"][0]
        square = (x - Fraction(1, 2)) ** 2 + (y - Fraction(1, 4)) ** 2 + 4
        assert (Fraction(low) * 4 * PI[0] / 7) ** 2 <= 4 / square**3 <= (Fraction(high) * 4 * PI[1] / 7) ** 2
        assert stages["irradiance"][1] == [0, 0]
        assert high <= np.nextafter(low, np.inf)


def test_a_ray_along_an_axis_is_enclosed_by_neighbours() -> None:
    scene = Scene(camera=looking_down(4), shapes=(Sphere(albedo=GREY, radius=1.5),))

    (record,) = ORACLE.enclose(scene, IMAGE_STAGES, [(7, 5)])

    low, high = record["stages"]["distance"][0]
    assert np.nextafter(2.5, 0) <= low <= 2.5 <= high <= np.nextafter(2.5, 3)
    low, high = record["stages"]["normal"][2]
    assert np.nextafter(1, 0) <= low <= 1 <= high <= np.nextafter(1, 2)
    low, high = record["stages"]["normal"][0]
    assert -1e-30 < low <= 0 <= high < 1e-30


@pytest.mark.parametrize("seed", range(3))
def test_the_float64_filter_changes_nothing(seed: int) -> None:
    scene = random_scene(seed, width=16, height=12)
    pixels = every_pixel(scene)

    filtered, plain = (ORACLE.enclose(scene, IMAGE_STAGES, pixels, filtered=filtered) for filtered in (True, False))

    # NaN, which only `undecided` explains, would not be equal to itself.
    assert [one["stages"] for one in filtered] == [one["stages"] for one in plain]


@pytest.mark.parametrize("seed", range(4))
def test_the_analytic_reference_decides_alike_and_errs_by_little(seed: int) -> None:
    scene = random_scene(seed)
    analytic: Any = REFERENCES["analytic"]()

    found, truth = analytic.render(scene, IMAGE_STAGES), ORACLE.render(scene, IMAGE_STAGES)

    assert np.array_equal(found[Stage.OBJECT], truth[Stage.OBJECT])
    assert np.array_equal(found[Stage.VISIBILITY], truth[Stage.VISIBILITY])
    for stage in (Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.RADIANCE):
        assert found[stage] == pytest.approx(truth[stage], rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_stage_truth_of_the_numbers_received(seed: int) -> None:
    scene = random_scene(seed, width=20, height=16)
    analytic: Any = REFERENCES["analytic"]()
    received = {
        stage: values.astype(np.float32).astype(np.float64)
        for stage, values in analytic.render(scene, IMAGE_STAGES).items()
    }

    for stage in IMAGE_STAGES:
        given = {name: received[name] for name in IMAGE_STAGES[: IMAGE_STAGES.index(stage)]}
        truth = ORACLE.continue_from(scene, stage, given)
        found = analytic.continue_from(scene, stage, given)
        assert truth.shape == found.shape
        if stage in {Stage.OBJECT, Stage.VISIBILITY}:
            assert np.array_equal(found, truth)
        else:
            assert found == pytest.approx(truth, rel=1e-10, abs=1e-12)


def test_of_numbers_that_are_not_finite_nothing_is_hit_or_seen() -> None:
    scene = Scene(camera=looking_down(2, width=2, height=1), shapes=(Plane(albedo=GREY),), lights=(LIGHT,))
    rays = np.array([[[np.nan, 0, -1], [0, 0, 0]]])
    objects = np.zeros((1, 2, 2))
    normals = np.broadcast_to((0.0, 0.0, 1.0), (1, 2, 3))
    positions = np.array([[[np.inf, 0, 0], [0, 0, 0]]])

    assert np.array_equal(ORACLE.continue_from(scene, Stage.OBJECT, {Stage.RAY: rays}), [[[-1, -1], [-1, -1]]])
    given = {Stage.OBJECT: objects, Stage.POSITION: positions, Stage.NORMAL: normals}
    assert ORACLE.continue_from(scene, Stage.VISIBILITY, given).ravel().tolist() == [0, 1]
    given = {Stage.OBJECT: objects, Stage.IRRADIANCE: np.full((1, 2, 3), np.inf)}
    assert np.isposinf(ORACLE.continue_from(scene, Stage.EXITANCE, given)).all()


LIGHT = PointLight(position=(0.0, 0.0, 1.0), flux=(1.0, 1.0, 1.0))


@pytest.mark.parametrize("two_sided", [True, False])
@pytest.mark.parametrize(("place", "visible"), [((0.4, 0.3, 0.1), True), ((3.0, 0.3, 0.1), False)])
@pytest.mark.parametrize("kind", [Sphere, Cube])
def test_a_solid_seen_from_inside_shadows_itself_by_algebra(
    two_sided: bool, place: tuple[float, float, float], visible: bool, kind: Any
) -> None:
    shape = kind(albedo=GREY, two_sided=two_sided, to_world=matrix(np.eye(3) * 3))
    view = camera(eye=(0.1, 0.2, -0.3), target=(1.0, 0.0, 0.0), fovy=100.0, width=12, height=9, near=0.01)
    light = PointLight(position=tuple(3 * value for value in place), flux=(1.0, 1.0, 1.0))  # pyright: ignore[reportArgumentType]
    scene = Scene(camera=view, shapes=(shape,), lights=(light,))

    found = ORACLE.render(scene, [Stage.OBJECT, Stage.VISIBILITY])

    assert (found[Stage.OBJECT] == 0).all()
    # One-sided, the outward normal looks away from a light inside; outside, the wall is in the way on the far side.
    expected = visible and two_sided
    if two_sided or visible:
        assert (found[Stage.VISIBILITY] == expected).all()


def aligned(shapes: Any, **changes: Any) -> Scene:
    """Return shapes seen along -z, the central ray through the origin."""
    return Scene(camera=looking_down(4, **changes), shapes=shapes)


TIES = {
    "a tangent to a sphere hits": ((Sphere(albedo=GREY, center=(1.0, 0.0, 0.0)),), 0, 4.0),
    "a ray in a cube's face plane hits": ((Cube(albedo=GREY, to_world=matrix(np.eye(3), (0.5, 0, 0))),), 0, 3.5),
    "a square's edge misses": ((Square(albedo=GREY, to_world=matrix(np.eye(3), (0.5, 0, 0))),), -1, np.inf),
    "a triangle's edge hits": (
        (Triangle(albedo=GREY, vertices=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),),
        0,
        4.0,
    ),
    "of equal distances the first shape wins": ((Plane(albedo=GREY), Square(albedo=GREY)), 0, 4.0),
}


@pytest.mark.parametrize(("shapes", "shape", "distance"), TIES.values(), ids=TIES.keys())
@pytest.mark.parametrize("fovy", [90.0, 60.0, 50.0])
def test_ties_are_decided_as_specified(shapes: Any, shape: int, distance: float, fovy: float) -> None:
    (record,) = ORACLE.enclose(aligned(shapes, fovy=fovy), IMAGE_STAGES, [(7, 5)])

    assert record["undecided"] == []
    assert record["stages"]["object"][0] == [shape, shape]
    low, high = record["stages"]["distance"][0]
    assert low <= distance <= high


def oblique() -> Scene:
    """Return a cube seen exactly along the diagonal of its top, from the height of its top."""
    view = camera(eye=(-3.0, -3.0, 0.5), target=(0.0, 0.0, 0.5), up=(0.0, 0.0, 1.0), width=17, height=17)
    shapes = (Plane(albedo=GREY, to_world=matrix(np.eye(3), (0, 0, -0.5))), Cube(albedo=GREY))
    return Scene(camera=view, shapes=shapes, lights=(PointLight(position=(0.0, -2.0, 2.0), flux=(1.0, 1.0, 1.0)),))


def test_ties_between_irrational_numbers_are_proved() -> None:
    records = ORACLE.enclose(oblique(), IMAGE_STAGES, every_pixel(oblique()))

    assert not any(record["undecided"] for record in records)
    assert sum(record["exact"] for record in records) >= 10
    # Left and right of the diagonal the cube's upright edge is symmetric.
    objects = np.array([record["stages"]["object"][0][0] for record in records]).reshape(17, 17)
    assert np.array_equal(objects, objects[:, ::-1])


def test_what_cannot_be_decided_is_listed_and_not_guessed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise UndecidedError

    scene = oblique()
    monkeypatch.setattr("rayproof.reference.certified.light_paths.nearest", refuse)
    (record,) = ORACLE.enclose(scene, IMAGE_STAGES, [(8, 8)])

    assert record["undecided"] == ["object"]
    assert record["exact"]
    assert np.isnan(record["stages"]["object"]).all()
    assert np.isnan(record["stages"]["radiance"]).all()
    assert np.isfinite(record["stages"]["ray"]).all()


def test_meshes_are_certified_point_by_point() -> None:
    ball = icosphere(3)
    scene = Scene(camera=looking_down(4), shapes=(ball,), lights=(PointLight(position=(2.0, 1.0, 5.0), flux=GREY),))
    analytic: Any = REFERENCES["analytic"]()
    points = np.random.default_rng(7).uniform((4, 3), (11, 8), (60, 2))

    assert "1280 triangles" in ORACLE.unsupported(scene, Stage.DISTANCE)
    assert ORACLE.unsupported(scene, Stage.CAMERA) is None
    truth, found = (one.at(scene, IMAGE_STAGES, points) for one in (ORACLE, analytic))
    assert np.array_equal(truth[Stage.OBJECT], found[Stage.OBJECT])
    assert found[Stage.RADIANCE] == pytest.approx(truth[Stage.RADIANCE], rel=1e-10)


def test_the_camera_stage_agrees_with_the_analytic_one() -> None:
    scene = random_scene(1)
    analytic: Any = REFERENCES["analytic"]()

    truth, found = (one.render(scene, [Stage.CAMERA])[Stage.CAMERA] for one in (ORACLE, analytic))

    for name, values in truth.items():
        assert found[name] == pytest.approx(values, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("last", IMAGE_STAGES)
def test_each_stage_can_be_asked_alone(last: Stage) -> None:
    scene = random_scene(0, width=8, height=6)

    alone, together = ORACLE.render(scene, [last]), ORACLE.render(scene, IMAGE_STAGES)

    assert list(alone) == [last]
    assert np.array_equal(alone[last], together[last])
