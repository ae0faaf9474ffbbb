"""The images of a case from two runs in one script, and the results folder of a report on two runs."""

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
    before: Case, after: Case, pairs: Mapping[str, str], references: Sequence[Sequence[str]]
) -> dict[str, str]:
    """Return the subject's renderers of the later run, mapped to those of the earlier run with paired configurations.

    `references` are the names of the references of both runs.
    """
    earlier = {_configuration(before, name): name for name in ours(before, references[0])}
    later = {_configuration(after, name): name for name in ours(after, references[1])}
    return {name: earlier[pairs[key]] for key, name in later.items() if pairs.get(key) in earlier}


def differing(before: Mapping[Stage, np.ndarray], after: Mapping[Stage, np.ndarray]) -> int:
    """Return the number of pixels that differ in a bit, at any stage in both; all pixels if the sizes differ."""
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
    """Write `out`/`relative` with the images of both runs; return the number of pixels that differ, and if it exists.

    `cases` is the case in both runs, None if the earlier run does not have it; `pairs` are its paired renderers. The
    names of the earlier run's renderers get the prefix `label`; their images are left out if no bit differs. The number
    of pixels is the sum over all renderers under test, None if nothing can be compared.
    """
    before, after = cases
    if before is not None and (stored := _identical(folders, (before, after))) is not None:
        write_text(out / relative, renamed(stored, relative))
        return 0, True
    later, _ = kept_images(folders[1], after)
    earlier = kept_images(folders[0], before)[0] if before is not None else {}
    shared = [(new, old) for new, old in pairs.items() if new in later and old in earlier]
    counts = [differing(earlier[old], later[new]) for new, old in shared]
    renders: Renders = {name: later[name] for name in later if name in pairs or name in _wanted(after, later)}
    if any(counts):
        renders |= {called(label, old): earlier[old] for _, old in shared}
    if renders:
        scene = scene_of(folders[1], after)
        write_pixels(out / relative, relative, renders, scene)
    return (sum(counts) if shared else None), bool(renders)


def _identical(folders: tuple[Path, Path], cases: tuple[Case, Case]) -> str | None:
    """Return the script of a case's images if both runs have the same one, without decoding it; None otherwise."""
    kept = [(folder, case.get("pixels")) for folder, case in zip(folders, cases, strict=True)]
    if not all(isinstance(path, str) and inside(folder, path) for folder, path in kept):
        return None
    before, after = ((folder / str(path)).read_text(encoding="utf-8") for folder, path in kept)
    return after if before == after else None


def called(label: str, renderer: str) -> str:
    """Return the name of a renderer of the run `label` among the renderers of another run."""
    return f"{label}: {renderer}"


def _wanted(case: CaseRecord, renders: Renders) -> set[str]:
    """Return the renderers whose images are shown: subjects, the oracle, and references of checks with the verdict."""
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


# The report of changes: a results folder of the later run, with the images of both runs.


Results = RunRecord
Job = tuple[tuple[Path, Path], tuple[CaseRecord | None, CaseRecord], dict[str, str], str, Path, str]


def write_folder(
    out: Path, folders: tuple[Path, Path], runs: tuple[Results, Results], record: ComparisonRecord
) -> Results:
    """Write the later run's results and both runs' images to `out`, complete `record`, and return the written results.

    `record` is the `reports.history.run_difference.comparison` of `runs`; the numbers of differing pixels and its
    sentence are added to it.
    """
    before, after = runs
    label = record["base"]["name"]
    earlier = {case["name"]: case for case in before["cases"]}
    references = [list(run.get("references") or {}) for run in runs]
    # Remove the scripts of an earlier report, which may have had more cases; other files stay.
    for stale in (out / "images").glob("[0-9][0-9][0-9][0-9]*.js"):
        stale.unlink()
    jobs: list[Job] = []
    for number, case in enumerate(after["cases"], start=1):
        old = earlier.get(case["name"])
        pairs = renderer_pairs(old, case, record["configurations"], references) if old is not None else {}
        jobs.append((folders, (old, case), pairs, label, out, f"images/{number:04}.js"))
    answers = all_of(write_both, jobs, heavy=len(jobs))
    rows = {row["case"]: row for row in record["rows"]}
    renderers: dict[str, str] = {}
    cases = []
    for job, (pixels, written) in zip(jobs, answers, strict=True):
        case, row = job[1][1], rows.get(job[1][1]["name"])
        renderers |= {new: called(label, old) for new, old in job[2].items()}
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
    # The history belongs only to the later run, whose own report shows it.
    results = copy(after)
    results.pop("history", None)
    results.update({"cases": cases, "comparison": {**record, "rows": shown}, "faults": record["faults"]})
    save_results(out, results)
    return results


def _case(folder: Path, out: Path, case: CaseRecord, pixels: str | None, row: ComparisonRowRecord | None) -> CaseRecord:
    """Copy a case's files, and return its record for the folder: images in one script, and the checks of both runs."""
    for path in (case.get("scene"), picture_of(folder, case)):
        if isinstance(path, str) and inside(folder, path):
            (out / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder / path, out / path)
    renders: list[RenderRecord] = [{**render, "image": None} for render in case.get("renders", [])]
    compared: ComparedRecord | None = None
    if row is not None:
        compared = {"before": row["before"], "pixels": row["pixels"], "checks": row["checks"]}
    return {**case, "renders": renders, "pixels": pixels, "compared": compared}
