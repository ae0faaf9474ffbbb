"""Images of a case in two runs as one script, and the folder in which a browser shows two runs."""

import shutil
from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path
from typing import cast

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.history.run_difference import moved, ours, sentence
from rayproof.reports.publish.page.case_data import all_of, picture_of, scene_of
from rayproof.reports.results.case_records import CaseRecord, ComparedRecord, RenderRecord
from rayproof.reports.results.document import save_results
from rayproof.reports.results.files import write_text
from rayproof.reports.results.images import BASE, Renders, inside, kept_images, renamed, write_pixels
from rayproof.reports.results.records import ComparisonRecord, ComparisonRowRecord, RunRecord

Case = CaseRecord


def renderer_pairs(
    before: Case, after: Case, pairs: Mapping[str, str], known: Sequence[Sequence[str]]
) -> dict[str, str]:
    """Return which renderer under test of the earlier run one of the later answers to, by their configurations.

    `known` are the references of both runs.
    """
    one = {_configuration(before, name): name for name in ours(before, known[0])}
    other = {_configuration(after, name): name for name in ours(after, known[1])}
    return {name: one[pairs[key]] for key, name in other.items() if pairs.get(key) in one}


def differing(before: Mapping[Stage, np.ndarray], after: Mapping[Stage, np.ndarray]) -> int:
    """Return how many pixels of any stage that both hold differ in any bit; all of them where sizes do."""
    spoiled: np.ndarray | None = None
    for stage in before.keys() & after.keys():
        a, b = (np.ascontiguousarray(side[stage], np.float32) for side in (before, after))
        if a.shape != b.shape:
            return int(np.prod(b.shape[:2]))
        apart = np.any(a.view(np.uint32) != b.view(np.uint32), axis=-1)
        spoiled = apart if spoiled is None else spoiled | apart
    return 0 if spoiled is None else int(np.count_nonzero(spoiled))


def write_both(
    folders: tuple[Path, Path],
    cases: tuple[CaseRecord | None, CaseRecord],
    pairs: Mapping[str, str],
    label: str,
    out: Path,
    relative: str,
) -> tuple[int | None, bool]:
    """Write `out`/`relative` with the images of both runs; return how many pixels differ, and whether it was written.

    `cases` are the case in both runs (None where the earlier has none), `pairs` its renderers. The earlier run's
    renderers are called `label` and their name; where not one bit differs they are left out. Pixels are those of all
    renderers under test, None where nothing can be compared.
    """
    before, after = cases
    if before is not None and (stored := _identical(folders, (before, after))) is not None:
        write_text(out / relative, renamed(stored, relative))
        return 0, True
    later, _ = kept_images(folders[1], after)
    earlier = kept_images(folders[0], before)[0] if before is not None else {}
    shared = [(mine, old) for mine, old in pairs.items() if mine in later and old in earlier]
    counts = [differing(earlier[old], later[mine]) for mine, old in shared]
    renders: Renders = {name: later[name] for name in later if name in pairs or name in _wanted(after, later)}
    if any(counts):
        renders |= {called(label, old): earlier[old] for _, old in shared}
    if renders:
        scene = scene_of(folders[1], after)
        write_pixels(out / relative, relative, renders, scene)
    return (sum(counts) if shared else None), bool(renders)


def _identical(folders: tuple[Path, Path], cases: tuple[Case, Case]) -> str | None:
    """Return the script of a case's images where both runs kept the same one, which needs no decoding; else None."""
    kept = [(folder, case.get("pixels")) for folder, case in zip(folders, cases, strict=True)]
    if not all(isinstance(path, str) and inside(folder, path) for folder, path in kept):
        return None
    before, after = ((folder / str(path)).read_text(encoding="utf-8") for folder, path in kept)
    return after if before == after else None


def called(label: str, renderer: str) -> str:
    """Return what a renderer of the run `label` is called among those of another run."""
    return f"{label}: {renderer}"


def _wanted(case: CaseRecord, renders: Renders) -> set[str]:
    """Return whose images help to see what happened: under test, closed forms, and who has the case's verdict."""
    references = {check.reference for check in case.get("checks", [])}
    guilty = {
        check.reference
        for check in case.get("checks", [])
        if check.outcome == case["verdict"] and case["verdict"] != "pass"
    }
    return {BASE} | guilty | {name for name in renders if name not in references}


def _configuration(case: Case, renderer: str) -> str:
    """Return the configuration of a renderer under test."""
    for render in case.get("renders", []):
        if render.get("renderer") == renderer and render.get("configuration") is not None:
            return str(render["configuration"])
    return renderer.removeprefix("tracer-")


# A results folder of the later run that holds the earlier one's images beside its own: the report of what changed.


Results = RunRecord
Job = tuple[tuple[Path, Path], tuple[CaseRecord | None, CaseRecord], dict[str, str], str, Path, str]


def write_folder(
    out: Path, folders: tuple[Path, Path], runs: tuple[Results, Results], record: ComparisonRecord
) -> Results:
    """Fill `out` with the later run's results and both runs' images, complete `record`, and return those results.

    `record` is `reports.history.run_difference.comparison` of `runs`; it gets the pixels that differ, and its sentence.
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
