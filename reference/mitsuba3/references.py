"""Mitsuba 3 as two references: without a compiler, and through Dr.Jit and LLVM."""

from collections.abc import Collection
from functools import cache
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from rayproof.cases.scene import Plane, Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.mitsuba3 import variants
from rayproof.reference.mitsuba3.epsilons import SHADOW_EPSILON, offsets

HIGHEST = 64  # a scene with more shapes has kernels of its own


@cache
def hold_a_high_number(mi: Any) -> Any:
    """Return the last of HIGHEST shapes, kept so that scenes of few shapes and of many share kernels.

    Dr.Jit numbers all living objects, the lowest free number first, so the shapes of scenes take the numbers of the
    others. Into a kernel that calls two of their methods it writes where the second one's table begins, and the first
    one's has a place for every number up to the highest.
    """
    return [mi.load_dict({"type": "disk"}) for _ in range(HIGHEST)][-1]


class _Mitsuba:
    """What both variants share; `variant` and the module `traced_by` tell them apart."""

    precision = "float32"
    in_bands = True
    light_epsilon = SHADOW_EPSILON
    variant: ClassVar[str]
    traced_by: ClassVar[str]  # a module of this folder with `trace`, `feel`, `ends` and `integrator`

    @property
    def tracing(self) -> Any:
        """Return that module, imported when something is to be traced."""
        return import_module(f"rayproof.reference.mitsuba3.{self.traced_by}")

    def version(self) -> str:
        """Return program, version and variant."""
        return variants.version(self.variant)

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        from rayproof.reference.mitsuba3.refusals import refusal

        return variants.unavailable(self.variant) or refusal(scene, stage)

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        Stages up to exitance come from single rays through the pixel centres, radiance from Mitsuba's integrator.
        """
        from rayproof.reference.mitsuba3.cameras import camera_answer
        from rayproof.reference.mitsuba3.images import clip_planes_beyond, radiance
        from rayproof.reference.mitsuba3.stages import answers
        from rayproof.reference.mitsuba3.tracing import own_interval
        from rayproof.reference.mitsuba3.worlds import build

        mi, camera = variants.load(self.variant), scene.camera
        near, far = camera.near, camera.far
        traced = set(stages) - {Stage.RADIANCE} if samples == 1 else set()
        found: StageImages = {}
        world = None
        if traced or scene.clip != "depth":
            world = build(mi, scene, near=near, far=far)
            hits = self.tracing.trace(world, camera, own_interval(scene))
            found = answers(scene, world, hits, self.tracing.feel, traced)
            if Stage.CAMERA in traced:
                found[Stage.CAMERA] = camera_answer(world, camera, self.tracing.ends)
            if scene.clip != "depth":
                near, far = clip_planes_beyond(camera, hits)
        if Stage.RADIANCE in stages:
            # Never two at once: where its tables lie would be other code than for one alone.
            cropped = camera.rows is not None
            if samples > 1 or (near, far) != (camera.near, camera.far) or cropped:
                world = None
            world = world or build(mi, scene, near=near, far=far, samples=samples, cropped=cropped)
            found[Stage.RADIANCE] = radiance(world, scene, self.tracing.integrator(world), samples)
        return found

    def epsilon(self, scene: Scene) -> float:
        """Return how far [m] above the surface feelers start at most, over all that the camera sees."""
        return float(self.epsilon_per_pixel(scene).max())

    def epsilon_per_pixel(self, scene: Scene) -> np.ndarray:
        """Return how far [m] above the surface the pixel's feelers start, (height, width), 0 on a miss.

        It grows with the distance from the origin, so a plane's far end says nothing about its near one.
        """
        return self.epsilon_at(self.render(scene, [Stage.OBJECT, Stage.POSITION]))

    def epsilon_at(self, seen: StageImages) -> np.ndarray:
        """Return the same from answers that have object and position already."""
        return np.where(seen[Stage.OBJECT][..., 0] >= 0, offsets(seen[Stage.POSITION]), 0.0)

    def notes(self, scene: Scene) -> list[str]:
        """Return in sentences where Mitsuba's answer is to another question than the one asked."""
        from rayproof.reference.mitsuba3.planes import reach

        found = []
        planes = [str(index) for index, shape in enumerate(scene.shapes) if isinstance(shape, Plane)]
        if planes:
            covers = (
                "all but the last millionth of a radian below the horizon"
                if scene.clip == "none"
                else "everything up to the far plane and every light"
            )
            radius = f"{reach(scene):.4g} m"
            found.append(f"Infinite plane shapes[{', '.join(planes)}] is a disc of radius {radius}, covering {covers}.")
        if scene.lights:
            found.append(f"Blockers nearer to a light than {SHADOW_EPSILON:.1e} of a feeler's length do not count.")
        return found


class MitsubaScalar(_Mitsuba):
    """Mitsuba without a compiler: Embree and C++ in float32, sharing neither code nor Dr.Jit's compiler with us."""

    variant = "scalar_rgb"
    traced_by = "scalar"


class MitsubaLlvm(_Mitsuba):
    """Mitsuba through Dr.Jit and LLVM: the compiler is also the tracer's, so its word is no witness on its own."""

    variant = "llvm_ad_rgb"
    traced_by = "vectorized"

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages` as the other variant does, with kernels that scenes share."""
        hold_a_high_number(variants.load(self.variant))
        return super().render(scene, stages, samples=samples)
