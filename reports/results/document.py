"""The document of a run: read from results.sqlite or results.json, validated, and written.

A folder contains it as results.sqlite, and for at most `LISTED` cases also as results.json.
"""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, cast

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import NAME as TABLE_NAME
from rayproof.reports.results.case_table import Cases, CaseTable, DamagedTableError
from rayproof.reports.results.compact import TABLE, compact, expand
from rayproof.reports.results.files import SCHEMA, as_json, replacing
from rayproof.reports.results.records import RunRecord, problem

NAME = "results.json"
LISTED = 2000  # cases at most in results.json; `rayproof run --json` writes a file of any length


class ResultsError(ValueError):
    """A results folder that cannot be read; the message is one line that names the file and the field."""


def load_results(folder: Path) -> RunRecord:
    """Return a run's results, validated, from `folder`/results.json or, if it is missing, results.sqlite.

    From results.sqlite, `cases` is a sequence whose records are read when they are accessed.

    Raises:
        ResultsError: the file is missing, is no JSON, or lacks a required field.

    """
    path = folder / NAME
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        if (folder / TABLE_NAME).is_file():
            return _from_table(folder / TABLE_NAME)
        raise ResultsError(f"{path}: no such file; `rayproof run --out {folder}` makes it") from error
    except ValueError as error:
        raise ResultsError(f"{path}: not JSON: {error}") from error
    results = _checked(path, text)
    try:
        expand(results)
    except ValueError as error:  # an unknown stage, which is a key in the file
        raise ResultsError(f"{path}: a check: {error}") from error
    return results


def has_results(folder: Path) -> bool:
    """Return whether a folder contains the results of a finished run."""
    if (folder / NAME).is_file() or not (folder / TABLE_NAME).is_file():
        return (folder / NAME).is_file()
    try:
        return CaseTable(folder / TABLE_NAME).document() is not None
    except (DamagedTableError, OSError):
        return False


def whole(results: RunRecord) -> str:
    """Return the name of the file that contains the whole run."""
    cases = results["cases"]
    return TABLE_NAME if isinstance(cases, Cases) and len(cases) > LISTED else NAME


def save_results(folder: Path, results: RunRecord) -> Path:
    """Write a run's document atomically and return the file: results.json, or results.sqlite of a long run.

    Raises:
        ResultsError: `results` lacks a required field.

    """
    cases = results["cases"]
    if not isinstance(cases, Cases):
        return write_results(folder / NAME, results)
    cases.table.put_document(as_json(_rest(results)))
    if len(cases) <= LISTED:
        return write_results(folder / NAME, results)
    (folder / NAME).unlink(missing_ok=True)
    return folder / TABLE_NAME


def save_early(folder: Path, results: RunRecord) -> None:
    """Save a run that has its verdicts before slow final steps, so that only these are lost if the process is killed.

    The document is written only to results.sqlite, which contains the cases already; an earlier run's results.json is
    removed, since it would be read instead. Raises the errors of `save_results`.
    """
    cases = results["cases"]
    if isinstance(cases, Cases):
        cases.table.put_document(as_json(_rest(results)))
        (folder / NAME).unlink(missing_ok=True)
    else:
        save_results(folder, results)


def write_results(path: Path, results: RunRecord) -> Path:
    """Write the document in the format of results.json to `path`, with all cases, a record at a time; return `path`.

    Raises:
        ResultsError: `results` lacks a required field.

    """
    cases: Any = results.get("cases")
    # The cases are not validated here, which would take half a second; tests compare them with the schema.
    if wrong := problem({**results, "schema": SCHEMA, "cases": [] if isinstance(cases, list | Cases) else cases}):
        raise ResultsError(f"{path}: {wrong}")
    # The top is indented JSON for readers; below, each case is a line, for diff. Half the size of indented JSON.
    places: dict[str, int] = {}
    with replacing(path) as draft, draft.open("w", encoding="utf-8", errors="replace", newline="\n") as file:
        # The table of derivations precedes the cases, but is complete only after the last case.
        with TemporaryFile("w+", encoding="utf-8", errors="replace", newline="\n") as lines:
            for number, case in enumerate(results["cases"]):
                lines.write((",\n" if number else "") + as_json(compact(case, places)))
            lines.seek(0)
            rest = _rest(results) | {TABLE: list(places)}
            file.write(as_json(rest, indent=1)[:-2] + ',\n "cases": [\n')
            shutil.copyfileobj(lines, file)
        file.write("\n ]\n}\n")
    return path


def _rest(results: RunRecord) -> dict[str, Any]:
    return {"schema": SCHEMA} | {key: value for key, value in results.items() if key not in ("schema", "cases", TABLE)}


def _checked(path: Path, text: str) -> RunRecord:
    try:
        results = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ResultsError(f"{path}: not JSON: {error}") from error
    if wrong := problem(results):
        raise ResultsError(f"{path}: {wrong}")
    return cast(RunRecord, results)


def _from_table(path: Path) -> RunRecord:
    try:
        table = CaseTable(path)
        document = table.document()
        if document is None:
            raise ResultsError(f"{path}: holds a run that did not end; `rayproof run --resume` goes on with it")
        table.check()
        cases = table.cases()
        head = json.loads(document)
    except (DamagedTableError, ValueError, RecursionError) as error:
        if isinstance(error, ResultsError):
            raise
        raise ResultsError(str(error) if isinstance(error, DamagedTableError) else f"{path}: {error}") from error
    if not isinstance(head, Mapping):
        raise ResultsError(f"{path}: its document is no object")
    results = _checked(path, json.dumps({**head, "cases": []}))
    results["cases"] = cast("list[CaseRecord]", cases)
    return results
