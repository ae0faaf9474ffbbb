"""Small pictures of the worst cases of each cause: the subject's image, the reference's, and their difference."""

from collections.abc import Iterator
from io import BytesIO
from itertools import zip_longest
from pathlib import Path

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.case_records import CaseRecord, Check, ratio_of
from rayproof.reports.results.case_table import amend, briefs, named
from rayproof.reports.results.files import at_worst, replacing
from rayproof.reports.results.headline import BAD, blame, cause_of, worst_first
from rayproof.reports.results.images import kept_images
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord

MOST = 12
TRIED = 4 * MOST  # cases tried per cause, since not all have stored images
WIDTH = 160  # px of one of the three panels, at most
GAP = 4  # px between panels
BROKEN = (1.0, 0.0, 1.0)  # NaN and infinities


def draw_thumbnails(folder: Path, results: RunRecord) -> list[Path]:
    """Draw the worst cases with images that did not pass, set their `thumbnail`; return the written paths."""
    drawn: list[Path] = []
    for index, brief in in_turns(results, most=TRIED):
        if len(drawn) == MOST:
            break
        case = named(results["cases"], brief["name"])
        drawing = None if case is None else picture(folder, case)
        if case is not None and drawing is not None:
            path = Path("thumbnails", f"{index + 1:02}.png")  # named by rank, because case names are hostile input
            with replacing(folder / path) as draft:
                draft.write_bytes(drawing)
            amend(results["cases"], case, thumbnail=path.as_posix())
            drawn.append(folder / path)
    # Remove pictures of an earlier publication with other worst cases.
    for stale in set((folder / "thumbnails").glob("[0-9][0-9]*.png")) - set(drawn):
        stale.unlink()
    return drawn


def in_turns(results: RunRecord, *, most: int | None) -> Iterator[tuple[int, CaseRecord]]:
    """Yield the cases that did not pass with their ranks: the worst of each cause, then the second worst of each.

    There are at most `most` cases per cause.
    """
    groups: dict[str, list[tuple[int, CaseRecord]]] = {}
    for index, case in enumerate(briefs(worst_first(results["cases"]))):
        if Outcome(case["verdict"]) not in BAD:
            break  # later cases are better
        group = groups.setdefault(cause_of(results, case) or blame(case), [])
        if most is None or len(group) < most:
            group.append((index, case))
    for turn in zip_longest(*groups.values()):
        yield from filter(None, turn)


def _panels(folder: Path, case: CaseRecord) -> list[np.ndarray] | None:
    """Return three images, (height, width, 3) in [0, 1], or None if the case has no stored pair of images."""
    order = [outcome.value for outcome in Outcome]
    checks = [check for check in case.get("checks", []) if check.stage in IMAGE_STAGES]

    def rank(check: Check) -> tuple[bool, int, float]:
        ratio = ratio_of(check)
        worst = 0.0 if ratio is None else at_worst(ratio)
        return check.stage != case.get("stage"), -order.index(check.outcome), -worst

    checks.sort(key=rank)
    renders, _ = kept_images(folder, case) if checks else ({}, [])
    for check in checks:
        own = check.configuration
        subject, reference = renders.get(f"tracer-{own}", renders.get(own, {})), renders.get(check.reference, {})
        stage = Stage(check.stage)
        if stage in subject and stage in reference and subject[stage].shape == reference[stage].shape:
            return _shown(np.asarray(subject[stage], np.float64), np.asarray(reference[stage], np.float64))
    return None


def _shown(subject: np.ndarray, reference: np.ndarray) -> list[np.ndarray]:
    """Return both images on the same scale, and their absolute difference on a separate scale."""
    finite = np.concatenate([image[np.isfinite(image)] for image in (subject, reference)])
    low, high = (float(np.quantile(finite, q)) for q in (0.0, 0.99)) if len(finite) else (0.0, 1.0)
    with np.errstate(invalid="ignore"):
        difference = np.abs(subject - reference)
    # The difference of equal infinities, or of two NaNs, is zero.
    difference[(subject == reference) | (np.isnan(subject) & np.isnan(reference))] = 0.0
    finite_difference = difference[np.isfinite(difference)]
    most = float(finite_difference.max(initial=0.0))
    return [_scaled(subject, low, high), _scaled(reference, low, high), _scaled(difference, 0.0, most)]


def _scaled(image: np.ndarray, low: float, high: float) -> np.ndarray:
    # Both ends are halved first, because the difference of two large floats may overflow.
    span = (high / 2 - low / 2) or 0.5
    three = image[..., :3] if image.shape[-1] >= 3 else np.repeat(image[..., :1], 3, axis=-1)
    broken = ~np.isfinite(three).all(axis=-1)
    with np.errstate(invalid="ignore", over="ignore"):
        shown = np.clip(np.nan_to_num((three / 2 - low / 2) / span), 0, 1)
    shown[broken] = BROKEN
    return shown


def picture(folder: Path, case: CaseRecord) -> bytes | None:
    """Return the images of subject and reference and their difference, at a case's worst check, as PNG, or None."""
    from matplotlib.image import imsave

    panels = _panels(folder, case)
    if panels is None:
        return None
    step = max(1, -(-panels[0].shape[1] // WIDTH))
    small = [panel[::step, ::step] for panel in panels]
    opaque = [np.concatenate([panel, np.ones((*panel.shape[:2], 1))], axis=2) for panel in small]
    gap = np.zeros((small[0].shape[0], GAP, 4))  # transparent: a page has its own colour, light or dark
    file = BytesIO()
    imsave(file, np.concatenate([opaque[0], gap, opaque[1], gap, opaque[2]], axis=1), format="png")
    return file.getvalue()
