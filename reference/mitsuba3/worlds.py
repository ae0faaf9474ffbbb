"""A scene as Mitsuba loads it: shapes, camera, one light, and how to get back to our shape indices."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rayproof.cases.scene import Camera, Mesh, PointLight, Scene, Triangle
from rayproof.reference.mitsuba3.shapes import entries, kept_faces


@dataclass(frozen=True, kw_only=True)
class World:
    """What Mitsuba made of a scene."""

    mi: Any  # the module, in the variant that made `loaded`
    loaded: Any  # mi.Scene
    # Mitsuba orders shapes as it likes and differently per variant; this undoes it.
    indices: dict[Any, int]  # mi.Shape -> index into the scene's shapes
    faces: dict[int, np.ndarray]  # shape index of a mesh -> our face index of each of its triangles

    @property
    def sensor(self) -> Any:
        """Return the camera."""
        return self.loaded.sensors()[0]

    @property
    def emitter(self) -> Any:
        """Return the light that is in place."""
        return self.loaded.emitters()[0]

    def place(self, light: PointLight) -> None:
        """Put `light` in the place of the one before."""
        parameters = self.mi.traverse(self.loaded)
        parameters["light.position"] = self.mi.Point3f(*light.position)
        parameters["light.intensity.value"] = self.mi.Color3f(*intensity(light))
        parameters.update()


def intensity(light: PointLight) -> list[float]:
    """Return the radiant intensity [W/sr] of an isotropic light."""
    return [channel / (4 * np.pi) for channel in light.flux]


def build(mi: Any, scene: Scene, *, near: float, far: float, samples: int = 1, cropped: bool = False) -> World:
    """Return the scene as Mitsuba's, with near and far plane at the given depths [m] and the first light, if any.

    With `cropped` the film has only the rows that are drawn, and rays through it are counted from its own corner.
    `direct` picks one of several lights at random for each sample, so there is only ever one: see `World.place`.
    """
    description: dict[str, Any] = {
        "type": "scene",
        "embree_use_robust_intersections": True,
        # No samples towards light sources that a random direction could hit: a point light never is.
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": sensor(mi, scene.camera, near, far, samples, cropped=cropped),
        **entries(mi, scene),
    }
    if scene.lights:
        first = scene.lights[0]
        color = {"type": "rgb", "value": intensity(first)}
        description["light"] = {"type": "point", "position": list(first.position), "intensity": color}
    # Optimising would merge meshes that share a material into one, and their indices with them. Loading in parallel
    # would number the shapes by chance, and every new order is a new kernel to compile.
    loaded = mi.load_dict(description, parallel=False, optimize=False)
    return World(
        mi=mi,
        loaded=loaded,
        indices={shape: int(shape.id().removeprefix("shape-")) for shape in loaded.shapes()},
        faces={i: kept_faces(shape) for i, shape in enumerate(scene.shapes) if isinstance(shape, Triangle | Mesh)},
    )


def sensor(mi: Any, camera: Camera, near: float, far: float, samples: int, *, cropped: bool = False) -> dict[str, Any]:
    """Return the camera as an entry of Mitsuba's scene dictionary, with a box-filtered film."""
    part = {
        "crop_offset_x": 0,
        "crop_offset_y": camera.first_row,
        "crop_width": camera.width,
        "crop_height": camera.lines,
    }
    return {
        "type": "perspective",
        "fov": camera.fovy,
        "fov_axis": "y",
        "near_clip": near,
        "far_clip": far,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=list(camera.eye), target=list(camera.target), up=list(camera.up)
        ),
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            **(part if cropped else {}),
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        # Unjittered strata: one sample is the pixel's centre, n x n are the centres of n x n parts.
        "sampler": {"type": "stratified", "sample_count": samples * samples, "jitter": False},
    }
