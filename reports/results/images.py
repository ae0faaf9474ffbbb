"""The images that a results folder keeps of a case: EXR files, or one script where the case passed."""

from collections.abc import Collection
from pathlib import Path

from rayproof.reports.results.exr import read_answers
from rayproof.reports.results.image_script import Renders, read_pixels
from rayproof.reports.results.records import CaseRecord


def kept_images(
    folder: Path, case: CaseRecord, *, only: Collection[str | None] | None = None
) -> tuple[Renders, list[str]]:
    """Return a case's images by renderer, float32 (height, width, channels), a note for each unreadable.

    With `only`, no more than what those renderers answered is read.
    """
    renders: Renders = {}
    notes = []
    pixels = case.get("pixels")
    if isinstance(pixels, str):
        try:
            renders |= read_pixels(_within(folder, pixels), only=only)
        except (OSError, ValueError) as error:
            notes.append(str(error))
    for render in case.get("renders", []):
        name, image = str(render.get("renderer")), render.get("image")
        if not image or (only is not None and name not in only):
            continue
        try:
            renders[name] = read_answers(_within(folder, image))
        except (OSError, ValueError) as error:
            notes.append(f"{name}: {error}")
    return renders, notes


def keeps_images(case: CaseRecord) -> bool:
    """Return whether a run kept any image of a case, as its record says."""
    return isinstance(case.get("pixels"), str) or any(render.get("image") for render in case.get("renders", []))


def inside(folder: Path, relative: str) -> bool:
    """Return whether `relative` names a file below `folder`; results.json may come from anywhere."""
    try:
        path = (folder / relative).resolve()
        return path.is_relative_to(folder.resolve()) and path.is_file()
    except (OSError, ValueError):
        return False


def _within(folder: Path, relative: str) -> Path:
    if not inside(folder, relative):
        raise ValueError(f"{relative} is not in the results folder")
    return folder / relative


def images_of(record: CaseRecord) -> list[str]:
    """Return the paths of a case's images in its results folder."""
    named: list[str | None] = [record.get("pixels"), *(render.get("image") for render in record.get("renders", []))]
    return [path for path in named if isinstance(path, str) and path]
