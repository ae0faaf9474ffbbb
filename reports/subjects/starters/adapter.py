#!/usr/bin/env python3
"""An adapter between rayproof and a renderer, with a working renderer of spheres; replace it by your own renderer.

rayproof run --subject "serve:python3 @FILE@" --out report

`serve:` starts it once for each worker; `--subject "exec:python3 @FILE@ {scene} {output}"` calls it for each scene.
"""

import json
import math
import struct
import sys

# The capabilities of this adapter. Cases that need others are reported as unsupported: neither passed nor failed.
CAPABILITIES = {
    "name": "adapter",
    "version": "0",
    "precision": "float64",
    "stages": ["ray", "object", "distance", "position", "normal"],
    "shapes": ["sphere"],
    "affine": False,
    # "chained": True  # add this if each stage is computed from the numbers that you write for the earlier stages
}


def trace(scene, eye, direction, low, high):
    """YOUR RENDERER: return (t, shape index, outward unit normal) of the nearest hit with low < t < high, or None."""
    best = None
    for index, shape in enumerate(scene["shapes"]):
        center, radius = shape["center"], shape["radius"]
        if "to_world" in shape:  # turned, moved and evenly scaled, since "affine" is false
            rows = shape["to_world"][:3]
            center = [dot(row, center) + row[3] for row in rows]
            radius *= math.sqrt(sum(row[0] ** 2 for row in rows))
        origin = [e - c for e, c in zip(eye, center)]
        b = dot(origin, direction)
        off = [o - b * d for o, d in zip(origin, direction)]
        square = radius**2 - dot(off, off)
        if square < 0:
            continue
        for t in (-b - math.sqrt(square), -b + math.sqrt(square)):
            if low < t < high:
                if best is None or t < best[0]:
                    best = (t, index, unit([o + t * d for o, d in zip(origin, direction)]))
                break
    return best


def render(scene):
    """Return the channels by name, each a list of rows from top to bottom."""
    camera = scene["camera"]
    width, height, eye = camera["width"], camera["height"], camera["eye"]
    forward = unit([t - e for t, e in zip(camera["target"], eye)])
    right = unit(cross(forward, camera["up"]))
    up = cross(right, forward)
    tangent = math.tan(math.radians(camera["fovy"]) / 2)
    names = ["object.V", "face.V", "distance.V"]
    names += [f"{stage}.{axis}" for stage in ("ray", "position", "normal") for axis in "XYZ"]
    channels = {name: [[0.0] * width for _ in range(height)] for name in names}
    for y in range(height):
        for x in range(width):
            # A pixel's sample is its centre; row 0 is the top one.
            sx = (2 * (x + 0.5) - width) / height * tangent
            sy = (1 - 2 * (y + 0.5) / height) * tangent
            direction = unit([f + sx * r + sy * u for f, r, u in zip(forward, right, up)])
            low, high = 0.0, math.inf
            if scene["clip"] != "none":
                along = dot(direction, forward) if scene["clip"] == "depth" else 1.0
                low, high = camera["near"] / along, camera["far"] / along
            t, index, normal = trace(scene, eye, direction, low, high) or (math.inf, -1, [0.0] * 3)
            if index >= 0 and scene["shapes"][index].get("two_sided") and dot(normal, direction) > 0:
                normal = [-n for n in normal]
            position = [e + t * d for e, d in zip(eye, direction)] if index >= 0 else [0.0] * 3
            for stage, vector in (("ray", direction), ("position", position), ("normal", normal)):
                for axis, value in zip("XYZ", vector):
                    channels[f"{stage}.{axis}"][y][x] = value
            channels["object.V"][y][x] = index
            channels["face.V"][y][x] = 0 if index >= 0 else -1
            channels["distance.V"][y][x] = t
    return channels


def write_exr(path, channels):
    """Write 32-bit float channels as an uncompressed OpenEXR image (openexr.com, "OpenEXR File Layout")."""
    names = sorted(channels)
    height, width = len(channels[names[0]]), len(channels[names[0]][0])
    listed = b"".join(name.encode() + struct.pack("<xiB3xii", 2, 0, 1, 1) for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = b""
    for name, kind, value in (
        ("channels", "chlist", listed),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ):
        header += f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value
    header = struct.pack("<2i", 20000630, 2) + header + b"\0"
    line = 4 * width * len(names)
    first = len(header) + 8 * height
    with open(path, "wb") as file:
        file.write(header + b"".join(struct.pack("<Q", first + y * (8 + line)) for y in range(height)))
        for y in range(height):
            file.write(struct.pack("<2i", y, line))
            for name in names:
                file.write(struct.pack(f"<{width}f", *channels[name][y]))


def dot(a, b):
    """Return the dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the cross product of two vectors."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    """Return the unit vector with the direction of `a`."""
    size = math.sqrt(dot(a, a))
    return [component / size for component in a]


def draw(scene, output):
    """Read a scene file and write its image."""
    with open(scene) as file:
        write_exr(output, render(json.load(file)))


def serve():
    """Answer requests, one JSON object per line, until standard input ends."""
    for line in sys.stdin:
        request = json.loads(line)
        answer = {"id": request["id"]}
        try:
            if "capabilities" in request:
                answer["capabilities"] = {"protocol": 2, **CAPABILITIES}
            else:
                draw(request["scene"], request["output"])
                answer["ok"] = True
        except Exception as error:
            answer["error"] = f"{type(error).__name__}: {error}"
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["--capabilities"]:
        print(json.dumps({"protocol": 1, **CAPABILITIES}))
    elif len(sys.argv) == 3:
        draw(*sys.argv[1:])
    elif len(sys.argv) == 1:
        serve()
    else:
        sys.exit("usage: adapter.py SCENE OUTPUT, or nothing for requests on standard input")
