"""Vectors as files: a CSV per file of `FILES`, `relations.csv`, `vectors.json`, `check.py`; their columns and schema.

Numbers have 17 significant digits, which every language reads back to the same float32 and float64, -0 included; lines
end with a line feed. The digest is the SHA-256 of all CSV files, concatenated in the order of their names.
"""

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rayproof.cases.rounding import PRECISIONS
from rayproof.reference.certified.fields import precision
from rayproof.reports.results.files import write_text
from rayproof.reports.vectors import BITS, NO_FILE, SLOTS_OF, Numbers, Row
from rayproof.reports.vectors.check import FILES, VERSION
from rayproof.reports.vectors.rows import everything
from rayproof.reports.vectors.shapes import length, vector

LICENCE = "CC0-1.0"
CHECKER = Path(__file__).with_name("check.py")
ORDER = (  # of the columns that all files share
    *("id", "class", "question", "item", "ladder", "value"),
    *("decision32", "decision64", "clearance", "start", "face", "length", "unit", "space", "sided", "why"),
)
AXES = {2: ("_s", "_t"), 3: ("_x", "_y", "_z"), 12: tuple(f"{i}{j}" for i in range(3) for j in range(4))}
ROUNDED = 1e-5  # largest deviation of a float32 unit vector's length from 1
CHANNELS = ("_r", "_g", "_b")
MEANINGS = {
    "id": "version, file and number", "class": "core, inside, direction, behind, tie, shared, reported or special",
    "question": "which of the file's questions", "item": "of the specification of rayproof",
    "ladder": "of `rayproof stability`", "value": "of the ladder's parameter",
    "decision32": "what float32 must decide, or either", "decision64": "what float64 must decide, or either",
    "clearance": "by which the ray clears the outline [m]", "start": "of a ray at a solid: outside, inside or on it",
    "face": "which side of a flat shape is seen: front or back", "length": "of the direction",
    "unit": "yes where the direction has length 1", "space": "of all coordinates",
    "sided": "two: both sides of a flat shape count", "why": "one sentence",
}  # fmt: skip


class RelationRecord(msgspec.Struct, frozen=True, kw_only=True):
    """A relation between rows: `at least one hit`, or `all alike` in hit or miss."""

    id: str
    relation: str
    item: str
    rows: str
    why: str


class VectorFile(msgspec.Struct, frozen=True, kw_only=True):
    """One file: its digest, the slots that it tests, its columns with their meaning, its rows."""

    sha256: str
    slots: list[str]
    columns: dict[str, str]
    rows: list[dict[str, str | float]]


class VectorsRecord(msgspec.Struct, frozen=True, kw_only=True):
    """All vectors."""

    version: str
    licence: str
    sha256: str
    files: dict[str, VectorFile]
    relations: list[RelationRecord]


def schema() -> dict[str, Any]:
    """Return the JSON Schema of vectors.json."""
    return msgspec.json.schema(VectorsRecord)


def number(value: float) -> str:
    """Return 17 significant digits, which are read back as the same number."""
    return f"{value:.17g}"


def length_of(direction: tuple[float, ...]) -> float:
    """Return the length of a direction, correctly rounded; NaN if a component is not finite."""
    if not np.all(np.isfinite(direction)):
        return float("nan")
    with precision(BITS):
        return float(length(vector(direction)).mid())


def flat(name: str, value: Numbers) -> dict[str, str | float]:
    """Return an input as columns: a vector has one column per component."""
    if not isinstance(value, tuple):
        return {name: value}
    ends = CHANNELS if name in ("albedo", "irradiance", "exitance") else AXES[len(value)]
    return {f"{name}{end}": part for end, part in zip(ends, value, strict=True)}


def cells(identity: str, row: Row) -> dict[str, str | float]:
    """Return all cells of a row by their columns."""
    exact, (_, groups) = row.exact, FILES[row.file]
    by_column: dict[str, str | float] = {
        "id": identity, "class": row.kind, "question": row.question, "item": row.item, "ladder": row.ladder,
        "value": "" if row.value is None else row.value,
    }  # fmt: skip
    for name, value in row.inputs.items():
        by_column |= flat(name, value)
    for name in PRECISIONS if FILES[row.file][0] else ():
        by_column[f"decision{name[-2:]}"] = exact.decision.get(name, "")
    for name, (low, high) in exact.values.items():
        by_column |= {f"{name}_low": low, f"{name}_high": high}
    for place, group in enumerate(groups):
        for name in PRECISIONS:
            limit = exact.limits.get(group, {}).get(name, "")
            by_column[f"limit{name[-2:]}" + (f"_{group}" if place else "")] = limit
    direction = row.inputs.get("d")
    if isinstance(direction, tuple):
        size = length_of(direction)
        by_column |= {"length": size, "unit": "yes" if abs(size - 1) < ROUNDED else "no"}
    if exact.clearance is not None:
        by_column["clearance"] = exact.clearance
    by_column |= {"start": exact.start, "face": exact.face, "space": row.space, "sided": row.sided, "why": row.why}
    return by_column


def columns(table: Iterable[dict[str, str | float]], order: Sequence[str]) -> list[str]:
    """Return the columns of all rows: the first six of `order`, the columns not in `order`, the rest of `order`."""
    present = dict.fromkeys(name for row in table for name in row)
    head, tail = order[:6], order[6:]
    inner = [name for name in present if name not in order]
    # Inputs first, then bounds of the answer, then limits.
    inner.sort(key=lambda name: (name.startswith("limit"), name.endswith(("_low", "_high"))))
    return [*head, *inner, *(name for name in tail if name in present)]


def as_csv(names: Sequence[str], table: Iterable[dict[str, str | float]]) -> str:
    """Return a table as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for row in table:
        kept = (row.get(name, "") for name in names)
        writer.writerow([cell if isinstance(cell, str) else number(cell) for cell in kept])
    return text.getvalue()


def tables(wanted: Iterable[str] = FILES) -> dict[str, list[dict[str, str | float]]]:
    """Return the cells of every row of these files and of their extreme scales, by file."""
    rows, _ = everything()
    by_file: dict[str, list[dict[str, str | float]]] = {}
    kept = set(wanted)
    for identity, row in rows.items():
        if row.file in kept:
            by_file.setdefault(identity.split("-")[1], []).append(cells(identity, row))
    return by_file


def contents(wanted: Iterable[str] = FILES) -> dict[str, str]:
    """Return the text of every file by its name."""
    wanted = list(wanted)
    by_file, texts = tables(wanted), {}
    names = {file: columns(table, ORDER) for file, table in by_file.items()}
    for file, table in by_file.items():
        texts[f"{file}.csv"] = as_csv(names[file], table)
    ids = {str(row["id"]) for table in by_file.values() for row in table}
    relations = [relation for relation in everything()[1] if ids.issuperset(relation["rows"].split())]
    if relations:
        texts["relations.csv"] = as_csv(list(relations[0]), [dict(relation) for relation in relations])
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
    whole = hashlib.sha256("".join(texts[name] for name in sorted(texts)).encode()).hexdigest()
    record = VectorsRecord(
        version=VERSION,
        licence=LICENCE,
        sha256=whole,
        files={
            file: VectorFile(
                sha256=digests[f"{file}.csv"],
                slots=list(SLOTS_OF[file.removesuffix("_extreme")]),
                columns={name: MEANINGS.get(name, meaning(name)) for name in names[file]},
                rows=[
                    {k: v if isinstance(v, str) or np.isfinite(v) else number(v) for k, v in row.items()}
                    for row in table
                ],
            )
            for file, table in by_file.items()
        },
        relations=[RelationRecord(**relation) for relation in relations],
    )
    texts["vectors.json"] = msgspec.json.format(msgspec.json.encode(record), indent=1).decode() + "\n"
    texts["schema.json"] = json.dumps(schema(), indent=1) + "\n"
    texts["slots.md"] = slots_table()
    texts["check.py"] = CHECKER.read_text(encoding="utf-8")
    return texts


def slots_table() -> str:
    """Return a Markdown table with the file of every slot of `rayproof list formulas`, or the reason for none."""
    places = {slot: f"`{file}.csv`" for file, slots in SLOTS_OF.items() for slot in slots} | NO_FILE
    return "".join(f"| {slot} | {place} |\n" for slot, place in [("slot", "file"), ("---", "---"), *places.items()])


def meaning(name: str) -> str:
    """Return the meaning of a column of numbers."""
    if name.startswith("limit"):
        return f"largest error of float{name[5:7]}, empty where none is asked for"
    for end, bound in (("_low", "lower"), ("_high", "upper")):
        if name.endswith(end):
            return f"{bound} bound of {name.removesuffix(end)}, rounded outward"
    return "input, a float32 number"


def write(folder: Path, wanted: Iterable[str] = FILES) -> dict[str, str]:
    """Write the files and return their texts by name."""
    texts = contents(wanted)
    for name, text in texts.items():
        write_text(folder / name, text)
    return texts


def as_read(wanted: Iterable[str] = FILES) -> tuple[dict[str, dict[str, str]], list[dict[str, str]]]:
    """Return rows by id, and relations, as the checker reads them from the files, with every column."""
    by_id: dict[str, dict[str, str]] = {}
    for table in tables(wanted).values():
        names = {name for row in table for name in row}
        for row in table:
            texts = {name: value if isinstance(value, str) else number(value) for name, value in row.items()}
            by_id[texts["id"]] = dict.fromkeys(names, "") | texts
    return by_id, [relation for relation in everything()[1] if relation["rows"].split()[0] in by_id]
