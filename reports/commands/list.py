"""`rayproof list`: cases, formulas, references, metrics, mistakes, ladders, terms, JSON Schemas."""

import json as json_format
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from rayproof import ROOT
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

Cell = str | int | list[str]  # of the table; a bool is shown as yes or no
Row = dict[str, Cell]  # column -> cell
TERMS = ROOT / "reports" / "terms.md"
ENTRY = re.compile(r"^\*\*(.+?)\*\* - (.+)$", re.MULTILINE)


def catalogue(
    kind: Literal["cases", "formulas", "references", "metrics", "mistakes", "ladders", "terms", "schema"],
    *names: str,
    json: Path | None = None,
    pages: Path | None = None,
) -> int:
    """List cases, formulas, references, metrics, ladders, or the mistakes that explain a run with failures.

    `rayproof list terms end to end` explains a word, and `rayproof list schema results` prints a JSON Schema.

    Parameters
    ----------
    kind
        The kind of things to list.
    names
        With terms: the word to explain; without a word, all are listed. With schema: `scene` for scene files, which is
        the default, or `results` for results.json.
    json
        Also write the list to this file.
    pages
        With mistakes: write a page with pictures into this folder. This takes a minute and needs a checkout.

    """
    if pages is not None:
        if kind != "mistakes":
            raise UsageError(f"--pages goes with mistakes, not {kind}")
        from rayproof.reports.diagnosis.pages import write

        with told_in_one_line():
            writable_folder(pages)
            say(f"{write(pages)} pictures and mistakes.md are in {pages}")
        return 0
    if kind == "terms":
        return show_terms(" ".join(names).strip(), json)
    if kind == "schema":
        return show_schema(names, json)
    if names:
        raise UsageError(f"`list {kind}` takes no name, got {names[0]}")
    kinds = {
        "cases": cases, "formulas": formulas, "references": references, "metrics": metrics,
        "mistakes": mistakes, "ladders": ladders,
    }  # fmt: skip
    rows = kinds[kind]()
    write_json(json, {kind: rows})
    columns = list(rows[0]) if rows else []
    show_table(f"{len(rows)} {kind}", columns, [[text(value) for value in row.values()] for row in rows])
    return 0


def text(value: Cell) -> str:
    """Return a cell's text; a list is joined with commas."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def cases() -> list[Row]:
    """Describe every case."""
    from rayproof.cases.families import CASE_FAMILIES, cases_of, on_request

    return [
        {
            "name": case.name,
            "pixels": f"{case.scene.camera.width}x{case.scene.camera.height}",
            "covers": list(case.covers),
            "on_request": on_request(family),
            "stresses": case.stresses,
        }
        for family in CASE_FAMILIES
        for case in cases_of(family)
    ]


def formulas() -> list[Row]:
    """Describe every formula of the tracer; the kinds "control" and "fault" are wrong on purpose."""
    from rayproof.tracer.formulas import FORMULAS

    return [
        {
            "name": name,
            "kind": FORMULAS[name].kind,
            "stage": str(FORMULAS[name].stage),
            "covers": list(FORMULAS[name].covers),
            "what": first_line(FORMULAS[name].function)
            + (f" Not watertight: {FORMULAS[name].leaks}." if FORMULAS[name].leaks else ""),
        }
        for name in sorted(FORMULAS)
    ]


def references() -> list[Row]:
    """Describe every reference."""
    from rayproof.reference import REFERENCES

    return [
        {
            "name": name,
            "independent": bool(REFERENCES.about(name).get("independent", False)),
            "on_request": bool(REFERENCES.about(name).get("on_request", False)),
            "precision": REFERENCES[name].precision,
            "version": version_of(name),
            "what": first_line(REFERENCES[name]),
        }
        for name in REFERENCES
    ]


def version_of(name: str) -> str:
    """Return a reference's program and version, or the reason why it cannot run here."""
    from rayproof.reference import REFERENCES

    missing: Any = getattr(REFERENCES[name], "missing", None)
    why = missing() if missing is not None else None
    return REFERENCES[name]().version() if why is None else why


def metrics() -> list[Row]:
    """Describe every metric."""
    from rayproof.reports.judge.metrics import METRICS

    return [{"name": name, "what": first_line(METRICS[name])} for name in METRICS]


def mistakes() -> list[Row]:
    """Describe every known mistake: the items of the specification that it breaks, and its verb phrase."""
    from rayproof.reports.diagnosis.pages import in_words, listed
    from rayproof.reports.mistakes import FAMILIES
    from rayproof.reports.results.outcomes import TITLES

    return [
        {
            "name": name,
            "items": list(mistake.items),
            "estimated": name in FAMILIES,
            "about": [TITLES[item] for item in mistake.items],
            "what": in_words(mistake),
        }
        for name, mistake in listed().items()
    ]


def ladders() -> list[Row]:
    """Describe every ladder on which `rayproof stability` measures formulas."""
    from rayproof.cases.ladders import all_ladders

    return [
        {
            "name": ladder.name,
            "slots": list(ladder.slots),
            "what is swept": ladder.parameter,
            "first to break": ladder.first_to_break,
            "survivor": ladder.survivor,
        }
        for ladder in all_ladders()
    ]


def first_line(thing: object) -> str:
    """Return the first line of a docstring."""
    return (thing.__doc__ or "").strip().split("\n")[0]


def show_terms(wanted: str, json: Path | None) -> int:
    """Print the explanation of the word `wanted`, or all words if it is empty; raise UsageError for an unknown word."""
    terms = dict(ENTRY.findall(TERMS.read_text(encoding="utf-8")))
    if not wanted:
        write_json(json, {"terms": terms})
        say(", ".join(terms))
        return 0
    names = {name.casefold(): name for name in terms}
    name = names.get(wanted.casefold().replace("_", " ").replace("-", " ")) or names.get(wanted.casefold().rstrip("s"))
    if name is None:
        from difflib import get_close_matches

        near = get_close_matches(wanted.casefold(), names, n=3)
        hint = f"did you mean {', '.join(near)}?" if near else "`rayproof list terms` lists the words"
        raise UsageError(f"no term is called {wanted!r}; {hint}")
    write_json(json, {"terms": {name: terms[name]}})
    say(f"{name}: {terms[name].replace('`', '')}")
    return 0


def show_schema(names: Sequence[str], json: Path | None) -> int:
    """Print the JSON Schema of scene files or of results.json, or write it to a file."""
    if names in ((), ("scene",)):
        from rayproof.cases.scene_schema import schema
    elif names == ("results",):
        from rayproof.reports.results.records import schema
    else:
        raise UsageError(f"the schemas are scene and results, got {' '.join(names)}")
    if json is None:
        for line in json_format.dumps(schema(), indent=2).splitlines():
            say(line)
    write_json(json, schema())
    return 0
