"""Scenes of one structure share a kernel where their numbers are in memory, and nothing else changes by it."""

import dataclasses
from collections.abc import Iterator

import drjit as dr
import numpy as np
import pytest

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Cube, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.tracer import render as rendering
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames
from rayproof.tracer.kernel.parameters import Literals
from rayproof.tracer.render import render
from tests.tracer.scenes import FLOOR, LIGHT, affine, camera, everything, octahedron, scene


@pytest.fixture(autouse=True)
def _history() -> Iterator[None]:
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    dr.kernel_history()
    yield
    dr.set_flag(dr.JitFlag.KernelHistory, False)


def member(seed: int, *, mesh: bool = False) -> Scene:
    """Return one of a family: the same shapes, and every number another one."""
    generator = np.random.default_rng(seed)

    def triple(low: float, high: float) -> tuple[float, float, float]:
        x, y, z = generator.uniform(low, high, 3).tolist()
        return x, y, z

    shapes = (
        Sphere(albedo=triple(0.1, 0.9), center=triple(-1, 1), radius=float(generator.uniform(0.3, 0.6))),
        Sphere(albedo=triple(0.1, 0.9), center=triple(-1, 1), to_world=affine(seed, triple(-1, 1))),
        Cube(albedo=triple(0.1, 0.9), to_world=affine(seed + 1, triple(-1, 1))),
        Square(albedo=triple(0.1, 0.9), to_world=affine(seed + 2, triple(-1, 1))),
        Triangle(albedo=triple(0.1, 0.9), vertices=(triple(-2, -1), triple(0, 1), triple(1, 2))),
        *([octahedron(to_world=affine(seed + 3, triple(-1, 1)))] if mesh else []),
        FLOOR,
    )
    return scene(
        *shapes,
        camera=camera(eye=triple(3, 5), target=triple(-0.2, 0.2), fovy=float(generator.uniform(20, 30))),
        lights=tuple(dataclasses.replace(LIGHT, position=triple(3, 5), flux=triple(50, 90)) for _ in range(2)),
    )


def kernels() -> set[str]:
    """Return what tells the launched kernels apart."""
    return {kernel["hash"] for kernel in dr.kernel_history([dr.KernelType.JIT])}


def test_scenes_with_a_mesh_share_the_two_kernels_of_their_plan() -> None:
    for seed in range(4):
        render(member(seed, mesh=True), (Stage.RADIANCE,), Configuration())

    assert len(kernels()) == 2


@pytest.mark.parametrize("mesh", [False, True])
def test_scenes_of_one_structure_share_the_kernels_of_all_stages(mesh: bool) -> None:
    render(member(0, mesh=mesh), tuple(Stage), Configuration())
    one = kernels()
    for seed in range(1, 8):
        render(member(seed, mesh=mesh), tuple(Stage), Configuration())

    assert len(one) > 2
    assert kernels() <= one


@pytest.mark.parametrize("mesh", [False, True])
def test_scenes_of_the_same_kinds_share_all_kernels_whatever_their_number_and_order(mesh: bool) -> None:
    usual = member(0, mesh=mesh)
    render(usual, tuple(Stage), Configuration())
    one = kernels()

    more = (*member(1).shapes[1:3], *usual.shapes[::-1])
    render(dataclasses.replace(usual, shapes=more), tuple(Stage), Configuration())

    assert kernels() <= one


@pytest.mark.parametrize("what", [member(3), member(3, mesh=True), everything()], ids=["unrolled", "mesh", "all"])
def test_stages_by_kernels_of_their_own_are_those_of_one_kernel(what: Scene, precision: str) -> None:
    configuration = Configuration(precision=precision)

    together = render(what, IMAGE_STAGES, configuration)

    for stage in IMAGE_STAGES:
        (alone,) = render(what, (stage,), configuration).values()
        np.testing.assert_array_equal(together[stage], alone)


def test_a_scene_that_is_rendered_often_has_its_numbers_in_the_code() -> None:
    for seed in range(2):
        Frames(member(seed), Configuration())()

    assert len(kernels()) == 2


@pytest.mark.parametrize("what", [member(3), everything()], ids=["unrolled", "trees"])
def test_numbers_in_memory_give_what_literals_give(
    what: Scene, precision: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    configuration = Configuration(precision=precision)

    in_memory = render(what, tuple(Stage), configuration)
    monkeypatch.setattr(rendering, "SplitKernels", Literals)
    literal = render(what, tuple(Stage), configuration)

    for stage in (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.VISIBILITY):
        np.testing.assert_array_equal(in_memory[stage], literal[stage])
    # A literal folds by a division, a square root or a product of its own: a rounding each, of which a normal has three
    # and light three more.
    for stage, roundings in ((Stage.NORMAL, 3), (Stage.IRRADIANCE, 6), (Stage.EXITANCE, 6), (Stage.RADIANCE, 6)):
        limit = gamma(roundings, precision=precision)
        np.testing.assert_allclose(in_memory[stage], literal[stage], rtol=limit, atol=limit * literal[stage].max())
    for name, value in literal[Stage.CAMERA].items():
        np.testing.assert_array_equal(in_memory[Stage.CAMERA][name], value)
