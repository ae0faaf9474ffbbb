"""A scene in SDL: the camera by explicit vectors, what it sees, and what blocks light.

Clipping concerns camera rays only. So where a scene clips there are two worlds: `Seen`, clipped and without shadow, and
`World`, whole and without image.
"""

from collections.abc import Callable

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.povray.program import LIT_SCALE
from rayproof.reference.povray.shapes import solid, vector

# (shape index, face index) -> SDL of what that face looks like
Look = Callable[[int, int], str]

FARTHEST = 1e7  # units; configbackend.h, MAX_DISTANCE

HEAD = """#version 3.7;
global_settings { assumed_gamma 1.0 adc_bailout 0 max_trace_level 1 ambient_light 0 }
"""


def scale_of(scene: Scene) -> float:
    """Return POV-Ray's units per metre."""
    return LIT_SCALE if scene.lights else 1.0


def world(scene: Scene, look: Look) -> str:
    """Return the scene in SDL, without lights: the camera and the objects, and what `probing` needs to know."""
    scale = scale_of(scene)
    solids = [
        text
        for index, shape in enumerate(scene.shapes)
        if (text := solid(shape, scale, lambda face, index=index: look(index, face))) is not None
    ]
    parts = [HEAD, _camera(scene, scale)]
    if solids:
        parts += [f"#declare Solid{number} = {text}" for number, text in enumerate(solids)]
        whole = " ".join(f"object {{ Solid{number} }}" for number in range(len(solids)))
        parts.append(f"#declare World = union {{ {whole} }}")
        clip = _clip(scene, scale)
        if clip:
            clipped = " ".join(f"object {{ Solid{number} {clip} }}" for number in range(len(solids)))
            parts.append(f"#declare Seen = union {{ {clipped} }}")
            parts.append("object { Seen no_shadow } object { World no_image }")
        else:
            parts.append("#declare Seen = World; object { World }")
    return "\n".join(parts) + "\n"


def _camera(scene: Scene, scale: float) -> str:
    camera = scene.camera
    return f"""#declare Eye = {vector(np.multiply(camera.eye, scale))};
#declare Forward = vnormalize({vector(np.multiply(camera.target, scale))} - Eye);
#declare Rightward = vnormalize(vcross(Forward, vnormalize({vector(camera.up)})));
#declare Upward = vcross(Rightward, Forward);
#declare Across = Rightward * (tan(radians({camera.fovy:.17g}) / 2) * {camera.width} / {camera.height});
#declare Along = Upward * tan(radians({camera.fovy:.17g}) / 2);
camera {{ perspective location Eye direction Forward right 2 * Across up 2 * Along }}"""


def _clip(scene: Scene, scale: float) -> str:
    near, far = (f"{depth * scale:.17g}" for depth in (scene.camera.near, scene.camera.far))
    if scene.clip == "none":
        return ""
    if scene.clip == "shell":
        return f"clipped_by {{ sphere {{ Eye, {near} inverse }} sphere {{ Eye, {far} }} }}"
    return (
        f"clipped_by {{ plane {{ -Forward, -vdot(Forward, Eye) - {near} }} "
        f"plane {{ Forward, vdot(Forward, Eye) + {far} }} }}"
    )
