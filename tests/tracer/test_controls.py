"""Wrong forms that the lecture prints or the literature knows: some scene tells each from the right one."""

import dataclasses

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, SHAPES, camera, matrix, scene

BEHIND = (5.0, -11.0, 6.0)  # m, behind the usual camera
OFF_CENTER = Sphere(albedo=ALBEDO, center=(0.3, 0.2, 0.6))

# From the plane of the cube's face x = 0.5, in which the middle column of an odd image looks.
IN_A_FACE = scene(
    Cube(albedo=ALBEDO),
    camera=camera(eye=(0.5, -6.0, 0.1), target=(0.5, 0.0, 0.1), up=(0.0, 0.0, 1.0), width=35),
)
SMALL = Triangle(albedo=ALBEDO, vertices=((-1e-5, -1e-5, 0.0), (1e-5, -1e-5, 0.0), (0.0, 1e-5, 0.0)))
CLOSE_UP = camera(eye=(3e-5, -6e-5, 4e-5), target=(0.0, 0.0, 0.0), near=1e-6)
# Far below the floor: a blocker as far as the kernel knows, in nobody's way.
ELSEWHERE = Sphere(albedo=ALBEDO, center=(0.0, 0.0, -50.0), radius=0.5)
KILOMETRES = 1e4  # m
TOWN = scene(
    FLOOR,
    ELSEWHERE,
    camera=camera(eye=(3 * KILOMETRES, -6 * KILOMETRES, 3.5 * KILOMETRES), target=(0.0, 0.0, 0.0), far=1e6),
    lights=(PointLight(position=(2 * KILOMETRES, -3 * KILOMETRES, 5 * KILOMETRES), flux=LIGHT.flux),),
)
# A floor a hundred metres from the origin, and a lid 1 mm above it; seen from below, so that the lid hides nothing.
FAR_OFF = (100.0, -60.0, 80.0)  # m
LID = scene(
    Plane(albedo=ALBEDO, to_world=matrix(np.eye(3), FAR_OFF)),
    Square(albedo=ALBEDO, to_world=matrix(np.diag((30.0, 30.0, 1.0)), (100.0, -60.0, 80.001))),
    camera=camera(eye=(101.0, -62.0, 77.0), target=FAR_OFF),
    lights=(PointLight(position=(102.0, -63.0, 85.0), flux=LIGHT.flux),),
)
# A lid 50 micrometres above the floor.
CLOSE_LID = scene(
    FLOOR,
    Square(albedo=ALBEDO, to_world=matrix(np.diag((30.0, 30.0, 1.0)), (0.0, 0.0, 5e-5))),
    camera=camera(eye=(1.0, -2.0, -3.0), target=(0.1, 0.2, 0.0)),
)
NEAR_PLANE = scene(camera=camera(near=1e-5))

SCENES: dict[str, tuple[Scene, str, Stage]] = {
    "sample/corner": (scene(), "ray=reference_point", Stage.RAY),
    "ray/half_depth": (scene(), "ray=inverse_matrices", Stage.RAY),
    "ray/matrix": (NEAR_PLANE, "ray=inverse_matrices", Stage.RAY),
    "ray/matrix_w_divide": (NEAR_PLANE, "ray=inverse_matrices", Stage.RAY),
    "ray/analytic_inverse": (NEAR_PLANE, "ray=inverse_matrices", Stage.RAY),
    "clip_depth/shell": (scene(FLOOR, camera=camera(near=6.5)), "", Stage.OBJECT),
    "sphere/first_positive": (scene(Sphere(albedo=ALBEDO, center=BEHIND)), "", Stage.OBJECT),
    "cube/entry_only": (
        scene(
            Cube(
                albedo=ALBEDO,
                to_world=matrix(np.eye(3), BEHIND),
            )
        ),
        "",
        Stage.OBJECT,
    ),
    "square/full_vectors": (scene(SHAPES["square"]), "", Stage.OBJECT),
    "triangle/unsigned_areas": (scene(SHAPES["triangle"]), "", Stage.OBJECT),
    "triangle/printed_third_row": (scene(SHAPES["triangle"]), "", Stage.OBJECT),
    "sphere_normal/center_kept": (scene(OFF_CENTER), "", Stage.NORMAL),
    "world_normal/with_w": (scene(SHAPES["sphere"]), "", Stage.NORMAL),
    "segment/endless": (
        scene(
            FLOOR,
            Sphere(albedo=ALBEDO, center=(0.0, 0.0, 9.0)),
            lights=(PointLight(position=(0.0, 0.0, 3.0), flux=LIGHT.flux),),
        ),
        "",
        Stage.VISIBILITY,
    ),
    "triangle/moeller_trumbore_epsilon": (scene(SMALL, camera=CLOSE_UP), "", Stage.OBJECT),
    "cube/ieee_slabs": (IN_A_FACE, "", Stage.OBJECT),
    "cube/nan_dropping": (IN_A_FACE, "", Stage.OBJECT),
    "cube/division": (IN_A_FACE, "", Stage.OBJECT),
    "cube/ize": (IN_A_FACE, "", Stage.OBJECT),
    "world_normal/model_matrix": (scene(SHAPES["sphere"]), "", Stage.NORMAL),
    "shadow_ray/none": (scene(FLOOR, ELSEWHERE), "", Stage.VISIBILITY),
    "shadow_ray/fixed_minimum_t": (CLOSE_LID, "", Stage.VISIBILITY),
    "shadow_ray/fixed_offset": (CLOSE_LID, "", Stage.VISIBILITY),
    "shadow_ray/relative_minimum_t": (LID, "", Stage.VISIBILITY),
    "shadow_ray/waechter_binder": (TOWN, "", Stage.VISIBILITY),
    "falloff/none": (scene(FLOOR), "", Stage.IRRADIANCE),
}

CONTROLS = [formula for formula in FORMULAS.values() if formula.kind == "control"]


@pytest.mark.parametrize("name", [formula.name for formula in CONTROLS if formula.equivalent is None])
def test_a_control_differs_from_the_right_formula(name: str, precision: str) -> None:
    what, right, stage = SCENES[name]
    formula = FORMULAS[name]
    rest = dict([right.split("=")]) if right else {}
    usual = Configuration(precision=precision, formulas=rest)
    wrong = Configuration(precision=precision, formulas={**rest, formula.slot: formula.variant})

    ours, theirs = (render(what, tuple(Stage), configuration) for configuration in (wrong, usual))

    before = [
        earlier
        for earlier in Stage
        if earlier is not Stage.CAMERA and list(Stage).index(earlier) < list(Stage).index(stage)
    ]
    assert not np.array_equal(ours[stage], theirs[stage], equal_nan=True)
    assert all(np.array_equal(ours[earlier], theirs[earlier]) for earlier in before)


@pytest.mark.parametrize("name", [formula.name for formula in CONTROLS if formula.equivalent is not None])
def test_an_equivalent_control_does_not_differ(name: str, precision: str) -> None:
    formula = FORMULAS[name]
    what = scene(*SHAPES.values(), FLOOR, camera=dataclasses.replace(camera(), eye=(3.0, -6.0, 2.0)))
    wrong = Configuration(precision=precision, formulas={formula.slot: formula.variant})

    ours, theirs = (
        render(what, (Stage.OBJECT, Stage.NORMAL), one) for one in (wrong, Configuration(precision=precision))
    )

    limit = 1e-5 if precision == "float32" else 1e-13
    np.testing.assert_array_equal(ours[Stage.OBJECT], theirs[Stage.OBJECT])
    np.testing.assert_allclose(ours[Stage.NORMAL], theirs[Stage.NORMAL], atol=limit)
