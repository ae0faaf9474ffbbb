"""A results folder of the later run that holds the earlier one's images beside its own: the report of what changed."""

import shutil
from copy import copy
from pathlib import Path
from typing import cast

from rayproof.reports.publish.page.case_data import picture_of
from rayproof.reports.publish.parallel import all_of
from rayproof.reports.results.document import save_results
from rayproof.reports.results.images import inside
from rayproof.reports.results.records import (
    CaseRecord,
    ComparedRecord,
    ComparisonRecord,
    ComparisonRowRecord,
    RenderRecord,
    RunRecord,
)
from rayproof.reports.runs.difference.images import called, renderer_pairs, write_both
from rayproof.reports.runs.difference.record import moved, sentence

Results = RunRecord
Job = tuple[tuple[Path, Path], tuple[CaseRecord | None, CaseRecord], dict[str, str], str, Path, str]


def write_folder(
    out: Path, folders: tuple[Path, Path], runs: tuple[Results, Results], record: ComparisonRecord
) -> Results:
    """Fill `out` with the later run's results and both runs' images, complete `record`, and return those results.

    `record` is `reports.runs.difference.record.comparison` of `runs`; it gets the pixels that differ, and its sentence.
    """
    before, after = runs
    label = record["base"]["name"]
    earlier = {case["name"]: case for case in before["cases"]}
    known = [list(run.get("references") or {}) for run in runs]
    # Of an earlier report of two runs, when they had more cases; what else is there is left alone.
    for stale in (out / "images").glob("[0-9][0-9][0-9][0-9]*.js"):
        stale.unlink()
    jobs: list[Job] = []
    for number, case in enumerate(after["cases"], start=1):
        old = earlier.get(case["name"])
        pairs = renderer_pairs(old, case, record["configurations"], known) if old is not None else {}
        jobs.append((folders, (old, case), pairs, label, out, f"images/{number:04}.js"))
    answers = all_of(write_both, jobs, heavy=len(jobs))
    rows = {row["case"]: row for row in record["rows"]}
    renderers: dict[str, str] = {}
    cases = []
    for job, (pixels, written) in zip(jobs, answers, strict=True):
        case, row = job[1][1], rows.get(job[1][1]["name"])
        renderers |= {mine: called(label, old) for mine, old in job[2].items()}
        if row is not None:
            row["pixels"] = pixels
        cases.append(_case(folders[1], out, case, job[5] if written else None, row))
    record["renderers"] = renderers
    record["sentence"] = sentence(record)
    shown = [
        cast(ComparisonRowRecord, {key: value for key, value in row.items() if key != "checks"})
        for row in record["rows"]
        if moved(row)
    ]
    # A history is that of the later run alone, and stands in its own report.
    results = copy(after)
    results.pop("history", None)
    results.update({"cases": cases, "comparison": {**record, "rows": shown}, "faults": record["faults"]})
    save_results(out, results)
    return results


def _case(folder: Path, out: Path, case: CaseRecord, pixels: str | None, row: ComparisonRowRecord | None) -> CaseRecord:
    """Return a case of the later run as the folder has it: images in one script, the checks of both runs."""
    for path in (case.get("scene"), picture_of(folder, case)):
        if isinstance(path, str) and inside(folder, path):
            (out / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder / path, out / path)
    renders: list[RenderRecord] = [{**render, "image": None} for render in case.get("renders", [])]
    compared: ComparedRecord | None = None
    if row is not None:
        compared = {"before": row["before"], "pixels": row["pixels"], "checks": row["checks"]}
    return {**case, "renders": renders, "pixels": pixels, "compared": compared}
