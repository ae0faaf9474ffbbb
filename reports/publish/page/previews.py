"""Previews instead of images: a run stores the images of the worst cases that did not pass, up to a total size."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from rayproof.reports.publish.page.thumbnails import in_turns, picture
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import amend, amending, briefs, named
from rayproof.reports.results.files import replacing
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.images import inside
from rayproof.reports.results.records import RunRecord

MOST = 60_000_000  # bytes of images of cases that did not pass
# The page contains the same images again, in at most a seventh of the size of the EXR files.
WITH_THE_PAGE = 1 + 1 / 7
FOLDER = "previews"


def leave_previews(folder: Path, results: RunRecord, *, most: float = MOST) -> int:
    """Remove EXR files beyond `most` bytes, draw previews of their cases; return the number of these cases.

    Images are kept first for the worst case of each cause, then for the second worst of each, and so on.
    """
    shutil.rmtree(folder / FOLDER, ignore_errors=True)
    spent, left = 0.0, 0
    with amending(results["cases"]):
        for case in _with_files(folder, results):
            files = [str(render["image"]) for render in case["renders"] if render.get("image")]
            size = WITH_THE_PAGE * sum((folder / file).stat().st_size for file in files)
            if spent + size <= most:
                spent += size
                continue
            left += 1
            preview, drawing = Path(FOLDER, f"{left:04}.png"), picture(folder, case)
            if drawing is not None:
                (folder / FOLDER).mkdir(exist_ok=True)
                with replacing(folder / preview) as draft:
                    draft.write_bytes(drawing)
            renders = [{**render, "image": None} for render in case["renders"]]
            amend(results["cases"], case, renders=renders, preview=preview.as_posix() if drawing is not None else "")
            for file in files:
                (folder / file).unlink()
    return left


def _with_files(folder: Path, results: RunRecord) -> Iterator[CaseRecord]:
    """Yield the cases with EXR files: those that did not pass, the worst of each cause in turn, then the others."""
    names = dict.fromkeys(brief["name"] for _, brief in in_turns(results, most=None))
    names |= dict.fromkeys(brief["name"] for brief in briefs(worst_first(results["cases"])))
    for name in names:
        case = named(results["cases"], name)
        images = [] if case is None else [render.get("image") for render in case.get("renders", ())]
        if case is not None and any(images) and all(inside(folder, image) for image in images if image):
            yield case


def preview_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the preview of a case that lost its images, relative to `folder`, if it was drawn."""
    preview = case.get("preview")
    return preview if preview and inside(folder, preview) else None
