"""The published JSON Schema (draft 2020-12) of a scene file, for completion in editors and for validators."""

from copy import deepcopy
from typing import Any

from rayproof.cases.scene import CLIPS, SHADINGS

NUMBER = {"type": "number"}
POSITIVE = {"type": "number", "exclusiveMinimum": 0}
PIXELS = {"type": "integer", "minimum": 1, "description": "px"}
VECTOR = {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
NOT_NEGATIVE = {"type": "array", "items": {"type": "number", "minimum": 0}, "minItems": 3, "maxItems": 3}
ROW = {"type": "array", "items": NUMBER, "minItems": 4, "maxItems": 4}
LAST_ROW = {"type": "array", "prefixItems": [{"const": value} for value in (0, 0, 0, 1)], "minItems": 4, "maxItems": 4}


def _reference(name: str, description: str = "") -> dict[str, Any]:
    return {"$ref": f"#/$defs/{name}"} | ({"description": description} if description else {})


def _object(required: dict[str, Any], optional: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": required | (optional or {}),
        "required": list(required),
        "additionalProperties": False,
    } | more


def _shape(kind: str, required: dict[str, Any], optional: dict[str, Any], description: str) -> dict[str, Any]:
    common = {"type": {"const": kind}, "albedo": _reference("rgb", "diffuse reflectance per channel")}
    placed = {
        "to_world": _reference("matrix", "object space -> world [m], not singular; default: the identity"),
        "two_sided": {"type": "boolean", "default": False, "description": "lit and seen from both sides"},
    }
    return _object(common | required, placed | optional, description=description)


VERTICES = {"type": "array", "items": VECTOR, "minItems": 1, "description": "m, rounded to float32"}
FACES = {
    "type": "array",
    "items": {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 3, "maxItems": 3},
    "minItems": 1,
    "description": "indices into vertices, counter-clockwise seen from outside",
}
PACKED = {
    "type": "string",
    "contentEncoding": "base64",
    "description": "the same rows as float32 or int32, the lowest byte first, deflated: as runs write large meshes",
}
FILE = {
    "type": "string",
    "pattern": r"\.([oO][bB][jJ]|[pP][lL][yY]|[sS][tT][lL]|[gG][lL][bB])$",
    "description": "OBJ, PLY, STL or GLB, relative to the scene file and inside its folder",
}
SPHERE = {"center": _reference("vector", "m, default: the origin"), "radius": POSITIVE | {"default": 1}}

SHAPES: dict[str, dict[str, Any]] = {
    "sphere": _shape("sphere", {}, SPHERE, "a sphere, normals outward"),
    "cube": _shape("cube", {}, {}, "the cube [-0.5, 0.5]^3, normals outward"),
    "square": _shape("square", {}, {}, "the square [-0.5, 0.5]^2 in z = 0, facing +z"),
    "plane": _shape("plane", {}, {}, "the infinite plane z = 0, facing +z"),
    "triangle": _shape(
        "triangle", {"vertices": VERTICES | {"minItems": 3, "maxItems": 3}}, {}, "counter-clockwise seen from the front"
    ),
    "mesh": _shape(
        "mesh",
        {"vertices": {"anyOf": [VERTICES, PACKED]}, "faces": {"anyOf": [FACES, PACKED]}},
        {},
        "a mesh of triangles",
    ),
    "mesh_file": _shape("mesh", {"file": FILE}, {}, "a mesh of triangles in a file of its own"),
}

CAMERA = _object(
    {
        "eye": _reference("vector", "m"),
        "target": _reference("vector", "m, not the eye"),
        "up": _reference("vector", "not parallel to the viewing direction"),
        "fovy": POSITIVE | {"exclusiveMaximum": 180, "description": "full vertical angle, degrees"},
        "width": PIXELS,
        "height": PIXELS,
        "near": POSITIVE | {"description": "m"},
        "far": POSITIVE | {"description": "m, beyond near"},
    },
    description="a pinhole camera; rays pass through pixel centres",
)

LIGHT = _object(
    {
        "position": _reference("vector", "m"),
        "flux": _reference("rgb", "W per channel; the light's RGB where shading is simplified"),
    },
    description="an isotropic point light",
)

SCENE_SCHEMA: dict[str, Any] = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "$id": "urn:rayproof:scene:1",
    "title": "rayproof scene",
    "description": "World right-handed, z by no means upward; metres, watts, degrees, linear RGB.",
    **_object(
        {"camera": CAMERA, "shapes": {"type": "array", "items": _reference("shape")}},
        {
            "lights": {"type": "array", "items": LIGHT, "default": []},
            "shading": {"enum": list(SHADINGS), "default": "inverse_square"},
            "clip": {"enum": list(CLIPS), "default": "depth"},
            "$schema": {"type": "string", "description": "for editors; not read"},
        },
    ),
    "$defs": {
        "vector": VECTOR,
        "rgb": NOT_NEGATIVE,
        "matrix": {"type": "array", "prefixItems": [ROW, ROW, ROW, LAST_ROW], "minItems": 4, "maxItems": 4},
        "shape": {"oneOf": [_reference(name) for name in SHAPES]},
        **SHAPES,
    },
}


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file, a fresh copy."""
    return deepcopy(SCENE_SCHEMA)
