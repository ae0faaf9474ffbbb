"""Going past a shape that no ray of a packet can meet loses no hit and no shadow."""

import numpy as np
import pytest

from rayproof.cases.scene import PointLight, Scene, Shape, Sphere, Square
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.plan import Plan
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, camera, scene, shapes

SCENES = 40
STRIP, ONE_BY_ONE = Plan(columns=4), Plan()


def anywhere(seed: int) -> Scene:
    """Return a scene of any scale, seen and lit from anywhere, from inside of a shape too."""
    generator = np.random.default_rng(seed)
    scale, moved = 10.0 ** generator.uniform(-3, 3), generator.normal(size=3)
    moved = moved * scale * 10.0 ** generator.uniform(-1, 1.5)
    x, y, z = (moved + scale * generator.normal(size=3) * 10 ** generator.uniform(-0.5, 1)).tolist()
    target = tuple((moved + scale * generator.normal(size=3)).tolist())
    lights = tuple(
        PointLight(position=tuple((moved + scale * generator.normal(size=3) * 2).tolist()), flux=(50.0 * scale**2,) * 3)
        for _ in range(2)
    )
    seen = camera(eye=(x, y, z), target=target, near=1e-3 * scale, far=1e3 * scale, width=48, height=30)
    return scene(*shapes(generator, scale, moved), lights=lights, camera=seen)


def test_no_hit_and_no_shadow_is_lost(precision: str) -> None:
    hit = shadowed = 0
    for seed in range(SCENES):
        one, other = (
            render(anywhere(seed), IMAGE_STAGES, Configuration(precision=precision), chosen=chosen)
            for chosen in (STRIP, ONE_BY_ONE)
        )
        for stage in IMAGE_STAGES:
            np.testing.assert_array_equal(one[stage], other[stage], err_msg=f"scene {seed}, {stage}")
        hit += (one[Stage.OBJECT][..., 0] >= 0).sum()
        shadowed += (one[Stage.VISIBILITY] == 0).sum()
    assert hit > SCENES * 48 * 30 * 0.2
    assert shadowed > SCENES * 48 * 30 * 0.2


@pytest.mark.parametrize("formula", ["haines", "textbook", "half_b", "kahan", "shift", "pbrt4"])
@pytest.mark.parametrize("radii", [100.0, 1000.0])
def test_a_discriminant_that_cancels_hits_as_much(formula: str, radii: float) -> None:
    seen_under = np.degrees(np.arctan(2 / radii))
    far = camera(
        eye=(0.6 * radii, 0.0, 0.8 * radii),
        target=(0.0, 0.0, 0.0),
        fovy=2.5 * seen_under,
        far=1e5,
        width=512,
        height=384,
    )
    what = scene(Sphere(albedo=ALBEDO), camera=far)
    configuration = Configuration(formulas={"sphere": formula})

    strip, single = (render(what, (Stage.OBJECT,), configuration, chosen=plan) for plan in (STRIP, ONE_BY_ONE))

    np.testing.assert_array_equal(strip[Stage.OBJECT], single[Stage.OBJECT])
    assert (single[Stage.OBJECT][..., 0] >= 0).any()


@pytest.mark.parametrize("shadow_ray", ["normal_offset", "doubles"])
def test_a_light_that_rounding_moves_loses_no_shadow(shadow_ray: str) -> None:
    ball = Sphere(albedo=ALBEDO, center=(1e5, 0.0, 0.2), radius=0.02)
    near = {"eye": (1e5 + 0.2, -0.2, 0.4), "target": (1e5, 0.0, 0.0), "fovy": 20.0, "near": 1e-3}
    what = scene(
        ball,
        FLOOR,
        lights=(PointLight(position=(1e5 + 0.0039, 0.0, 0.5), flux=(10.0, 10.0, 10.0)),),
        camera=camera(width=256, height=256, **near),
    )
    configuration = Configuration(formulas={"shadow_ray": shadow_ray})

    one, other = (render(what, (Stage.VISIBILITY,), configuration, chosen=chosen) for chosen in (STRIP, ONE_BY_ONE))

    np.testing.assert_array_equal(one[Stage.VISIBILITY], other[Stage.VISIBILITY])


@pytest.mark.parametrize(
    ("formulas", "shape"),
    [
        ({"sphere": "fault_negative_root"}, Sphere(albedo=ALBEDO, center=(4.5, -9.3, 5.1))),
        ({"sphere": "fault_center_ignored"}, Sphere(albedo=ALBEDO, center=(4.5, -9.3, 5.1))),
        ({"square": "fault_full_size_local"}, Square(albedo=ALBEDO, two_sided=True)),
    ],
)
def test_a_wrong_formula_shows_all_that_it_does(formulas: dict[str, str], shape: Shape) -> None:
    what = scene(shape, lights=(LIGHT,))

    one, other = (
        render(what, (Stage.OBJECT, Stage.VISIBILITY), Configuration(formulas=formulas), chosen=chosen)
        for chosen in (STRIP, ONE_BY_ONE)
    )
    usual = render(what, (Stage.OBJECT,), Configuration(), chosen=STRIP)

    for stage in (Stage.OBJECT, Stage.VISIBILITY):
        np.testing.assert_array_equal(one[stage], other[stage])
    assert (one[Stage.OBJECT] != usual[Stage.OBJECT]).any()
