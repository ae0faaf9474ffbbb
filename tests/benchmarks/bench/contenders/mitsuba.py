"""Mitsuba on a bench scene, loaded as its users would: indexed meshes, all lights at once, nothing robust but slow."""

import math
import time
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.reference.mitsuba3.program import switch_to, unavailable
from rayproof.reference.mitsuba3.scene import entries, intensity, sensor
from tests.benchmarks.bench import Prepared
from tests.benchmarks.bench.kernels import kernels


# One for each of two variants: Dr.Jit asks all shapes in the process at every call, so that a copy slows the others.
@lru_cache(maxsize=2)
def loaded(variant: str, scene: Scene) -> tuple[Any, float]:
    """Return Mitsuba's scene, direct integrator and one box-filtered sample a pixel, and the seconds of loading."""
    mi = switch_to(variant)
    start = time.perf_counter()
    camera = scene.camera
    meshes = {index: shape for index, shape in enumerate(scene.shapes) if isinstance(shape, Mesh)}
    rest = Scene(camera=camera, shapes=tuple(s for s in scene.shapes if not isinstance(s, Mesh)))
    description: dict[str, Any] = {
        "type": "scene",
        # As many shadow rays as the tracer sends: one to each light.
        "integrator": {"type": "direct", "emitter_samples": max(1, len(scene.lights)), "bsdf_samples": 0},
        "sensor": {
            **sensor(mi, camera, camera.near, camera.far, 1),
            "sampler": {"type": "independent", "sample_count": 1},
        },
        **entries(mi, rest),
        **{f"mesh-{index}": _mesh(mi, shape, f"mesh-{index}") for index, shape in meshes.items()},
    }
    for index, light in enumerate(scene.lights):
        color = {"type": "rgb", "value": intensity(light)}
        description[f"light-{index}"] = {"type": "point", "position": list(light.position), "intensity": color}
    found = mi.load_dict(description, optimize=False)
    return found, time.perf_counter() - start


def _mesh(mi: Any, shape: Mesh, name: str) -> Any:
    """Return a mesh with shared vertices; the benchmark's have no matrix to bake."""
    properties = mi.Properties()
    properties.set_id(name)
    properties["face_normals"] = True
    material = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(shape.albedo)}}
    properties["bsdf"] = mi.load_dict({"type": "twosided", "side": material} if shape.two_sided else material)
    mesh = mi.Mesh(name, vertex_count=len(shape.vertices), face_count=len(shape.faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = shape.vertices.ravel()
    parameters["faces"] = shape.faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


# Mitsuba as its users run it: `mi.render` with the direct integrator and one sample a pixel.


class _Direct:
    """`mi.render` in one variant."""

    variant = ""

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        return unavailable(cls.variant)

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        return None

    def prepare(self, scene: Scene) -> Prepared:
        """Load the scene."""
        mi = switch_to(self.variant)
        world, seconds = loaded(self.variant, scene)
        is_jit = self.variant.startswith("llvm")
        last: list[Any] = [None]

        def run() -> None:
            last[0] = mi.render(world, spp=1)
            if is_jit:
                dr.eval(last[0])
                dr.sync_thread()

        return Prepared(
            build_seconds=seconds,
            run=run,
            # Its one sample is anywhere in the pixel, and of several lights it takes one at random.
            image=None,
            does=f"mi.render, direct, 1 sample a pixel, {self.variant}",
            kernels=(lambda: kernels(run)) if is_jit else None,
            # Global to the process, and another contender may have changed it.
            ready=lambda: switch_to(self.variant),
        )


class Direct(_Direct):
    """Compiled by LLVM."""

    variant = "llvm_ad_rgb"


class Scalar(_Direct):
    """Without JIT compilation, on all cores."""

    variant = "scalar_rgb"


# The least that Mitsuba can do: one kernel by hand from its own camera, intersection and shadow test, no film.
#
# It runs as it is and frozen (`dr.freeze`); the faster one is the opponent.


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
        mi = switch_to(VARIANT)
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


class Minimal(_Minimal):
    """The kernel, traced in Python at every call."""


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
        for position, strength in lights:
            to_light = position - hit.p
            squared = dr.squared_norm(to_light)
            cosine = dr.dot(normal, to_light) * dr.rsqrt(squared)
            lit = valid & (cosine > 0)
            lit &= ~world.ray_test(hit.spawn_ray_to(position), True, lit)
            radiance += dr.select(lit, strength * (cosine / squared / math.pi), 0)
        radiance *= albedo
        target = dr.empty(Float, 3 * camera.width * camera.height)
        color = Vector3f(radiance.x, radiance.y, radiance.z)
        dr.scatter(target, color, pixel, mode=dr.ReduceMode.Permute)
        return target

    return draw
