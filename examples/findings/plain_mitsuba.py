"""Mitsuba 3 as its documentation invites to use it, without what rayproof's own adapter does about its traps.

A sphere gets its matrix as `to_world`, and all lights are rendered in one pass of the `direct` integrator. Run it as
a program under test (docs/protocol.md):

    rayproof run examples/findings/sheared_sphere.json \
        --subject "exec:.venv/bin/python examples/findings/plain_mitsuba.py {scene} {output.pfm}"
"""

import json
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

if sys.argv[1:] == ["--capabilities"]:
    able = {"protocol": 1, "name": "plain Mitsuba", "version": mi.__version__, "stages": ["radiance"]}
    sys.stdout.write(json.dumps(able | {"shapes": ["sphere", "square"]}))
    sys.exit()

mi.set_variant("scalar_rgb")
scene = json.loads(Path(sys.argv[1]).read_text())
camera = scene["camera"]
T = mi.ScalarTransform4f
content = {
    "type": "scene",
    "integrator": {"type": "direct"},
    "sensor": {
        "type": "perspective",
        "fov": camera["fovy"],
        "fov_axis": "y",
        "near_clip": camera["near"],
        "far_clip": camera["far"],
        "to_world": T().look_at(origin=camera["eye"], target=camera["target"], up=camera["up"]),
        "film": {
            "type": "hdrfilm",
            "width": camera["width"],
            "height": camera["height"],
            "component_format": "float32",
            "pixel_format": "rgb",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "stratified", "sample_count": 1, "jitter": False},
    },
}
for index, shape in enumerate(scene["shapes"]):
    side = {"type": "diffuse", "reflectance": {"type": "rgb", "value": shape["albedo"]}}
    placed = np.array(shape.get("to_world", np.eye(4).tolist()), dtype=float)
    entry = {"bsdf": {"type": "twosided", "side": side} if shape.get("two_sided") else side}
    if shape["type"] == "sphere":
        entry |= {"type": "sphere", "center": shape.get("center", [0, 0, 0]), "radius": shape.get("radius", 1)}
    else:
        entry["type"], placed = "rectangle", placed @ np.diag([0.5, 0.5, 1, 1])
    content[f"shape-{index}"] = entry | {"to_world": T(placed)}
for index, light in enumerate(scene["lights"]):
    intensity = {"type": "rgb", "value": [flux / (4 * np.pi) for flux in light["flux"]]}
    content[f"light-{index}"] = {"type": "point", "position": light["position"], "intensity": intensity}
image = np.array(mi.render(mi.load_dict(content), spp=1), dtype="<f4")
header = f"PF\n{camera['width']} {camera['height']}\n-1.0\n".encode()
Path(sys.argv[2]).write_bytes(header + image[::-1].tobytes())
