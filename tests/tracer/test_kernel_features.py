"""Every feature of a scene is in its kernel where it is asked for and nowhere else, in Dr.Jit's count of operations."""

import dataclasses
from collections.abc import Collection, Iterator

import drjit as dr
import pytest

from rayproof.cases.scene import IDENTITY, PointLight, Scene, Sphere, Triangle
from rayproof.cases.stages import Stage
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.plan import Plan
from rayproof.tracer.render import render
from tests.tracer.scenes import ALBEDO, FLOOR, LIGHT, SECOND_LIGHT, affine, octahedron, scene

SPHERE = Sphere(albedo=ALBEDO, center=(0.1, 0.2, 1.0))
OTHER = dataclasses.replace(SPHERE, albedo=(0.2, 0.6, 0.7))
HOLLOW = dataclasses.replace(SPHERE, two_sided=True)
MOVED = dataclasses.replace(SPHERE, to_world=(*((*row[:3], 1.5) for row in IDENTITY[:3]), IDENTITY[3]))
STRETCHED = dataclasses.replace(SPHERE, to_world=((2.0, 0, 0, 0), (0, 3.0, 0, 0), (0, 0, 4.0, 0), IDENTITY[3]))
SHEARED = dataclasses.replace(SPHERE, to_world=affine(3, (0.1, 0.2, 1.0)))
TRIANGLE = Triangle(albedo=ALBEDO, vertices=((-1.0, -0.7, 0.1), (1.1, -0.5, 0.0), (0.1, 0.9, 0.4)))
BOTH = scene(SPHERE, FLOOR)
RADIANCE = (Stage.RADIANCE,)
DISTANCE = (Stage.DISTANCE,)


@pytest.fixture(autouse=True)
def _history() -> Iterator[None]:
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    dr.kernel_history()
    yield
    dr.set_flag(dr.JitFlag.KernelHistory, False)


def operations(what: Scene, stages: Collection[Stage] = RADIANCE, configuration: Configuration | None = None) -> int:
    """Return how many operations the kernels have that rendering launches."""
    render(what, stages, configuration or Configuration())
    return sum(kernel["operation_count"] for kernel in dr.kernel_history([dr.KernelType.JIT]))


def with_lights(*lights: PointLight) -> Scene:
    return dataclasses.replace(BOTH, lights=lights)


# What is asked for, what is not, of which stages, and how many operations it takes at least: two thirds of what it took
# when this was written (docs/developers.md has those), so that what stays in the kernel unasked shows.
FEATURES: dict[str, tuple[Scene, Scene, Collection[Stage], int]] = {
    "lights": (BOTH, with_lights(), RADIANCE, 210),
    "a second light": (with_lights(LIGHT, SECOND_LIGHT), BOTH, RADIANCE, 60),
    "shadow_rays": (scene(HOLLOW), scene(SPHERE), (Stage.VISIBILITY,), 45),
    "a second sphere": (scene(SPHERE, OTHER), scene(SPHERE), DISTANCE, 25),
    "a plane": (BOTH, scene(SPHERE), DISTANCE, 8),
    "a triangle": (scene(TRIANGLE, FLOOR), scene(FLOOR), DISTANCE, 75),
    "a mesh": (scene(octahedron(), FLOOR), scene(FLOOR), DISTANCE, 500),
    "a translation": (scene(MOVED), scene(SPHERE), DISTANCE, 4),
    "a stretch": (scene(STRETCHED), scene(SPHERE), DISTANCE, 6),
    "a shear": (scene(SHEARED), scene(STRETCHED), DISTANCE, 16),
    "a sheared normal": (scene(SHEARED), scene(MOVED), (Stage.NORMAL,), 30),
    "a shell's clipping": (scene(SPHERE, clip="shell"), scene(SPHERE, clip="none"), DISTANCE, 1),
    "the planes' clipping": (scene(SPHERE, clip="depth"), scene(SPHERE, clip="shell"), DISTANCE, 4),
    "two-sidedness": (scene(HOLLOW), scene(SPHERE), (Stage.NORMAL,), 6),
    "falloff": (BOTH, dataclasses.replace(BOTH, shading="simplified"), RADIANCE, 7),
    "different albedos": (scene(SPHERE, OTHER), scene(SPHERE, SPHERE), RADIANCE, 4),
}


@pytest.mark.parametrize("name", FEATURES)
def test_a_feature_takes_its_operations_only_where_it_is_asked_for(name: str) -> None:
    more, less, stages, least = FEATURES[name]

    saved = operations(more, stages) - operations(less, stages)

    assert saved >= least


def test_a_shape_that_many_share_is_looked_up_and_not_chosen() -> None:
    def length(count: int, *, tables: bool) -> int:
        colored = [dataclasses.replace(SPHERE, albedo=(0.1 + 0.04 * k, 0.5, 0.6)) for k in range(count)]
        render(scene(*colored), RADIANCE, Configuration(), chosen=Plan(trees=frozenset({"sphere"}), tables=tables))
        return sum(kernel["operation_count"] for kernel in dr.kernel_history([dr.KernelType.JIT]))

    # Ten more take ten more choices, beside what the tree takes.
    chosen, looked_up = (length(20, tables=tables) - length(10, tables=tables) for tables in (False, True))
    assert chosen - looked_up > 20
