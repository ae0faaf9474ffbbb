"""Answers of the tracer's own formulas to the vectors, slot by slot, in either precision.

Rays at boxes, planes and squares other than the unit shapes are first transformed by `to_object`, with a matrix per
row. The rows of a camera contain rays, so a formula of a camera's matrices is tested by the ray of the inverse matrices
(CAM-5).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import drjit as dr
import numpy as np

from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.questions.light import Shadow
from rayproof.reports.studies.stability.questions.placed import rows as matrix_rows
from rayproof.reports.studies.stability.questions.rays import ViewRay
from rayproof.reports.studies.stability.shapes import ahead, ray_of, record
from rayproof.reports.vectors import SLOTS_OF, Row
from rayproof.reports.vectors.check import FILES, file_of
from rayproof.reports.vectors.files import number
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import ArrayTypes, array_types
from rayproof.tracer.light_path.camera_stage import camera_frame
from rayproof.tracer.rays import Ray
from rayproof.tracer.shapes.meshes import TriangleArrays
from rayproof.tracer.shapes.primitives import SphereArrays, SquareArrays
from rayproof.tracer.shapes.shape import GatheredTransform, Transform

Members = Sequence[Row]
Columns = dict[str, np.ndarray]
BY_MATRIX = ("view", "projection", "inverse")


def configured(formula: Formula, precision: str) -> Configuration:
    """Return the configuration in which the rows of a formula's file depend on it, with defaults otherwise."""
    chosen = {formula.slot: formula.variant}
    if formula.slot in BY_MATRIX:
        chosen["ray"] = "inverse_matrices"
    return Configuration(precision=precision, formulas=chosen)


def columns(rows: Members) -> Columns:
    """Return the numbers of all rows by the name of the input."""
    names = [name for name, value in rows[0].inputs.items() if not isinstance(value, str)]
    return {name: np.array([row.inputs[name] for row in rows], dtype=np.float64) for name in names}


@dataclass(frozen=True, kw_only=True)
class PlacedRay:
    """The arguments of a position formula for a box: the ray in object space, and the transform to world space."""

    ray: Ray
    transform: GatheredTransform

    def __call__(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray in object space and the function that transforms its points to world space."""
        return self.ray, self.transform.point_to_world

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return the mask, centres and radii of spheres, for no sphere at all."""
        center = type(self.ray.origin)(0.0)
        return dr.mask_t(center.x)(False), center, type(center.x)(1.0)


def transform(linear: np.ndarray, origin: np.ndarray, types: ArrayTypes) -> GatheredTransform:
    """Return matrices (rows, 3, 3) and translations (rows, 3) on the device."""
    inverse = np.linalg.inv(linear)
    uploads = {f"row{i}": inverse[:, i] for i in range(3)} | {f"column{i}": linear[:, :, i] for i in range(3)}
    x = uploaded(uploads | {"origin": origin}, types)
    return GatheredTransform(
        rows=tuple(x[f"row{i}"] for i in range(3)),
        columns=tuple(x[f"column{i}"] for i in range(3)),
        translation=x["origin"],
    )


def _placed(file: str, x: Columns) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices and translations that map the unit box, plane or square to the shapes of the rows."""
    if file == "box":
        return np.stack([np.diag(size) for size in x["max"] - x["min"]]), (x["min"] + x["max"]) / 2
    if file == "plane":
        n = x["normal"]
        least = np.eye(3)[np.argmin(abs(n), axis=1)]
        first = np.cross(n, least)
        return np.stack([first, np.cross(n, first), n], axis=2), x["point"]
    w, h = 2 * x["half_width"], 2 * x["half_height"]
    return np.stack([w, h, np.cross(w, h)], axis=2), x["center"]


def unit_shape(row: Row) -> bool:
    """Return whether a row's shape is the unit box, plane or square, which needs no matrix."""
    x = row.inputs
    return (
        (row.file == "box" and x["max"] == (0.5,) * 3 and x["min"] == (-0.5,) * 3)
        or (row.file == "plane" and x["normal"] == (0.0, 0.0, 1.0) and x["point"] == (0.0,) * 3)
        or (row.file == "square" and x["half_width"] == (0.5, 0.0, 0.0) and x["half_height"] == (0.0, 0.5, 0.0)
            and x["center"] == (0.0,) * 3)
    )  # fmt: skip


def orthogonal(row: Row) -> bool:
    """Return whether a square's sides are at right angles, up to the roundings of a rotation."""
    w, h = np.array(row.inputs["half_width"]), np.array(row.inputs["half_height"])
    return bool(abs(w @ h) <= 4 * np.finfo(np.float64).eps * np.linalg.norm(w) * np.linalg.norm(h))


def _distance(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    x, file = columns(rows), rows[0].file
    inputs = uploaded(x, types)
    ray, slot = ray_of(inputs), {"box": "cube"}.get(file, file)
    formula = chosen.formula(slot)
    if file == "sphere":
        shape: Any = SphereArrays(center=inputs["center"], radius=inputs["radius"])
    elif file == "triangle":
        shape = TriangleArrays(first=inputs["a"], second=inputs["b"], third=inputs["c"])
    else:
        shape = record(slot, {}, types)
    if file in ("sphere", "triangle") or unit_shape(rows[0]):
        return {"t": formula.function(ray, shape, ahead(types))}
    if file == "square" and formula.facts.get("space") != "object":
        halves = {"half_width": inputs["half_width"], "half_height": inputs["half_height"]}
        shape = SquareArrays(center=inputs["center"], orthogonal=orthogonal(rows[0]), **halves)
        return {"t": formula.function(ray, shape, ahead(types))}
    place = transform(*_placed(file, x), types)
    local = chosen["to_object"](ray, place)
    t = formula.function(local, shape, ahead(types))
    if file != "box":
        return {"t": t}
    return {"t": t, "point": chosen["position"](ray, t, PlacedRay(ray=local, transform=place))}


def _camera(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    x = columns(rows)
    if "direction" in x:
        inputs = uploaded(x, types)
        clip = chosen[f"clip_{rows[0].inputs['clip']}"]
        near, far = clip(inputs["direction"], inputs["forward"], inputs["near"], inputs["far"])
        zero = inputs["near"] * 0
        return {"t_near": zero + near, "t_far": zero + far}
    pixels = "column" in x
    if pixels:
        x["aspect"] = x["width"] / x["height"]
    inputs = uploaded(x, types)
    cameras: Any = SimpleNamespace(**{name: inputs[name] for name in ("eye", "target", "up", "near", "far")})
    halves = ViewRay._half_sizes(chosen, x, types)
    frame = camera_frame(cameras, chosen, types, half_extent=halves)
    sx, sy = (inputs["sx"], inputs["sy"]) if not pixels else (None, None)
    if pixels:
        px, py = chosen["sample"](inputs["column"], inputs["row"], 1)
        sx, sy = chosen["ndc"](px, py, inputs["width"], inputs["height"])
    return {"direction": chosen["ray"](frame, sx, sy)}


def _normals(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    x, question = columns(rows), rows[0].question
    if question == "placed":
        # A formula may read the matrix itself, which is a literal in the tracer.
        parts = [
            chosen["world_normal"](
                uploaded({"n": x["n"][k : k + 1]}, types)["n"], Transform(to_world=matrix_rows(flat))
            )
            for k, flat in enumerate(x["matrix"])
        ]
        dr.eval(parts)
        return {"normal": np.array([np.array(part, dtype=np.float64).ravel() for part in parts])}
    inputs = uploaded(x, types)
    if question == "sphere":
        return {"normal": chosen["sphere_normal"](inputs["p"], inputs["center"])}
    if question == "facing":
        return {"normal": chosen["facing"](inputs["n"], inputs["d"])}
    ray = ray_of(inputs)
    t = chosen["cube"](ray, record("cube", {}, types), ahead(types))
    formula = chosen.formula("cube_normal")
    return {"normal": formula.function(ray, t) if formula.facts.get("takes") == "ray" else formula.function(ray.at(t))}


def _shadow_ray(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    x = columns(rows)
    if "point" not in x:
        inputs = uploaded(x, types)
        below = chosen["horizon"](chosen["cosine"](inputs["normal"], inputs["light"]))
        return {"visible": dr.select(below, types.Float(0.0), 1.0)}
    sphere = "radius" in x
    if sphere:
        x["c"], x["r"] = x["center"], x["radius"]
    x.setdefault("blocker", x["point"] - x["normal"])  # behind the surface, where it blocks no shadow ray
    x["gap"] = np.zeros(len(rows))
    ladder: Any = SimpleNamespace(options={"surface": "sphere"} if sphere else {})
    formula = next(
        (variant for variant in chosen.chosen if variant.slot in SLOTS_OF["shadow_ray"] and not variant.default),
        chosen.formula("shadow_ray"),
    )
    answer = Shadow().answer(ladder, formula, x, chosen.precision)
    inputs = uploaded({"n": x["normal"], "away": x["light"] - x["point"]}, types)
    below = dr.select(chosen["horizon"](chosen["cosine"](inputs["n"], inputs["away"])), types.Float(1.0), 0.0)
    dark = downloaded({"below": below}, len(rows))["below"]
    return {"visible": ((answer["own"] == 0) & (answer["stopped"] == 0) & (dark == 0)).astype(np.float64)}


def _light(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    question = rows[0].question
    if question == "sum":
        parts = np.array([[float(part) for part in str(row.inputs["lights"]).split()] for row in rows])
        inputs = uploaded({f"light{k}": part for k, part in enumerate(parts.T)}, types)
        return {"e": chosen["sum_lights"](list(inputs.values()))}
    inputs = uploaded(columns(rows), types)
    away = inputs["away"]
    if question == "cosine":
        return {"e": chosen["cosine"](inputs["normal"], away)}
    if question == "simplified":
        return {"e": chosen["simplified"](inputs["flux"], chosen["cosine"](inputs["normal"], away))}
    law = chosen.formula("falloff")
    squared = away.x * away.x + away.y * away.y + away.z * away.z
    e = law.function(inputs["flux"], away if law.facts.get("by") == "away" else squared)
    return {"e": e if question == "facing" else chosen["lambert"](e, chosen["cosine"](inputs["normal"], away))}


def _radiance(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    inputs, question = uploaded(columns(rows), types), rows[0].question
    if question == "dark":
        return {"dark": dr.select(chosen["hidden"](inputs["n"], inputs["d"]), types.Float(1.0), 0.0)}
    if question == "exitance":
        return {"value": chosen["exitance"](inputs["albedo"], inputs["irradiance"])}
    return {"value": chosen["radiance" if question == "radiance" else "radiance_simplified"](inputs["exitance"])}


def _nearest(rows: Members, chosen: Configuration, types: ArrayTypes) -> Mapping[str, Any]:
    x = uploaded(columns(rows), types)
    first, second = (
        chosen["triangle"](
            ray_of(x), TriangleArrays(first=x[f"a{k}"], second=x[f"b{k}"], third=x[f"c{k}"]), ahead(types)
        )
        for k in "12"
    )
    return {"nearest": dr.select(chosen["nearest"](second, first), types.Float(2.0), 1.0)}


ASKED: Mapping[str, Callable[[Members, Configuration, ArrayTypes], Mapping[str, Any]]] = {
    "camera_ray": _camera,
    "normals": _normals,
    "shadow_ray": _shadow_ray,
    "irradiance": _light,
    "radiance": _radiance,
    "nearest": _nearest,
}


def _group(row: Row) -> tuple[object, ...]:
    """Return the key of rows that are computed together."""
    has = tuple(name for name, value in row.inputs.items() if not isinstance(value, str))
    lights = len(str(row.inputs.get("lights", "")).split())
    turned = row.file == "square" and not unit_shape(row) and orthogonal(row)
    return row.file, row.question, has, row.inputs.get("clip"), lights, unit_shape(row), turned


def answered(rows: Mapping[str, Row], chosen: Configuration) -> dict[str, dict[str, str]]:
    """Return the answers of a configuration as the cells of an answer file, by id."""
    groups: dict[tuple[object, ...], list[str]] = {}
    for identity, row in rows.items():
        groups.setdefault(_group(row), []).append(identity)
    types = array_types(chosen.precision)
    cells_by_id: dict[str, dict[str, str]] = {}
    for ids in groups.values():
        members = [rows[identity] for identity in ids]
        raw = ASKED.get(members[0].file, _distance)(members, chosen, types)
        ready = {k: v for k, v in raw.items() if isinstance(v, np.ndarray)}
        arrays = ready | downloaded({k: v for k, v in raw.items() if k not in ready}, len(ids))
        decision, groups_of = FILES[file_of(ids[0])]
        for place, identity in enumerate(ids):
            cells: dict[str, str] = {}
            for name, array in arrays.items():
                names = groups_of.get(name, (name,))
                numbers = np.atleast_1d(array[place]).tolist()
                cells |= {column: number(value) for column, value in zip(names, numbers, strict=False)}
            if decision == "hit":
                cells = {"hit": str(int(np.isfinite(arrays["t"][place]))), **cells}
            elif decision and decision in cells:
                cells[decision] = str(int(float(cells[decision])))
            cells_by_id[identity] = cells
    return {identity: cells_by_id[identity] for identity in rows}


def formulas_of(file: str) -> list[Formula]:
    """Return all formulas of the slots that a file's rows test."""
    return [formula for slot in SLOTS_OF[file] for formula in FORMULAS.variants(slot)]
