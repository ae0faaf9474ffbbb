"""Score an answer file against the test vectors in this script's folder: `python check.py ANSWERS.csv [float64]`.

The script needs only Python's standard library. An answer file is a CSV with the column `id` and the answer columns of
its file of vectors, such as `id,hit,t`. Before the header, lines that begin with # may declare:

    # inside exit      the t of a ray that starts inside: exit (the default), near (behind the ray) or zero
    # edge 1e-5        a tolerance at edges: rays that clear an outline by no more than this may hit or miss

A row outside the library's documented contract has the word skip in its second column. Exit codes: 0 all rows pass,
1 some fail, 2 the answer file cannot be scored, 3 everything was skipped.
"""

import csv
import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

# Licence of this file and of all files in its folder: CC0-1.0.
VERSION = "1"
# File -> the column of its decision ("" if it has none), and groups of numbers, each with a common limit.
FILES: dict[str, tuple[str, dict[str, tuple[str, ...]]]] = {
    "camera_ray": ("", {"direction": ("dx", "dy", "dz"), "near": ("t_near",), "far": ("t_far",)}),
    "sphere": ("hit", {"t": ("t",)}),
    "box": ("hit", {"t": ("t",), "point": ("x", "y", "z")}),
    "plane": ("hit", {"t": ("t",)}),
    "triangle": ("hit", {"t": ("t",)}),
    "square": ("hit", {"t": ("t",)}),
    "normals": ("", {"normal": ("nx", "ny", "nz")}),
    "shadow_ray": ("visible", {}),
    "irradiance": ("", {"value": ("e",)}),
    "radiance": ("dark", {"value": ("r", "g", "b")}),
    "nearest": ("nearest", {}),
}
OPTIONAL = ("point",)  # groups that are scored only if they are answered
EITHER, SKIP = "either", "skip"
INSIDE = ("exit", "near", "zero")
Row = dict[str, str]


class WrongFileError(Exception):
    """The answer file cannot be scored; the message is one line."""


@dataclass(frozen=True)
class RowVerdict:
    """The outcome of a row or a relation (passed, failed or skipped), and the error over its limit."""

    id: str
    outcome: str
    ratio: float = 0.0  # inf if a decision is wrong
    because: str = ""


@dataclass(frozen=True)
class AnswerFile:
    """An answer file: its declarations, and the answers by id."""

    rows: Mapping[str, Row]
    inside: str = "exit"
    edge: float = 0.0
    name: str = ""
    files: tuple[str, ...] = field(default=())


def file_of(identity: str) -> str:
    """Return the file of an id, without the suffix for extreme scales."""
    return identity.split("-")[1].removesuffix("_extreme")


def read_answers(path: Path, expected: Iterable[str]) -> AnswerFile:
    """Return the answers in a file; `expected` are the ids of all rows.

    Raises:
        WrongFileError: rows are missing, ids are doubled or unknown, or a cell is no number.

    """
    expected = list(expected)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise WrongFileError(f"{path}: {getattr(error, 'strerror', None) or 'not UTF-8 text'}") from error
    declared = {}
    for line in lines:
        words = line[1:].split() if line.startswith("#") else []
        if len(words) > 1:
            declared[words[0]] = " ".join(words[1:])
    table = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    if not table or table[0][:1] != ["id"] or len(table[0]) < 2:
        raise WrongFileError(f"{path}: the first line must name the columns: id, and hit,t or what is answered")
    if declared.get("inside", "exit") not in INSIDE:
        raise WrongFileError(f"{path}: inside is one of {', '.join(INSIDE)}, got {declared['inside']}")
    rows: dict[str, Row] = {}
    for cells in table[1:]:
        if len(cells) != len(table[0]):
            raise WrongFileError(f"{path}: {cells[0]} has {len(cells)} columns, the first line {len(table[0])}")
        if cells[0] in rows:
            raise WrongFileError(f"{path}: {cells[0]} is answered twice")
        rows[cells[0]] = {name: cell.strip() for name, cell in zip(table[0], cells)}  # noqa: B905 - same length
    wanted = set(expected)
    for identity in rows:
        if identity not in wanted:
            version = identity.partition("-")[0]
            other_version = version.isdigit() and version != VERSION
            why = (
                f"is of version {version} of the vectors, these are version {VERSION}" if other_version else "is no id"
            )
            raise WrongFileError(f"{path}: {identity} {why}")
    answered = {identity.split("-")[1] for identity in rows}
    missing = [identity for identity in expected if identity.split("-")[1] in answered and identity not in rows]
    if missing or not rows:
        raise WrongFileError(
            f"{path}: {len(missing) or 'all'} rows have no answer, the first is {(missing or expected)[0]}"
        )
    for identity, row in rows.items():
        _numbers(path, identity, row, table[0][1:])
    try:
        edge = float(declared.get("edge", 0))
    except ValueError:
        raise WrongFileError(f"{path}: edge must be a length, got {declared['edge']}") from None
    name = declared.get("name", path.stem)
    return AnswerFile(
        rows=rows, inside=declared.get("inside", "exit"), edge=edge, name=name, files=tuple(sorted(answered))
    )


def _numbers(path: Path, identity: str, row: Row, columns: list[str]) -> None:
    if SKIP in row.values():
        return
    decision, groups = FILES[file_of(identity)]
    names = [name for group in groups.values() for name in group]
    lacking = [name for name in ([decision] if decision else names[:1]) if name not in columns]
    if lacking:
        raise WrongFileError(f"{path}: {identity} needs the column {lacking[0]}")
    for name in (decision, *names):
        if row.get(name):
            try:
                float(row[name])
            except ValueError:
                raise WrongFileError(f"{path}: {name} of {identity} is no number: {row[name]}") from None
    if decision and not row[decision]:
        raise WrongFileError(f"{path}: {decision} of {identity} is empty")


def distance(answer: str, row: Row, name: str) -> float:
    """Return the distance of an answer from the bounds of column `name`, or from 0 for "zero", without a rounding."""
    value = float(answer)
    low, high = (0.0, 0.0) if name == "zero" else (float(row[f"{name}_low"]), float(row[f"{name}_high"]))
    if not (math.isfinite(value) and math.isfinite(low)):
        return 0.0 if value == low else math.inf
    exact = Fraction(answer)  # all digits that the library wrote, however many
    return float(max(Fraction(low) - exact, exact - Fraction(high), Fraction(0)))


def right_times(row: Row, answers: AnswerFile) -> list[str]:
    """Return the names of the right t: from inside the t that the file declares, from a surface all of them."""
    start = row.get("start", "")
    if start == "on":
        return [name for name in ("t_in", "t_out") if row.get(f"{name}_low")] + ["zero"]
    if start == "inside":
        return [{"exit": "t_out", "near": "t_in", "zero": "zero"}[answers.inside]]
    return ["t_in"]


def judged(identity: str, row: Row, answers: AnswerFile, precision: str) -> RowVerdict:
    """Return the verdict on a row."""
    answer, bits = answers.rows[identity], precision[-2:]
    if SKIP in answer.values():
        return RowVerdict(identity, "skipped")
    decision, groups = FILES[file_of(identity)]
    decided = ""
    if decision and row[f"decision{bits}"]:
        number = float(answer[decision])
        decided = "0" if number == 0 else str(int(number)) if number == int(number) else "?"
        if decision == "hit":
            decided = "1" if number and math.isfinite(float(answer.get("t") or "nan")) else "0"
        right = row[f"decision{bits}"]
        within = row.get("clearance") and float(row["clearance"]) <= answers.edge
        if right == EITHER or within:
            return RowVerdict(identity, "passed")
        if decided != right:
            return RowVerdict(identity, "failed", math.inf, f"{decision} is {decided}, right is {right}")
        if decision == "hit" and decided == "0":
            return RowVerdict(identity, "passed")
    worst, because = 0.0, ""
    for group, names in groups.items():
        limit = row[f"limit{bits}" + ("" if group == next(iter(groups)) else f"_{group}")]
        if not limit or (group in OPTIONAL and not answer.get(names[0])):
            continue
        if group == "t":
            off = min(distance(answer.get("t") or "nan", row, name) for name in right_times(row, answers))
        else:
            required = [name for name in names if row[f"{name}_low"]]
            off = math.hypot(*(distance(answer.get(name) or "nan", row, name) for name in required))
        ratio = off / float(limit)
        if not ratio <= worst:
            worst, because = ratio, f"{group} is off by {off:.3g}, limit {float(limit):.3g}"
    return RowVerdict(identity, "passed" if worst <= 1 else "failed", worst, because if worst > 1 else "")


def related(relation: Row, answers: AnswerFile) -> RowVerdict | None:
    """Return the verdict on a relation between rows, None if a row of it is not answered."""
    members = relation["rows"].split()
    if any(member not in answers.rows for member in members):
        return None
    kept = [answers.rows[member] for member in members]
    if any(SKIP in row.values() for row in kept):
        return RowVerdict(relation["id"], "skipped")
    hits = ["1" if float(row["hit"]) and math.isfinite(float(row.get("t") or "nan")) else "0" for row in kept]
    if relation["relation"] == "at least one hit" and "1" not in hits:
        return RowVerdict(relation["id"], "failed", math.inf, "no row hits: the ray leaks")
    if relation["relation"] == "all alike" and len(set(hits)) > 1:
        return RowVerdict(relation["id"], "failed", math.inf, f"{relation['rows']} are {', '.join(hits)}")
    return RowVerdict(relation["id"], "passed")


def scored(rows: Mapping[str, Row], relations: Iterable[Row], answers: AnswerFile, precision: str) -> list[RowVerdict]:
    """Return the verdicts on all answered rows, and on the relations between them."""
    verdicts = [judged(identity, rows[identity], answers, precision) for identity in answers.rows]
    relation_verdicts = (related(relation, answers) for relation in relations)
    return verdicts + [verdict for verdict in relation_verdicts if verdict is not None]


def read_vectors(folder: Path) -> tuple[dict[str, Row], list[Row]]:
    """Return all rows by id, and the relations."""
    rows: dict[str, Row] = {}
    relations: list[Row] = []
    for path in sorted(folder.glob("*.csv")):
        with path.open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
        if path.stem == "relations":
            relations = table
        elif path.stem.removesuffix("_extreme") in FILES:
            rows |= {row["id"]: row for row in table}
    return rows, relations


def exit_code(verdicts: Iterable[RowVerdict]) -> int:
    """Return 1 if something failed, 3 if nothing was scored, else 0."""
    outcomes = {verdict.outcome for verdict in verdicts}
    return 1 if "failed" in outcomes else 0 if "passed" in outcomes else 3


def main(arguments: list[str]) -> int:
    """Score a file, print the failures, and return the exit code."""
    precision = "float64" if "float64" in arguments[1:] else "float32"
    rows, relations = read_vectors(Path(__file__).resolve().parent)
    try:
        answers = read_answers(Path(arguments[0] if arguments else "answers.csv"), rows)
    except WrongFileError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    verdicts = scored(rows, relations, answers, precision)
    for verdict in verdicts:
        if verdict.outcome == "failed":
            sys.stdout.write(f"{verdict.id} fails: {verdict.because}\n")
    count = {name: sum(verdict.outcome == name for verdict in verdicts) for name in ("passed", "failed", "skipped")}
    summary = ", ".join(f"{number} {name}" for name, number in count.items())
    sys.stdout.write(f"{answers.name}, {precision}: {summary}\n")
    return exit_code(verdicts)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
