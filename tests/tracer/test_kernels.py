"""What a scene does not need is not in its kernel, counted by Dr.Jit's kernel history."""

import dataclasses
from collections.abc import Collection, Iterator
from typing import Any

import drjit as dr
import pytest

from rayproof.cases.scene import IDENTITY, Mesh, Scene, Sphere
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.plan import plan
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, SHAPES, everything, scene


@pytest.fixture(autouse=True)
def _history() -> Iterator[None]:
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    dr.kernel_history()
    yield
    dr.set_flag(dr.JitFlag.KernelHistory, False)


def kernels(
    what: Scene, stages: Collection[Stage] = (Stage.RADIANCE,), configuration: Configuration | None = None
) -> list[dict[str, Any]]:
    """Return the history of the kernels that rendering launched."""
    render(what, stages, configuration or Configuration())
    return dr.kernel_history([dr.KernelType.JIT])


def operations(what: Scene, stages: Collection[Stage] = (Stage.RADIANCE,)) -> int:
    """Return how many operations the kernels have; 0 where everything is known without computing."""
    launched = kernels(what, stages)
    assert len(launched) <= (2 if plan(what, Configuration()).split else 1)
    return sum(kernel["operation_count"] for kernel in launched)


def code(what: Scene, configuration: Configuration) -> list[str]:
    """Return what tells the kernels from others."""
    return [kernel["hash"] for kernel in kernels(what, configuration=configuration)]


SPHERE = Sphere(albedo=ALBEDO, center=(0.1, 0.2, 1.0))


def test_one_kernel_from_pixel_to_radiance(precision: str) -> None:
    bodies = [shape for shape in everything().shapes if not isinstance(shape, Mesh)]

    assert len(kernels(scene(*bodies), (Stage.RADIANCE,), Configuration(precision=precision))) == 1


@pytest.mark.parametrize("split", [False, True])
def test_a_tree_takes_one_kernel_or_two_as_planned(split: bool, precision: str) -> None:
    configuration = Configuration(precision=precision)
    chosen = dataclasses.replace(plan(everything(), configuration), split=split)

    render(everything(), (Stage.RADIANCE,), configuration, chosen=chosen)

    assert len(dr.kernel_history([dr.KernelType.JIT])) == 1 + split


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_a_shape_that_is_absent_leaves_nothing(name: str) -> None:
    others = [shape for other, shape in SHAPES.items() if other != name and not isinstance(shape, Mesh)]

    assert operations(scene(*others)) < operations(scene(*others, SHAPES[name]))


def test_identity_costs_no_transform() -> None:
    moved = dataclasses.replace(SPHERE, to_world=SHAPES["sphere"].to_world)
    translated = dataclasses.replace(SPHERE, to_world=(*((*row[:3], 1.5) for row in IDENTITY[:3]), IDENTITY[3]))

    assert operations(scene(SPHERE)) < operations(scene(translated)) < operations(scene(moved))


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_shadow_rays_are_there_only_where_something_may_block(name: str) -> None:
    # A mesh may shadow itself, and so may a two-sided body that is seen from inside; other bodies cannot when alone.
    other = Configuration(formulas={"shadow_ray": "minimum_t"})
    alone = scene(dataclasses.replace(SHAPES[name], two_sided=False))
    hollow = scene(dataclasses.replace(SHAPES[name], two_sided=True))
    pair = scene(SHAPES[name], FLOOR)

    assert (code(alone, other) != code(alone, Configuration())) == (name == "mesh")
    assert (code(hollow, other) != code(hollow, Configuration())) == (name in ("mesh", "sphere", "cube"))
    assert code(pair, other) != code(pair, Configuration())


def test_stages_that_are_not_asked_for_are_not_computed() -> None:
    counts = [operations(everything(), (stage,)) for stage in (Stage.RAY, Stage.OBJECT, Stage.NORMAL, Stage.IRRADIANCE)]

    assert counts == sorted(set(counts))
