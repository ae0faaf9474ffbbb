"""Light shadow rays: no acne, no leaks beyond the stated clearance, nothing behind the light, nothing lost to NaN."""

import dataclasses

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Shape, Sphere, Square
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.light_path.shadow_stage import shadow_epsilon
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, SHAPES, affine, camera, matrix, scene

STRATEGIES = [formula.variant for formula in FORMULAS.variants("shadow_ray") if formula.kind == "right"]
# An object far away and under the floor: a blocker as far as the kernel knows, in nobody's way.
ELSEWHERE = Sphere(albedo=ALBEDO, center=(0.0, 0.0, -50.0), radius=0.5)


def configured(precision: str, strategy: str) -> Configuration:
    return Configuration(precision=precision, formulas={"shadow_ray": strategy})


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4], ids=["millimetre", "metre", "ten-kilometres"])
@pytest.mark.parametrize("kind", ["sphere", "cube", "plane"])
def test_a_convex_body_never_shadows_itself(strategy: str, size: float, kind: str, precision: str) -> None:
    usual = size * np.asarray(affine(12, (0.3, 0.2, 0.4)))
    to_world = matrix(usual[:3, :3], (usual[0, 3], usual[1, 3], usual[2, 3]))
    shape = dataclasses.replace(SHAPES[kind], two_sided=False, to_world=to_world)
    view = camera(
        eye=tuple(size * x for x in (3.0, -6.0, 3.5)),
        target=tuple(size * x for x in (0.1, 0.2, 0.5)),
        near=0.01 * size,
        far=1000 * size,
    )
    light = PointLight(position=(2.0 * size, -3.0 * size, 5.0 * size), flux=(1.0, 2.0, 3.0))
    far_away = dataclasses.replace(ELSEWHERE, center=(0.0, 0.0, -500 * size), radius=size)
    answers = render(
        scene(shape, far_away, camera=view, lights=(light,)),
        (Stage.OBJECT, Stage.POSITION, Stage.NORMAL, Stage.VISIBILITY),
        configured(precision, strategy),
    )

    toward = np.asarray(light.position) - answers[Stage.POSITION]
    cosine = np.sum(toward * answers[Stage.NORMAL], axis=-1) / np.linalg.norm(toward, axis=-1)
    hit = answers[Stage.OBJECT][..., 0] == 0
    facing = hit & (cosine > 1e-4)

    assert facing.sum() > 30
    assert answers[Stage.VISIBILITY][..., 0][facing].all()
    assert not answers[Stage.VISIBILITY][..., 0][hit & (cosine < -1e-4)].any()


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_a_blocker_is_noticed_from_a_hundred_clearances_above_the_surface(strategy: str, precision: str) -> None:
    configuration = configured(precision, strategy)
    gap = 100 * shadow_epsilon(configuration, scale=8.0)
    lid = Square(
        albedo=ALBEDO, to_world=((9.0, 0.0, 0.0, 0.0), (0.0, 9.0, 0.0, 0.0), (0.0, 0.0, 1.0, gap), (0.0, 0.0, 0.0, 1.0))
    )
    # Seen from below the floor, so that the lid hides nothing; the one-sided floor is lit from above.
    view = camera(eye=(1.0, -2.0, -3.0), target=(0.1, 0.2, 0.0))
    answers = render(scene(FLOOR, lid, camera=view), (Stage.OBJECT, Stage.VISIBILITY), configuration)

    assert (answers[Stage.OBJECT][..., 0] == 0).all()
    assert not answers[Stage.VISIBILITY].any()


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_a_face_of_a_mesh_that_reaches_far_keeps_its_own_clearance(strategy: str) -> None:
    # By the far face's reach shadow rays would start a metre above the floor, and the lid 1 cm above it would be
    # missed.
    floor = Mesh(
        albedo=ALBEDO,
        vertices=np.array([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0), (0, 0, -1e6), (1, 0, -1e6), (0, 1, -1e6)]),
        faces=np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6)]),
    )
    lid = Square(albedo=ALBEDO, to_world=matrix(np.diag([9.0, 9.0, 1.0]), (0.0, 0.0, 0.01)))
    view = camera(eye=(1.0, -2.0, -3.0), target=(0.1, 0.2, 0.0))
    answers = render(scene(floor, lid, camera=view), (Stage.OBJECT, Stage.VISIBILITY), configured("float32", strategy))

    assert (answers[Stage.OBJECT][..., 0] == 0).all()
    assert not answers[Stage.VISIBILITY].any()


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize(
    "blocker",
    [
        pytest.param(Sphere(albedo=ALBEDO, center=(0.0, 0.0, 9.0)), id="sphere"),
        pytest.param(Cube(albedo=ALBEDO, to_world=affine(3, (0.0, 0.0, 9.0))), id="cube"),
        pytest.param(dataclasses.replace(SHAPES["mesh"], to_world=affine(3, (0.0, 0.0, 9.0))), id="mesh"),
        pytest.param(Plane(albedo=ALBEDO, to_world=affine(4, (0.0, 0.0, 9.0))), id="plane"),
    ],
)
def test_what_stands_behind_the_light_does_not_count(strategy: str, blocker: Shape) -> None:
    light = PointLight(position=(0.0, 0.0, 3.0), flux=(1.0, 2.0, 3.0))
    view = camera(eye=(1.0, -2.0, 2.0), target=(0.0, 0.0, 0.0))
    stages = (Stage.OBJECT, Stage.VISIBILITY)
    free = render(scene(FLOOR, blocker, camera=view, lights=(light,)), stages, configured("float32", strategy))
    endless = Configuration(formulas={"shadow_ray": strategy, "segment": "endless"})

    floor = free[Stage.OBJECT][..., 0] == 0

    assert floor.sum() > 300
    assert free[Stage.VISIBILITY][floor].all()
    blocked = render(scene(FLOOR, blocker, camera=view, lights=(light,)), stages, endless)[Stage.VISIBILITY]
    assert not blocked[floor].all()


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_clipped_geometry_still_blocks(strategy: str) -> None:
    blocker = Sphere(albedo=ALBEDO, center=(1.4, -2.0, 3.5), radius=0.4)
    view = camera(near=5.5)
    with_it = render(scene(FLOOR, blocker, camera=view), tuple(Stage), configured("float32", strategy))
    without = render(scene(FLOOR, camera=view), tuple(Stage), configured("float32", strategy))

    np.testing.assert_array_equal(with_it[Stage.OBJECT], without[Stage.OBJECT])
    assert with_it[Stage.VISIBILITY].sum() < without[Stage.VISIBILITY].sum()


def test_the_strategies_agree_where_nothing_is_close() -> None:
    what = scene(FLOOR, SHAPES["cube"], SHAPES["mesh"])
    found = [render(what, (Stage.VISIBILITY,), configured("float32", one))[Stage.VISIBILITY] for one in STRATEGIES]

    assert all(np.mean(one != found[0]) < 0.002 for one in found)


def test_from_inside_only_skipping_the_last_object_lets_the_light_through() -> None:
    hollow = Sphere(albedo=ALBEDO, two_sided=True, radius=9.0)
    outside = PointLight(position=(30.0, 20.0, 10.0), flux=(1.0, 1.0, 1.0))
    seen = {
        strategy: render(scene(hollow, lights=(outside,)), (Stage.VISIBILITY,), configured("float32", strategy))[
            Stage.VISIBILITY
        ]
        for strategy in STRATEGIES
    }

    # The normal is turned inward, so a light above the horizon is on the far side of the sphere, which blocks it. Near
    # the terminator the way through the sphere is shorter than any minimum t that clears the surface.
    assert not seen["normal_offset"].any()
    assert not seen["doubles"].any()
    assert seen["minimum_t"].mean() < 0.01
    assert seen["skip_last"].mean() > 0.1


def test_the_clearance_shrinks_with_the_precision_of_the_shadow_ray() -> None:
    wide = shadow_epsilon(Configuration(), scale=10.0)

    assert shadow_epsilon(Configuration(precision="float64"), scale=10.0) == wide * 2.0**-29
    assert shadow_epsilon(Configuration(formulas={"shadow_ray": "doubles"}), scale=10.0) == wide * 2.0**-29
    assert 1e-6 < wide < 1e-3


def test_without_lights_visibility_has_no_channels() -> None:
    answers = render(scene(FLOOR, lights=()), (Stage.VISIBILITY, Stage.RADIANCE), Configuration())

    assert answers[Stage.VISIBILITY].shape == (30, 40, 0)
    assert not answers[Stage.RADIANCE].any()


def test_a_light_exactly_on_the_surface_gives_nothing_and_no_nan(precision: str) -> None:
    # The middle pixel of an odd image looks straight down at the light.
    view = camera(eye=(0.0, 0.0, 4.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), width=5, height=3)
    light = dataclasses.replace(LIGHT, position=(0.0, 0.0, 0.0))
    answers = render(
        scene(FLOOR, ELSEWHERE, camera=view, lights=(light,)), tuple(Stage), Configuration(precision=precision)
    )

    for stage in (Stage.VISIBILITY, Stage.IRRADIANCE, Stage.RADIANCE):
        assert not answers[stage][1, 2].any()
        assert np.isfinite(answers[stage]).all()
