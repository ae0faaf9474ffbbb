"""Going past a shape that no ray of a packet can meet loses no hit and no shadow, and is what most packets do."""

import dataclasses

import drjit as dr
import numpy as np
import pytest

from cases.scene import Cube, Plane, PointLight, Scene, Shape, Sphere, Square, Triangle
from cases.stages import IMAGE_STAGES, Stage
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, camera, matrix, octahedron, scene
from tracer.arrays import array_types
from tracer.branches import asked, where
from tracer.cones import Directions, ball, cone
from tracer.configuration import Configuration
from tracer.frames import Frames
from tracer.parameters import LITERALS
from tracer.plan import Plan
from tracer.render import render

SCENES = 40
STRIP, ONE_BY_ONE = Plan(columns=4), Plan()


def shapes(generator: np.random.Generator, scale: float, moved: np.ndarray) -> tuple[Shape, ...]:
    """Return one shape of each kind and a second sphere, anywhere about `moved` [m], of any size below `scale` [m]."""

    def placed() -> tuple:
        # Stretched along the shape's own axes, or across them along the world's.
        stretch = scale * 10 ** generator.uniform(-2, 0.3, size=(1, 3))
        linear = np.linalg.qr(generator.normal(size=(3, 3)))[0] * (stretch if generator.random() < 0.5 else stretch.T)
        return matrix(linear, tuple((moved + scale * generator.uniform(-2, 2, size=3)).tolist()))

    return (
        Sphere(albedo=ALBEDO, to_world=placed(), two_sided=True),
        Sphere(albedo=ALBEDO, center=(0.3, -0.2, 0.1), radius=0.7, to_world=placed()),
        Cube(albedo=ALBEDO, to_world=placed(), two_sided=True),
        Square(albedo=ALBEDO, to_world=placed(), two_sided=True),
        Triangle(albedo=ALBEDO, vertices=((-1.0, -0.7, 0.1), (1.1, -0.5, 0.0), (0.1, 0.9, 0.4)), to_world=placed()),
        Plane(albedo=ALBEDO, to_world=placed(), two_sided=True),
    )


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


@pytest.mark.parametrize("feeler", ["none", "doubles"])
def test_a_strategy_against_acne_means_the_same(feeler: str) -> None:
    what = scene(Sphere(albedo=ALBEDO, center=(0.0, 0.0, 1.0), two_sided=True), FLOOR, lights=(LIGHT,))
    configuration = Configuration(formulas={"feeler": feeler})

    one, other = (render(what, (Stage.VISIBILITY,), configuration, chosen=chosen) for chosen in (STRIP, ONE_BY_ONE))

    np.testing.assert_array_equal(one[Stage.VISIBILITY], other[Stage.VISIBILITY])


@pytest.mark.parametrize("shape", [Sphere, Cube, Square])
def test_nothing_is_lost_of_what_is_flattened_across_its_axes(shape: type) -> None:
    flat = np.diag((1.0, 1.0, 1e-5)) @ _turned(40.0, 0) @ _turned(25.0, 2)
    one = shape(albedo=ALBEDO, to_world=matrix(flat, (0.0, 0.0, 0.0)), two_sided=True)
    far = camera(eye=(18.5, 15.5, 43.5), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=2.98, width=512, height=384)
    what = scene(one, lights=(LIGHT,), camera=far)

    strip, single = (render(what, (Stage.OBJECT,), Configuration(), chosen=plan) for plan in (STRIP, ONE_BY_ONE))

    np.testing.assert_array_equal(strip[Stage.OBJECT], single[Stage.OBJECT])
    assert (single[Stage.OBJECT][..., 0] >= 0).any()


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


def _turned(degrees: float, axis: int) -> np.ndarray:
    """Return a rotation about a coordinate axis."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.roll(np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]), (axis, axis), axis=(0, 1))


@pytest.mark.parametrize("feeler", ["normal_offset", "doubles"])
def test_a_light_that_rounding_moves_loses_no_shadow(feeler: str) -> None:
    ball = Sphere(albedo=ALBEDO, center=(1e5, 0.0, 0.2), radius=0.02)
    near = {"eye": (1e5 + 0.2, -0.2, 0.4), "target": (1e5, 0.0, 0.0), "fovy": 20.0, "near": 1e-3}
    what = scene(
        ball,
        FLOOR,
        lights=(PointLight(position=(1e5 + 0.0039, 0.0, 0.5), flux=(10.0, 10.0, 10.0)),),
        camera=camera(width=256, height=256, **near),
    )
    configuration = Configuration(formulas={"feeler": feeler})

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


def test_a_ray_at_any_point_of_a_shape_may_meet_it(precision: str) -> None:
    types, generator = array_types(precision), np.random.default_rng(5)
    kind = np.float64 if precision == "float64" else np.float32
    met = []
    for shape in shapes(generator, 1.0, np.zeros(3))[:5]:
        found = ball(shape)
        assert found is not None
        center, radius = found
        origin = (center + generator.normal(size=3) * radius * 5).tolist()
        about = cone(shape, origin, precision)
        assert about is not None
        outward = generator.normal(size=(3, 4096))
        points = center[:, np.newaxis] + radius * outward / np.linalg.norm(outward, axis=0)
        aims = types.Vector(np.ascontiguousarray(points - np.asarray(origin)[:, np.newaxis], dtype=kind))
        others = types.Vector(np.ascontiguousarray(outward, dtype=kind))

        def may(*directions: object, about: object = about) -> np.ndarray:
            return np.array(about.may_meet(Directions(directions, types), types, LITERALS, name="shape"))  # type: ignore[attr-defined]

        assert may(aims).all()
        assert may(others, aims).all()  # one of several is enough
        assert np.array(about.reversed.may_meet(Directions([-aims], types), types, LITERALS, name="shape")).all()
        met.append(may(others).mean())
    assert 0 < np.mean(met) < 0.1


def test_no_cone_is_about_what_has_no_end_or_holds_the_point() -> None:
    sphere = Sphere(albedo=ALBEDO, center=(0.0, 0.0, 1.0))

    assert cone(FLOOR, (0.0, 0.0, 5.0), "float32") is None
    assert cone(sphere, (0.0, 0.0, 1.0), "float32") is None
    assert cone(sphere, (0.0, 0.9, 1.0), "float32") is None
    assert cone(sphere, (0.0, 0.0, 5.0), "float32") is not None
    # Where float32 cannot tell the point from the surface.
    far = dataclasses.replace(sphere, center=(1e6, 0.0, 0.0))
    assert cone(far, (1e6 + 2, 0.0, 0.0), "float32") is None
    assert cone(far, (1e6 + 2, 0.0, 0.0), "float64") is not None


def test_a_direction_that_is_no_number_bounds_nothing() -> None:
    types = array_types("float32")
    about = cone(Sphere(albedo=ALBEDO), (0.0, 0.0, 5.0), "float32")
    assert about is not None
    nobody, down = types.Vector(dr.nan), types.Vector(0, 0, -1)

    def may(directions: list, **active: object) -> bool:
        found = about.may_meet(Directions(directions, types, **active), types, LITERALS, name="sphere")  # type: ignore[arg-type]
        return bool(np.array(found).all())

    assert may([nobody, down])
    assert not may([nobody, nobody])
    assert not may([down, types.Vector(1, 0, 0)], active=[types.Bool(False), types.Bool(True)])
    assert not may([down], active=[types.Bool(False)])


def test_most_packets_go_past_a_small_sphere() -> None:
    small = Sphere(albedo=ALBEDO, center=(0.0, 0.0, 0.2), radius=0.2)
    what = scene(small, FLOOR, lights=(LIGHT,), camera=camera(width=128, height=128))

    seen, shaded, felt, crossing = Frames(what, Configuration(), chosen=STRIP).asked()

    assert 0 < seen.mean() < 0.05
    assert shaded.all()  # the floor is everywhere
    assert 0 < felt.mean() < 0.05
    assert not crossing.any()  # nothing lies below it
    assert not Frames(scene(FLOOR, lights=(LIGHT,)), Configuration(), chosen=ONE_BY_ONE).asked()[1:]


def test_asking_computes_everything_everywhere() -> None:
    types = array_types("float32")

    with asked() as conditions:
        (found,) = where(types.Bool([True, False]), lambda: [types.Float([1, 2])], [types.Float(0)])

    assert [np.array(one).tolist() for one in conditions] == [[True, False]]
    assert np.array(found).tolist() == [1, 2]
    (chosen,) = where(types.Bool([True, False]), lambda: [types.Float([1, 2])], [types.Float(0)])
    assert np.array(chosen).tolist() == [1, 0]


def test_branches_leave_each_other_alone() -> None:
    types = array_types("float32")
    nothing, x = types.Bool(False), types.Float([1, 2])

    first = where(types.Bool([True, False]), lambda: [x > 1, x > 0], [nothing] * 2)
    second = where(types.Bool([False, True]), lambda: [x > 5, x > 1], [nothing] * 2)

    assert [np.array(one).tolist() for one in (*first, *second)] == [
        [False, False],
        [True, False],
        [False, False],
        [False, True],
    ]


def test_meshes_stay_in_their_tree() -> None:
    assert ball(octahedron()) is None
