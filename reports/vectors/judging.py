"""The judgement on an answer file: score, ladders' breakpoints, worst rows, formulas that fail alike; JUnit."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from rayproof.cases.ladders import Ladder
from rayproof.reports.publish.junit import legal
from rayproof.reports.studies.stability.questions import QUESTIONS
from rayproof.reports.vectors import Row
from rayproof.reports.vectors.answering import answered, configured, formulas_of
from rayproof.reports.vectors.check import SKIP, AnswerFile, RowVerdict, exit_code, scored
from rayproof.reports.vectors.files import as_read
from rayproof.reports.vectors.rows import LADDERS, everything
from rayproof.tracer.formulas import FORMULAS

Cells = Mapping[str, str]
LADDERS_TITLE = "ladders, by the gate of rayproof stability at float32 inputs"  # which draws float64 inputs for float64
ALIKE = 0.5  # smallest share of common failures for which a formula is named


@dataclass(frozen=True, kw_only=True)
class LadderReach:
    """The values of a ladder up to which the answers are right, by the gate of `rayproof stability`."""

    ladder: Ladder
    breakpoint: float | None  # the last value up to which all are right, None if the first value is wrong
    last: float  # the last value that has rows

    @property
    def whole(self) -> bool:
        """Return whether all values are right."""
        return self.breakpoint == self.last


@dataclass(frozen=True, kw_only=True)
class FileJudgement:
    """The judgement on an answer file."""

    name: str
    precision: str
    verdicts: Sequence[RowVerdict]
    reaches: Sequence[LadderReach]
    alike: Mapping[str, str]  # file -> a sentence

    @property
    def exit_code(self) -> int:
        """Return 1 if a row or a relation fails, 3 if nothing was scored, else 0."""
        return exit_code(self.verdicts)

    def of_file(self, file: str) -> list[RowVerdict]:
        """Return the verdicts on one file's rows, its extreme scales included, or on the relations."""
        return [verdict for verdict in self.verdicts if _family(verdict.id) == file]

    @property
    def files(self) -> list[str]:
        """Return the files that were answered, and "relation" if there are verdicts on relations."""
        return list(dict.fromkeys(_family(verdict.id) for verdict in self.verdicts))


def _family(identity: str) -> str:
    return identity.split("-")[1]


def judge(answers: AnswerFile, precision: str) -> FileJudgement:
    """Return the judgement on an answer file of a precision."""
    wanted = {file.removesuffix("_extreme") for file in answers.files}
    rows, relations = as_read(wanted)
    verdicts = scored(rows, relations, answers, precision)
    members = {identity: everything()[0][identity] for identity in answers.rows}
    reaches = climbed(members, answers.rows, precision)
    alike = {
        file: sentence
        for file in sorted(wanted)
        if (sentence := _alike(file, rows, relations, answers, verdicts, precision)) is not None
    }
    return FileJudgement(name=answers.name, precision=precision, verdicts=verdicts, reaches=reaches, alike=alike)


# Ladders.


def climbed(members: Mapping[str, Row], cells: Mapping[str, Cells], precision: str) -> list[LadderReach]:
    """Return the reach of the answers on each ladder that has rows among them."""
    rays: dict[str, dict[tuple[float, int], list[str]]] = {}
    for identity, row in members.items():
        if row.ladder and SKIP not in cells[identity].values():
            rays.setdefault(row.ladder, {}).setdefault((float(row.value or 0), row.ray), []).append(identity)
    return [_climb(ladder, members, cells, rays[ladder.name], precision) for ladder in LADDERS if ladder.name in rays]


def _climb(
    ladder: Ladder,
    members: Mapping[str, Row],
    cells: Mapping[str, Cells],
    rays: Mapping[tuple[float, int], list[str]],
    precision: str,
) -> LadderReach:
    first = [members[ids[0]].given for ids in rays.values()]
    inputs = {name: np.concatenate([inputs_of_ray[name] for inputs_of_ray in first]) for name in first[0]}
    steps = np.array([ladder.values.index(value) for value, _ in rays])
    question = QUESTIONS[ladder.question]()
    truth = question.truth(ladder, inputs, steps)
    cells_by_ray = [[cells[identity] for identity in ids] for ids in rays.values()]
    answer = {name: np.array(column) for name, column in _answer(ladder, cells_by_ray, inputs).items()}
    grades = question.grade(ladder, inputs, truth, answer, precision)
    off = np.nan_to_num(grades.index, nan=0.0) > ladder.gate.index
    bad = grades.counted & (grades.false_hit | grades.false_miss | grades.invalid | off)
    last = None
    for step in np.unique(steps):
        if np.any(bad[steps == step]):
            break
        last = ladder.values[step]
    return LadderReach(ladder=ladder, breakpoint=last, last=ladder.values[int(steps.max())])


def _numbers(row: Cells, names: Sequence[str]) -> list[float]:
    return [float(row.get(name) or "nan") for name in names]


def _time(row: Cells) -> float:
    """Return t, inf for a miss."""
    return float(row.get("t") or "nan") if float(row["hit"]) else math.inf


def _answer(
    ladder: Ladder, cells_by_ray: Sequence[Sequence[Cells]], inputs: Mapping[str, np.ndarray]
) -> Mapping[str, list]:
    """Return the answers, a list of cells per ray, as arguments of the ladder's question."""
    first, slot = [cells[0] for cells in cells_by_ray], ladder.slots[0]
    vectors = {"view_ray": "d", "sphere_normal": "n", "placed_normal": "n", "facing": "n", "face": "normal"}
    match ladder.question:
        case "distance" | "special_distance" | "placed_distance":
            return {"t": [_time(row) for row in first]}
        case "watertight":
            return {"found": [sum(math.isfinite(_time(row)) for row in cells) for cells in cells_by_ray]}
        case "view_ray":
            return {"d": [_numbers(row, ("dx", "dy", "dz")) for row in first]}
        case "sphere_normal" | "placed_normal" | "facing" | "face" as question:
            return {vectors[question]: [_numbers(row, ("nx", "ny", "nz")) for row in first]}
        case "light" | "dark_light" | "value" if slot in ("falloff", "cosine", "sum_lights"):
            name = {"light": "value", "dark_light": "E", "value": "sum"}[ladder.question]
            return {name: [_numbers(row, ("e",))[0] for row in first]}
        case "value" if slot == "exitance":
            return {f"0{k}": [_numbers(row, ("r", "g", "b"))[k] for row in first] for k in range(3)}
        case "value" if slot in ("radiance", "radiance_simplified"):
            return {"L": [_numbers(row, ("r",))[0] for row in first]}
        case "value":
            return {end: [_numbers(row, (f"t_{end}",))[0] for row in first] for end in ("near", "far")}
        case "order":
            return {"second": [float(row["nearest"]) - 1 for row in first]}
        case "shadow":
            lit, stopped = ([1 - float(cells[k]["visible"]) for cells in cells_by_ray] for k in (0, 1))
            return {"own": lit, "stopped": stopped}
        case _ if slot == "hidden":
            return {"yes": [float(row["dark"]) for row in first]}
        case _ if slot == "horizon":
            return {"yes": [1 - float(row["visible"]) for row in first]}
        case _:
            ends = [_numbers(row, ("t_near", "t_far")) for row in first]
            return {"yes": [float(a < t < b) for (a, b), t in zip(ends, inputs["t"], strict=True)]}


# The formulas that fail on the same rows.


def _failures(verdicts: Sequence[RowVerdict]) -> set[str]:
    return {verdict.id for verdict in verdicts if verdict.outcome == "failed"}


def _alike(
    file: str,
    rows: Mapping[str, dict[str, str]],
    relations: Sequence[dict[str, str]],
    answers: AnswerFile,
    own: Sequence[RowVerdict],
    bits: str,
) -> str | None:
    """Return a sentence with the formulas of the tracer that fail the same rows and relations; None without failures.

    The similarity of two sets of failures is the size of their intersection over that of their union, so that a formula
    that fails every row resembles no other.
    """
    members = {identity: row for identity, row in everything()[0].items() if row.file == file and identity in rows}
    related = [relation for relation in relations if relation["rows"].split()[0] in members]
    known_ids = set(members) | {relation["id"] for relation in related}
    failures = _failures(own) & known_ids
    if not failures:
        return None
    share: dict[str, float] = {}
    for formula in formulas_of(file):
        cells = answered(members, configured(formula, bits))
        formula_failures = _failures(scored(rows, related, AnswerFile(rows=cells), bits))
        share[formula.name] = len(failures & formula_failures) / len(failures | formula_failures)
    best = max(share.values())
    if best < ALIKE:
        return f"{len(failures)} fail; no known formula fails alike"
    names = [name for name, alike in share.items() if alike == best]
    about = FORMULAS[names[0]]
    description = about.known_bad or about.facts.get("says") or about.summary
    return f"{len(failures)} fail, as with {' and '.join(names)} in {best:.0%} of what fails with either: {description}"


# Publication.


def reach_cell(reach: LadderReach) -> str:
    """Return the breakpoint of a ladder, for a table."""
    return "none" if reach.breakpoint is None else f"{reach.breakpoint:g}" + (" (all)" if reach.whole else "")


def markdown(judgement: FileJudgement) -> str:
    """Return the judgement as Markdown."""
    lines = [
        f"# {judgement.name}, {judgement.precision}",
        "",
        "| file | rows | fail | skipped | worst | of its limit |",
    ]
    lines += ["|---|---|---|---|---|---|"]
    for file in judgement.files:
        own = judgement.of_file(file)
        worst = max(own, key=lambda verdict: verdict.ratio)
        counts = [sum(verdict.outcome == outcome for verdict in own) for outcome in ("failed", "skipped")]
        lines.append(f"| {file} | {len(own)} | {counts[0]} | {counts[1]} | {worst.id} | {worst.ratio:.3g} |")
    lines += ["", f"{LADDERS_TITLE.capitalize()}:", "", "| ladder | what grows | right up to |", "|---|---|---|"]
    for reach in judgement.reaches:
        lines.append(f"| {reach.ladder.name} | {reach.ladder.parameter} | {reach_cell(reach)} |")
    lines += [""] + [f"* {file}: {sentence}" for file, sentence in judgement.alike.items()]
    lines += [f"* {verdict.id}: {verdict.because}" for verdict in judgement.verdicts if verdict.outcome == "failed"]
    return "\n".join(lines).rstrip() + "\n"


def junit(judgement: FileJudgement) -> str:
    """Return the judgement as JUnit XML: a suite per file, a case per row."""
    root = ElementTree.Element("testsuites", {"name": legal(f"rayproof vectors {judgement.name}")})
    for file in judgement.files:
        own = judgement.of_file(file)
        count = {name: sum(verdict.outcome == name for verdict in own) for name in ("failed", "skipped")}
        numbers = {"tests": len(own), "failures": count["failed"], "errors": 0, "skipped": count["skipped"]}
        suite = ElementTree.SubElement(root, "testsuite", {"name": file} | {k: str(v) for k, v in numbers.items()})
        for verdict in own:
            case = ElementTree.SubElement(suite, "testcase", {"name": verdict.id, "classname": f"vectors.{file}"})
            if verdict.outcome == "failed":
                ElementTree.SubElement(case, "failure", {"message": legal(verdict.because)})
            elif verdict.outcome == "skipped":
                ElementTree.SubElement(case, "skipped")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
