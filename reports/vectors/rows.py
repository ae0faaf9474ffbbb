"""All rows with ids: chosen rays of ladders, rows made by hand, extreme rows; relations between rows.

`chosen.json` contains, for each value of each ladder, indices into the ladder's seeded draw in float32: a few rays on
which every formula fails that fails at that value, and no other formula (`tests/harness/choose_vectors.py` makes it).
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder, all_ladders
from rayproof.reports.studies.stability.questions.watertight import fans
from rayproof.reports.vectors import Exact, Numbers, Row, shapes, values
from rayproof.reports.vectors.check import EITHER, FILES, VERSION
from rayproof.reports.vectors.handmade_rows import ORIGIN, in_faces, made

CHOSEN = Path(__file__).with_name("chosen.json")
# (file, question) -> the function of the exact answer, the item of the specification.
QUESTIONS: Mapping[tuple[str, str], tuple[Callable[[Any], Exact], str]] = {
    ("camera_ray", "direction"): (values.direction, "CAM-4"),
    ("camera_ray", "clip"): (values.clipped, "HIT-2"),
    ("sphere", "distance"): (shapes.sphere, "HIT-1"),
    ("box", "distance"): (shapes.box, "HIT-3"),
    ("plane", "distance"): (shapes.plane, "HIT-4"),
    ("triangle", "distance"): (shapes.triangle, "HIT-6"),
    ("square", "distance"): (shapes.square, "HIT-8"),
    ("normals", "sphere"): (values.sphere_normal, "NRM-1"),
    ("normals", "box"): (values.box_normal, "NRM-2"),
    ("normals", "placed"): (values.placed_normal, "NRM-3"),
    ("normals", "facing"): (values.facing, "NRM-3"),
    ("shadow_ray", "shadow_ray"): (values.visible, "LIT-1"),
    ("shadow_ray", "horizon"): (values.above, "LIT-1"),
    ("irradiance", "facing"): (values.facing_light, "RAD-1"),
    ("irradiance", "cosine"): (values.cosine, "RAD-2"),
    ("irradiance", "lit"): (values.lit, "RAD-2"),
    ("irradiance", "simplified"): (values.simplified, "RAD-3"),
    ("irradiance", "sum"): (values.summed, "RAD-5"),
    ("radiance", "exitance"): (values.exitance, "RAD-4"),
    ("radiance", "radiance"): (values.radiance, "RAD-4"),
    ("radiance", "simplified"): (values.simplified_radiance, "RAD-3"),
    ("radiance", "dark"): (values.dark, "RAD-4"),
    ("nearest", "nearest"): (values.nearest, "HIT-9"),
}
# Ladders without rows: they test trees, points in space, matrices, or strategies inside a renderer.
NOT_ASKED = ("tree", "point", "baked_distance", "special_camera", "special_light")
NOT_SLOTS = ("sample", "ndc", "pixel", "projection", "inverse", "view", "corners", "to_object")
NOT_LADDERS = ("SHD-SELF", "SHD-COPLANAR", "SHD-BALL-REPROJECTED")
LADDERS = tuple(
    ladder
    for ladder in all_ladders()
    if ladder.question not in NOT_ASKED and ladder.slots[0] not in NOT_SLOTS and ladder.name not in NOT_LADDERS
)
# Bounds of lengths in a row that is not of extreme scale: products of four such lengths are finite in float32.
SMALLEST, LARGEST = 1e-9, 1e9


def drawn(ladder: Ladder) -> tuple[Inputs, np.ndarray]:
    """Return the inputs of a ladder in the form of rows, and the index of each ray's value.

    They are the inputs that `rayproof stability` draws in float32; a blocker is given by its position.
    """
    generator = np.random.default_rng(ladder.seed)
    rays = ladder.quick_rays if ladder.question == "watertight" else ladder.rays
    parts = [ladder.draw(value, rays, generator, "float32") for value in ladder.values]
    inputs = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    if "gap" in inputs and "blocker" not in inputs:
        point, normal, gap = (inputs[name].astype(np.float32) for name in ("point", "normal", "gap"))
        inputs["blocker"] = (point + normal * gap[:, np.newaxis]).astype(np.float64)
    lengths = [len(next(iter(part.values()))) for part in parts]
    return inputs, np.repeat(np.arange(len(ladder.values)), lengths)


def _row(file: str, question: str, inputs: Mapping[str, Numbers], why: str, **about: Any) -> Row:
    exact, item = QUESTIONS[file, question]
    answer = exact(inputs)
    numbers = [np.ravel(value).tolist() for value in inputs.values() if not isinstance(value, str)]
    kind = about.pop("kind", "")
    if not np.all(np.isfinite([number for part in numbers for number in part])):
        kind = "special"
    elif not kind and answer.decision.get("float32") == EITHER:
        kind = "tie"
    elif not kind and answer.start in ("inside", "on"):
        kind = "inside"
    elif not kind and "d" in inputs and abs(np.linalg.norm(np.array(inputs["d"])) - 1) > 1e-5:
        kind = "direction"
    sided = "two" if file in ("plane", "triangle", "square", "nearest") else ""
    return Row(file=file, question=question, kind=kind or "core", item=item, inputs=inputs, exact=answer, why=why,
               sided=sided, **about)  # fmt: skip


def extreme(row: Row) -> bool:
    """Return whether a row has lengths that only formulas for extreme scales can compute, or infinities or NaN."""
    for value in row.inputs.values():
        if not isinstance(value, str) or "inf" in value:
            size = float(np.linalg.norm(np.array(value, dtype=np.float64))) if not isinstance(value, str) else 0.0
            if size != 0 and not SMALLEST <= size <= LARGEST:
                return True
    ends = [abs(end) for low, high in row.exact.values.values() for end in (low, high)]
    return any(end != 0 and end != float("inf") and not 1e-37 <= end <= 1e37 for end in ends)


# Rays of ladders.


def _of_ladder(ladder: Ladder, x: Mapping[str, Any]) -> Iterator[tuple[str, str, dict[str, Numbers], str]]:
    """Yield file, question, inputs and kind of the rows of a ladder's ray."""
    shape, slot = ladder.options.get("shape"), ladder.slots[0]
    ray: dict[str, Numbers] = {"o": x["o"], "d": x["d"]} if "o" in x else {}
    match ladder.question:
        case "distance" | "special_distance":
            own: dict[str, dict[str, Numbers]] = {
                "sphere": {"center": x.get("c", ORIGIN), "radius": x.get("r", 1.0)},
                "cube": {"min": (-0.5, -0.5, -0.5), "max": (0.5, 0.5, 0.5)},
                "plane": {"point": ORIGIN, "normal": (0.0, 0.0, 1.0)},
                "triangle": {name: x[name] for name in "abc" if name in x},
                "square": {"center": ORIGIN, "half_width": (0.5, 0.0, 0.0), "half_height": (0.0, 0.5, 0.0)},
            }
            yield "box" if shape == "cube" else str(shape), "distance", ray | own[str(shape)], ""
        case "placed_distance":
            m = x["matrix"]
            center, width, height = ((m[i], m[4 + i], m[8 + i]) for i in (3, 0, 1))
            placed: dict[str, Numbers] = {"center": center}
            placed |= {"half_width": tuple(c / 2 for c in width), "half_height": tuple(c / 2 for c in height)}
            yield "square", "distance", ray | placed, ""
        case "view_ray":
            names = ("eye", "target", "up", "fovy", "near", "far", "aspect", "sx", "sy")
            yield "camera_ray", "direction", {name: x[name] for name in names}, ""
        case "sphere_normal":
            yield "normals", "sphere", {"p": x["p"], "center": x["c"]}, ""
        case "placed_normal":
            yield "normals", "placed", {"matrix": x["matrix"], "n": x["n"]}, ""
        case "facing":
            yield "normals", "facing", {"n": x["n"], "d": x["d"]}, ""
        case "face":
            yield "normals", "box", ray, ""
        case "light":
            row_inputs = {name: x[name] for name in (("flux", "away") if slot == "falloff" else ("normal", "away"))}
            yield "irradiance", "facing" if slot == "falloff" else "cosine", row_inputs, ""
        case "dark_light":
            yield "irradiance", "lit", {name: x[name] for name in ("flux", "normal", "away")}, ""
        case "order":
            second = {f"{name}2": x[f"{name}2"] for name in "abc"}
            yield "nearest", "nearest", ray | {f"{name}1": x[name] for name in "abc"} | second, ""
        case "watertight":
            for a, b, c in fans(ladder):
                yield "triangle", "distance", ray | {"a": x[f"p{a}"], "b": x[f"p{b}"], "c": x[f"p{c}"]}, "shared"
        case "shadow":
            yield from _shadow(x, ray)
        case "value" if slot == "sum_lights":
            lights = [x[f"light{k}"] for k in range(len(x))]
            while len(lights) > 1 and lights[-1] == 0:
                del lights[-1]
            yield "irradiance", "sum", {"lights": " ".join(f"{light:.17g}" for light in lights)}, ""
        case "value" if slot == "exitance":
            yield "radiance", "exitance", {name: x[name] for name in ("albedo", "irradiance")}, ""
        case "value" if slot in ("radiance", "radiance_simplified"):
            question = "radiance" if slot == "radiance" else "simplified"
            yield "radiance", question, {"exitance": (x["exitance"],) * 3}, ""
        case "decision" if slot == "hidden":
            yield "radiance", "dark", {"n": x["n"], "d": x["d"]}, ""
        case "decision" if slot == "horizon":
            yield "shadow_ray", "horizon", {"normal": x["n"], "light": x["d"]}, ""
        case _:  # clipping
            clip = slot.removeprefix("clip_")
            row_inputs = {name: x[name] for name in ("direction", "forward", "near", "far")}
            yield "camera_ray", "clip", {"clip": clip, **row_inputs}, ""


def _shadow(x: Mapping[str, Any], ray: dict[str, Numbers]) -> Iterator[tuple[str, str, dict[str, Numbers], str]]:
    sphere = {"center": x.get("c", ""), "radius": x.get("r", "")}
    row_inputs = ray | {"point": x["point"], "normal": x["normal"], **sphere, "light": x["light"]}
    yield "shadow_ray", "shadow_ray", row_inputs | {"blocker": ""}, ""
    yield "shadow_ray", "shadow_ray", row_inputs | {"blocker": x["blocker"]}, ""


def _plain(array: np.ndarray) -> Any:
    value = array[0]
    return tuple(map(float, value)) if np.ndim(value) else float(value)


def of_rays(ladder: Ladder, inputs: Inputs, whys: Sequence[str]) -> list[Row]:
    """Return rays of a ladder as rows, each with its reason from `whys`."""
    rows: list[Row] = []
    for ray, why in enumerate(whys):
        ray_inputs = {name: array[ray : ray + 1] for name, array in inputs.items()}
        x = {name: _plain(array) for name, array in ray_inputs.items()}
        for file, question, row_inputs, kind in _of_ladder(ladder, x):
            rows.append(_row(file, question, row_inputs, why, kind=kind or "reported", ray=ray, given=ray_inputs))
    return rows


def of_ladders() -> Iterator[Row]:
    """Yield the rows of all ladders' chosen rays."""
    chosen: dict[str, list[list[int]]] = json.loads(CHOSEN.read_text(encoding="utf-8"))
    for ladder in LADDERS:
        inputs, _ = drawn(ladder)
        for value, rays in zip(ladder.values, chosen[ladder.name], strict=True):
            for ray in rays:
                ray_inputs = {name: array[ray : ray + 1] for name, array in inputs.items()}
                x = {name: _plain(array) for name, array in ray_inputs.items()}
                why = f"{ladder.parameter.capitalize()}: {value:g}."
                for file, question, row_inputs, kind in _of_ladder(ladder, x):
                    yield _row(
                        file,
                        question,
                        row_inputs,
                        why,
                        kind=kind,
                        ladder=ladder.name,
                        value=value,
                        ray=ray,
                        given=ray_inputs,
                    )


# Everything, with ids.


@cache
def everything() -> tuple[dict[str, Row], list[dict[str, str]]]:
    """Return all rows by id, ordered by file, and the relations between them."""
    faces = [(_row(file, question, x, why, kind=kind), place) for (file, question, x, why, kind), place in in_faces()]
    by_hand = (_row(file, question, x, why, kind=kind) for file, question, x, why, kind in made())
    rows = [*of_ladders(), *by_hand, *(row for row, _ in faces)]
    named: dict[str, Row] = {}
    identity: dict[int, str] = {}
    for file in FILES:
        for name in (file, f"{file}_extreme"):
            members = [row for row in rows if row.file == file and extreme(row) == (name != file)]
            for number, row in enumerate(members, 1):
                identity[id(row)] = f"{VERSION}-{name}-{number:03d}"
                named[identity[id(row)]] = row
    groups: dict[tuple[str, float | None, int], list[str]] = {}
    for row in rows:
        if row.kind == "shared" and row.ladder:
            groups.setdefault((row.ladder, row.value, row.ray), []).append(identity[id(row)])
    relations = [
        ("at least one hit", ids, "HIT-6", "A ray at a shared edge or vertex meets one of the triangles.")
        for ids in groups.values()
    ]
    of_face = {place: identity[id(row)] for row, place in faces}
    for axis in range(3):
        for side in (-1, 1):
            pair = [of_face[axis, side, zero] for zero in (0, 1)]
            relations.append(("all alike", pair, "HIT-3", "+0 and -0 are the same direction."))
        for zero in (0, 1):
            pair = [of_face[axis, side, zero] for side in (-1, 1)]
            relations.append(("all alike", pair, "HIT-3", "The low face and the high face are alike."))
    return named, [
        {"id": f"{VERSION}-relation-{number:03d}", "relation": kind, "item": item, "rows": " ".join(ids), "why": why}
        for number, (kind, ids, item, why) in enumerate(relations, 1)
    ]
