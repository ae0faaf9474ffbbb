"""A bench scene as a Mitsuba user would load it: indexed meshes, all lights at once, nothing robust but slow."""

import time
from functools import lru_cache
from typing import Any

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.reference.mitsuba3.shapes import entries
from rayproof.reference.mitsuba3.variants import load
from rayproof.reference.mitsuba3.worlds import intensity, sensor


# One for each of two variants: Dr.Jit asks all shapes in the process at every call, so that a copy slows the others.
@lru_cache(maxsize=2)
def loaded(variant: str, scene: Scene) -> tuple[Any, float]:
    """Return Mitsuba's scene, direct integrator and one box-filtered sample a pixel, and the seconds of loading."""
    mi = load(variant)
    start = time.perf_counter()
    camera = scene.camera
    meshes = {index: shape for index, shape in enumerate(scene.shapes) if isinstance(shape, Mesh)}
    rest = Scene(camera=camera, shapes=tuple(s for s in scene.shapes if not isinstance(s, Mesh)))
    description: dict[str, Any] = {
        "type": "scene",
        # As many feelers as the tracer sends: one to each light.
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
