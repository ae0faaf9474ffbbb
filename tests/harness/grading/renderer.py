"""A student's ray tracer in Python alone, with a switch for each of some mistakes; right without.

    python3 renderer.py [--mistake NAMES] [--only radiance] SCENE OUTPUT

The names are those of examples/renderers/mistaken.cpp. It shares no code with the product.
"""

# pyright: basic, reportOptionalMemberAccess=false
# ruff: noqa: B905, PTH118, PTH120, PTH123, T201
import json
import math
import os
import struct
import sys

MISTAKES = (
    "left_handed", "up_is_y", "whole_angle", "no_aspect", "pixel_corner", "not_normalised", "transposed_matrix",
    "no_translation", "forward_matrix", "far_root", "small_root_only", "diameter_for_radius", "cube_doubled",
    "square_disc", "triangle_culled", "first_hit", "clips_nothing", "near_ignored", "normal_by_model",
    "normal_in_object_space", "normal_never_turned", "normal_inward", "cube_normal_unsigned", "no_shadows",
    "beyond_the_light", "no_four_pi", "no_falloff", "linear_falloff", "no_cosine", "cosine_squared", "first_light",
    "physical_for_simplified", "no_pi", "no_albedo", "albedo_squared", "back_seen", "bgr", "clamped",
)  # fmt: skip
made = set()


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return scaled(1 / length, a) if length else a  # of a triangle without area, which is never hit


def scaled(s, a):
    return (s * a[0], s * a[1], s * a[2])


def less(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def along(o, t, d):
    return (o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2])


def times(rows, v):
    return (dot(rows[0], v), dot(rows[1], v), dot(rows[2], v))


def float32(v):
    return struct.unpack("<3f", struct.pack("<3f", *v))


class Shape:
    def __init__(self, index, given, folder):
        self.index, self.kind, self.albedo = index, given["type"], given["albedo"]
        self.two_sided = given.get("two_sided", False)
        rows = given.get("to_world", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]])
        self.rows = [tuple(row[:3]) for row in rows[:3]]
        if "transposed_matrix" in made:
            self.rows = list(zip(*self.rows))
        self.shift = (0.0, 0.0, 0.0) if "no_translation" in made else tuple(row[3] for row in rows[:3])
        a, b, c = zip(*self.rows)
        volume = dot(a, cross(b, c))
        self.inverse = [scaled(1 / volume, v) for v in (cross(b, c), cross(c, a), cross(a, b))]
        self.center, self.radius = given.get("center", (0, 0, 0)), given.get("radius", 1)
        if "diameter_for_radius" in made:
            self.radius /= 2
        vertices, faces = given.get("vertices"), [(0, 1, 2)]
        if self.kind == "mesh":
            vertices, faces = [], []
            with open(os.path.join(folder, given["file"])) as file:
                for kind, *words in map(str.split, file):
                    if kind == "v":
                        vertices.append(tuple(map(float, words)))
                    else:
                        faces.append([int(word) - 1 for word in words])
        self.faces = []
        for face in faces if vertices else ():
            p, q, r = (vertices[k] for k in face)
            corners = [float32(along(self.shift, 1, times(self.rows, v))) for v in (p, q, r)]
            self.faces.append((corners, self.normal(cross(less(q, p), less(r, p)))))

    def normal(self, n):
        if "normal_by_model" in made:
            return unit(times(self.rows, n))
        return unit(n if "normal_in_object_space" in made else times(list(zip(*self.inverse)), n))

    def hits(self, origin, direction, low, high):
        if self.faces:
            yield from self.triangles(origin, direction, low, high)
            return
        o, d = times(self.inverse, less(origin, self.shift)), times(self.inverse, direction)
        if "forward_matrix" in made:
            o, d = along(self.shift, 1, times(self.rows, origin)), times(self.rows, direction)
        if self.kind == "sphere":
            o = less(o, self.center)
            square, half = dot(d, d), dot(o, d)
            off = along(o, -half / square, d)
            left = square * (self.radius * self.radius - dot(off, off))
            if left < 0:
                return
            roots = [(-half - math.sqrt(left)) / square, (-half + math.sqrt(left)) / square]
            for t in reversed(roots) if "far_root" in made else roots:
                if low < t < high:
                    n = scaled((-1 if "normal_inward" in made else 1) / self.radius, along(o, t, d))
                    yield t, 0, self.normal(n)
                    return
                if "small_root_only" in made:
                    return
        elif self.kind == "cube":
            yield from self.slabs(o, d, low, high)
        elif d[2] != 0:
            t = -o[2] / d[2]
            x, y = o[0] + t * d[0], o[1] + t * d[1]
            inside = x * x + y * y < 0.25 if "square_disc" in made else abs(x) < 0.5 and abs(y) < 0.5
            if low < t < high and (self.kind == "plane" or inside):
                yield t, 0, self.normal((0, 0, 1))

    def slabs(self, o, d, low, high):
        enter, leave, first, last = -math.inf, math.inf, 0, 0
        half = 1 if "cube_doubled" in made else 0.5
        for k in range(3):
            if d[k] == 0:
                if abs(o[k]) > half:
                    return
                continue
            near, far = sorted(((-half - o[k]) / d[k], (half - o[k]) / d[k]))
            if near > enter:
                enter, first = near, k
            if far < leave:
                leave, last = far, k
        for t, k in ((enter, first), (leave, last)) if enter <= leave else ():
            if low < t < high:
                n = [0, 0, 0]
                n[k] = 1 if o[k] + t * d[k] > 0 or "cube_normal_unsigned" in made else -1
                yield t, 0, self.normal(n)
                return

    def triangles(self, origin, direction, low, high):
        for index, ((p, q, r), normal) in enumerate(self.faces):
            e, f, s = less(q, p), less(r, p), less(origin, p)
            h = cross(direction, f)
            determinant = dot(e, h)
            if determinant == 0 or ("triangle_culled" in made and determinant < 0):
                continue
            u, g = dot(s, h) / determinant, cross(s, e)
            v = dot(direction, g) / determinant
            t = dot(f, g) / determinant
            if u >= 0 and v >= 0 and u + v <= 1 and low < t < high:
                yield t, index, normal


def nearest(shapes, origin, direction, low, high):
    best = (math.inf, None, -1, None)
    for shape in shapes:
        for t, face, normal in shape.hits(origin, direction, low, high):
            if t < best[0]:
                best = (t, shape, face, normal)
        if best[1] is not None and "first_hit" in made:
            break
    return best


def light(scene, shapes, shape, p, n, eye):
    """Return the lights that are seen and the irradiance."""
    seen, total = [], [0.0, 0.0, 0.0]
    lights = scene["lights"]
    simplified = scene["shading"] == "simplified" and "physical_for_simplified" not in made
    for index, source in enumerate(lights):
        to = less(source["position"], p)
        r = math.sqrt(dot(to, to))
        cosine = dot(n, to) / r if shape is not None and r > 0 else 0
        size = max(1.0, math.sqrt(dot(p, p)), math.sqrt(dot(eye, eye)))
        start = along(p, 1e-12 * size, n)
        end = math.inf if "beyond_the_light" in made else 1
        lit = cosine > 0 and (
            "no_shadows" in made or nearest(shapes, start, less(source["position"], start), 0, end)[1] is None
        )
        seen.append(float(lit))
        if lit and not ("first_light" in made and index > 0):
            weight = 1 if "no_cosine" in made else cosine * cosine if "cosine_squared" in made else cosine
            if not simplified:
                power = 0 if "no_falloff" in made else 1 if "linear_falloff" in made else 2
                weight /= r**power * (1 if "no_four_pi" in made else 4 * math.pi)
            total = [value + weight * flux for value, flux in zip(total, source["flux"])]
    return seen, total


def render(scene, folder):
    camera = scene["camera"]
    shapes = [Shape(index, shape, folder) for index, shape in enumerate(scene["shapes"])]
    width, height, eye, clip = camera["width"], camera["height"], camera["eye"], scene["clip"]
    f = unit(less(camera["target"], eye))
    r = unit(cross(f, (0, 1, 0) if "up_is_y" in made else camera["up"]))
    u = cross(r, f)
    if "left_handed" in made:
        r = scaled(-1, r)
    tangent = math.tan(math.radians(camera["fovy"]) / (1 if "whole_angle" in made else 2))
    aspect = 1 if "no_aspect" in made else width / height
    middle = 0.0 if "pixel_corner" in made else 0.5
    clip = "none" if "clips_nothing" in made else clip
    near, far = (0, math.inf) if clip == "none" else (camera["near"], camera["far"])
    near = 0 if "near_ignored" in made else near
    rows = {}

    def put(name, value):
        rows.setdefault(name, []).append(value)

    for y in range(height):
        for x in range(width):
            sx, sy = (2 * (x + middle) / width - 1) * aspect * tangent, (1 - 2 * (y + middle) / height) * tangent
            d = along(along(f, sx, r), sy, u)
            deep = dot(unit(d), f) if clip == "depth" else 1
            if "not_normalised" not in made:
                d = unit(d)
            t, shape, face, n = nearest(shapes, eye, d, near / deep, far / deep)
            p = along(eye, t, d) if shape else (0.0, 0.0, 0.0)
            n = n or (0.0, 0.0, 0.0)
            behind = dot(n, d) > 0
            if behind and shape.two_sided and "normal_never_turned" not in made:
                n = scaled(-1, n)
            seen, e = light(scene, shapes, shape, p, n, eye)
            power = 0 if "no_albedo" in made else 2 if "albedo_squared" in made else 1
            m = [a**power * value for a, value in zip(shape.albedo, e)] if shape else [0.0] * 3
            dark = behind and not shape.two_sided and "back_seen" not in made
            by_pi = scene["shading"] == "simplified" or "no_pi" in made
            radiance = [0.0 if dark else value if by_pi else value / math.pi for value in m]
            if "clamped" in made:
                radiance = [min(1.0, value) for value in radiance]
            if "bgr" in made:
                radiance.reverse()
            for stage, axes, vector in (("ray.", "XYZ", d), ("position.", "XYZ", p), ("normal.", "XYZ", n)):
                for axis, value in zip(axes, vector):
                    put(stage + axis, value)
            put("object.V", shape.index if shape else -1)
            put("face.V", face if shape else -1)
            put("distance.V", t)
            for index, value in enumerate(seen):
                put(f"visibility.{index}", value)
            for stage, vector in (("irradiance.", e), ("exitance.", m), ("", radiance)) if seen else ():
                for channel, value in zip("RGB", vector):
                    put(stage + channel, value)
    return {name: [values[y * width : (y + 1) * width] for y in range(height)] for name, values in rows.items()}


def write_exr(path, channels):
    names = sorted(channels)
    height, width = len(channels[names[0]]), len(channels[names[0]][0])
    listed = b"".join(name.encode() + struct.pack("<xiB3xii", 2, 0, 1, 1) for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<2i", 20000630, 2)
    for name, kind, value in (
        ("channels", "chlist", listed), ("compression", "compression", b"\0"), ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window), ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)), ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ):  # fmt: skip
        header += f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value
    header += b"\0"
    line = 4 * width * len(names)
    first = len(header) + 8 * height
    with open(path, "wb") as file:
        file.write(header + b"".join(struct.pack("<Q", first + y * (8 + line)) for y in range(height)))
        for y in range(height):
            file.write(struct.pack("<2i", y, line))
            for name in names:
                file.write(struct.pack(f"<{width}f", *channels[name][y]))


def main(words):
    if words[-1] == "--capabilities":
        declared = {"protocol": 1, "name": "student", "precision": "float64", "chained": True}
        print(json.dumps(declared | {"epsilons": {"shadow": 1e-7}}))
        return
    *options, scene, output = words
    named = dict(zip(options[::2], options[1::2]))
    made.update(filter(None, named.get("--mistake", "").split(",")))
    if made - {*MISTAKES}:
        sys.exit(f"unknown: {made - {*MISTAKES}}")
    with open(scene) as file:
        channels = render(json.load(file), os.path.dirname(scene))
    if named.get("--only") == "radiance":
        channels = {name: rows for name, rows in channels.items() if name in "RGB"}
    if channels:
        write_exr(output, channels)
    else:
        print("It writes radiance alone, and there is no light.")
        sys.exit(77)


if __name__ == "__main__":
    main(sys.argv[1:])
