"""The least that Mitsuba can do: one kernel by hand from its own camera, intersection and shadow test, no film.

It runs as it is and frozen (`dr.freeze`); the faster one is the opponent.
"""

import math
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.mitsuba3.variants import load, unavailable
from rayproof.reports.studies.bench import CONTENDERS, Prepared
from rayproof.reports.studies.bench.contenders.mitsuba_scene import loaded
from rayproof.reports.studies.bench.kernels import kernels

VARIANT = "llvm_ad_rgb"


class _Minimal:
    """Mitsuba's parts in one kernel of ours."""

    frozen = False

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        return unavailable(VARIANT)

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        return None if scene.lights and scene.clip == "depth" else "the kernel is written for lit scenes"

    def prepare(self, scene: Scene) -> Prepared:
        """Load the scene."""
        mi = load(VARIANT)
        world, seconds = loaded(VARIANT, scene)
        draw = _kernel(mi, world, scene)
        if self.frozen:
            draw = dr.freeze(draw)
        last: list[Any] = [None]

        def run() -> None:
            last[0] = draw()
            dr.eval(last[0])
            dr.sync_thread()

        def image() -> np.ndarray:
            return np.array(last[0]).reshape(scene.camera.height, scene.camera.width, 3)

        how = "frozen" if self.frozen else "as it is"
        return Prepared(
            build_seconds=seconds,
            run=run,
            image=image,
            does=f"ray_intersect, ray_test, shade, one write; {how}",
            kernels=lambda: kernels(run),
        )


@CONTENDERS.register("mitsuba_minimal")
class Minimal(_Minimal):
    """The kernel, traced in Python at every call."""


@CONTENDERS.register("mitsuba_minimal_frozen")
class MinimalFrozen(_Minimal):
    """The kernel, traced once."""

    frozen = True


def _kernel(mi: Any, world: Any, scene: Scene) -> Any:
    """Return a function that draws the scene into a flat float32 array, 3 a pixel, through pixel centres."""
    camera, sensor = scene.camera, world.sensors()[0]
    # Which variant `mi` means is global to the process, and another contender changes it between two calls.
    UInt32, Float, Point2f = mi.UInt32, mi.Float, mi.Point2f
    Vector3f, Color3f, flags = mi.Vector3f, mi.Color3f, mi.RayFlags.Minimal
    lights = [
        (mi.Point3f(*light.position), mi.Color3f(*[channel / (4 * math.pi) for channel in light.flux]))
        for light in scene.lights
    ]

    def draw() -> Any:
        pixel = dr.arange(UInt32, camera.width * camera.height)
        row = pixel // camera.width
        column = pixel - row * camera.width
        sample = Point2f((Float(column) + 0.5) / camera.width, (Float(row) + 0.5) / camera.height)
        ray, _ = sensor.sample_ray(Float(0), Float(0), sample, Point2f(0))
        hit = world.ray_intersect(ray, flags, True, True)
        valid = hit.is_valid()
        albedo = hit.bsdf().eval_diffuse_reflectance(hit, valid)
        # Both sides of a two-sided surface are lit: turn the normal to the viewer.
        normal = dr.select(dr.dot(hit.n, ray.d) > 0, -Vector3f(hit.n), Vector3f(hit.n))
        radiance = Color3f(0)
        for position, intensity in lights:
            to_light = position - hit.p
            squared = dr.squared_norm(to_light)
            cosine = dr.dot(normal, to_light) * dr.rsqrt(squared)
            lit = valid & (cosine > 0)
            lit &= ~world.ray_test(hit.spawn_ray_to(position), True, lit)
            radiance += dr.select(lit, intensity * (cosine / squared / math.pi), 0)
        radiance *= albedo
        target = dr.empty(Float, 3 * camera.width * camera.height)
        color = Vector3f(radiance.x, radiance.y, radiance.z)
        dr.scatter(target, color, pixel, mode=dr.ReduceMode.Permute)
        return target

    return draw
