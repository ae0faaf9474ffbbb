"""Mitsuba 3: the references' classes (scalar and LLVM), and which scenes they refuse.

The published wheels compute in float32, so Mitsuba is evidence against blunders, not a source of digits. Facts about
it were checked in the source of version 3.9.1 and are repeated by the tests.
"""

from collections.abc import Collection
from functools import cache, lru_cache
from typing import Any, ClassVar

import numpy as np

from rayproof.cases.scene import Plane, Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.mitsuba3 import program
from rayproof.reference.mitsuba3.scene import (
    SHADOW_EPSILON,
    box,
    disc_reach,
    distances_from,
    finite_shapes,
    load_scene,
    offsets,
)

HIGHEST = 64  # a scene with more shapes has kernels of its own


@cache
def hold_a_high_number(mi: Any) -> Any:
    """Return the last of HIGHEST shapes, kept so that scenes of few shapes and of many share kernels.

    Dr.Jit numbers all living objects, the lowest free number first, so the shapes of scenes get the numbers of the
    others. A kernel that calls two of their methods contains the offset of the second method's table, which depends on
    the highest number: the first table has an entry for every number up to that.
    """
    return [mi.load_dict({"type": "disk"}) for _ in range(HIGHEST)][-1]


class _Mitsuba:
    """The common base of both variants, which differ in `variant`."""

    precision = "float32"
    light_epsilon = SHADOW_EPSILON
    variant: ClassVar[str]

    @staticmethod
    def missing() -> str | None:
        """Return a sentence with the command that installs Mitsuba, or None if it is installed."""
        return program.missing()

    def version(self) -> str:
        """Return program, version and variant."""
        return program.program_version(self.variant)

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence with the reason why it cannot answer here, or None if it can."""
        return refusal(scene, stage)

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        Stages up to exitance come from single rays through the pixel centres, radiance from Mitsuba's integrator.
        """
        mi, camera, tracing = program.switch_to(self.variant), scene.camera, program.TRACING[self.variant]
        near, far = camera.near, camera.far
        traced = set(stages) - {Stage.RADIANCE} if samples == 1 else set()
        images: StageImages = {}
        world = None
        if traced or scene.clip != "depth":
            world = load_scene(mi, scene, near=near, far=far)
            hits = tracing.trace(world, camera, program.own_interval(scene))
            images = program.stage_answers(scene, world, hits, tracing.feel, traced)
            if Stage.CAMERA in traced:
                images[Stage.CAMERA] = program.camera_answer(world, camera, tracing.ends)
            if scene.clip != "depth":
                near, far = program.clip_planes_beyond(camera, hits)
        if Stage.RADIANCE in stages:
            # Never two scenes at once: the addresses of their tables would be literals of different code.
            if samples > 1 or (near, far) != (camera.near, camera.far):
                world = None
            world = world or load_scene(mi, scene, near=near, far=far, samples=samples)
            images[Stage.RADIANCE] = program.radiance_image(world, scene, tracing.integrator(world), samples)
        return images

    def epsilon(self, scene: Scene) -> float:
        """Return the largest height [m] above the visible surfaces at which shadow rays start."""
        return float(self.epsilon_per_pixel(scene).max())

    def epsilon_per_pixel(self, scene: Scene) -> np.ndarray:
        """Return the height [m] over the surface at which each pixel's shadow rays start, (height, width), 0 on a miss.

        It grows with the distance from the origin, so that the near end of a plane has a smaller one than its far end.
        """
        return self.epsilon_at(self.render(scene, [Stage.OBJECT, Stage.POSITION]))

    def epsilon_at(self, answers: StageImages) -> np.ndarray:
        """Return the same from answers that have object and position already."""
        return np.where(answers[Stage.OBJECT][..., 0] >= 0, offsets(answers[Stage.POSITION]), 0.0)

    def notes(self, scene: Scene) -> list[str]:
        """Return sentences about the differences between the given scene and the scene that Mitsuba renders."""
        notes = []
        planes = [str(index) for index, shape in enumerate(scene.shapes) if isinstance(shape, Plane)]
        if planes:
            covers = (
                "all but the last millionth of a radian below the horizon"
                if scene.clip == "none"
                else "everything up to the far plane and every light"
            )
            radius = f"{disc_reach(scene):.4g} m"
            notes.append(f"Infinite plane shapes[{', '.join(planes)}] is a disc of radius {radius}, covering {covers}.")
        if scene.lights:
            notes.append(f"Blockers nearer to a light than {SHADOW_EPSILON:.1e} of a shadow ray's length do not count.")
        return notes


class MitsubaScalar(_Mitsuba):
    """Mitsuba without a compiler: Embree and C++ in float32, sharing neither code nor Dr.Jit's compiler with us."""

    variant = "scalar_rgb"


class MitsubaLlvm(_Mitsuba):
    """Mitsuba through Dr.Jit and LLVM: the tracer uses the same compiler, so that it has no vote of its own."""

    variant = "llvm_ad_rgb"

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages` as the other variant does, with kernels that scenes share."""
        hold_a_high_number(program.switch_to(self.variant))
        return super().render(scene, stages, samples=samples)


LIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
# Embree ignores geometry with coordinates above 1.8e18, and the determinant of a disc's matrix must fit float32.
LARGEST = 1e15  # m
# Shadow rays that start higher above a shape than this fraction of its size no longer test its shadow.
COARSEST_OFFSET = 0.01


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return the reason why Mitsuba cannot render `stage` of `scene`, or None if it can."""
    return _size(scene) or (_light(scene, stage) if stage in LIT else None)


@lru_cache(maxsize=4)
def _size(scene: Scene) -> str | None:
    boxes = [corner for _, shape in finite_shapes(scene) for corner in box(shape)]
    points = np.array([scene.camera.eye, *(light.position for light in scene.lights), *boxes])
    largest = max(float(np.abs(points).max()), disc_reach(scene))
    return f"Mitsuba's float32 does not reach {largest:g} m." if largest > LARGEST else None


def _light(scene: Scene, stage: Stage) -> str | None:
    for index, shape in finite_shapes(scene):
        low, high = box(shape)
        size, offset = float((high - low).max()), float(offsets(np.stack([low, high])).max())
        if scene.lights and offset > COARSEST_OFFSET * size:
            return f"Mitsuba's shadow rays start {offset:g} m above shapes[{index}], which measures only {size:g} m."
    if stage is Stage.VISIBILITY:
        return None
    if scene.shading == "simplified":
        return "Mitsuba has no light without the inverse square law."
    return _image(scene) if stage is Stage.RADIANCE else None


def _image(scene: Scene) -> str | None:
    for index, shape in enumerate(scene.shapes):
        if max(shape.albedo) > 1:
            return f"Mitsuba refuses an albedo above 1, shapes[{index}] has {shape.albedo}."
    if scene.clip == "shell" and not _inside_shell(scene):
        return "Mitsuba's camera clips at planes, not at spheres around the eye."
    return None


def _inside_shell(scene: Scene) -> bool:
    """Return whether every shape is certainly between the two spheres, so that they clip nothing."""
    finite = finite_shapes(scene)
    bounds = [distances_from(scene.camera.eye, shape) for _, shape in finite]
    camera = scene.camera
    return len(finite) == len(scene.shapes) and all(camera.near < n and f < camera.far for n, f in bounds)
