"""The records of a large image's bands as one: counts added up, the worst pixel of all, verdicts of the sums.

What a check says of pixels is the same as of the whole image. Two things are not pooled: factors that pixels share are
tested band by band, and told by the band that is the farthest off; informative metrics are left out.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import cast

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.examined import most_interval
from rayproof.reports.judge.panel.code_families import voice
from rayproof.reports.judge.panel.conventions import Tested, in_words
from rayproof.reports.judge.panel.matrix import Cell, Matrix
from rayproof.reports.judge.panel.outlier import standing
from rayproof.reports.results.float_codec import inflated, pack
from rayproof.reports.results.image_script import read_pixels, write_pixels
from rayproof.reports.results.json_numbers import at_worst
from rayproof.reports.results.outcomes import Outcome, worst
from rayproof.reports.results.records import (
    AdjudicationRecord,
    BiasRecord,
    CaseRecord,
    CheckRecord,
    ConventionRecord,
    FactorGroupRecord,
    MasksRecord,
    MeasurementRecord,
    NoteRecord,
    Number,
    RenderRecord,
)
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.record.common_factors import camera_and_lights
from rayproof.reports.run.record.images import step_of
from rayproof.reports.run.record.reproducing import write_scene
from rayproof.reports.run.scene_case import place_of
from rayproof.reports.subjects import Subject

COUNTS = (
    "interior", "over_inside", "edge", "differ_at_edge", "wrong_at_edge", "in_window", "differ_in_window", "hit_miss",
    "nan", "inf", "flagged",
)  # fmt: skip


def merged(planned: PlannedCase, records: Sequence[CaseRecord], *, folder: Path, subject: Subject) -> CaseRecord:
    """Return the record of a case whose bands, from the top, have these; their files in `folder` become one."""
    case = planned.case
    verdict = worst(Outcome(record["verdict"]) for record in records)
    told = _first_stage([record for record in records if record["verdict"] == verdict])
    checks = [_check(each, planned) for each in zip(*_aligned(records), strict=True)]
    names = list(dict.fromkeys(name for record in records for name in record["ran"]))
    camera = case.scene.camera
    step = step_of(camera)
    note = f"It was judged in {len(records)} bands of rows; its images show every {step}th pixel of every {step}th row."
    notes = [note for record in records for note in record["notes"]]
    return {
        **records[0],
        "name": case.name,
        "family": case.family,
        "verdict": told["verdict"],
        "stage": told["stage"],
        "item": told["item"],
        "reason": _reason(told["reason"], checks),
        "scene": write_scene(folder, case),
        "camera_and_lights": camera_and_lights(case.scene),
        "seconds": round(sum(record["seconds"] for record in records), 4),
        "judge_seconds": round(sum(record["judge_seconds"] for record in records), 4),
        "remembered": all(record["remembered"] for record in records),
        "versions": {name: text for record in records for name, text in record["versions"].items()},
        "renders": [_render(each) for each in zip(*(record["renders"] for record in records), strict=True)],
        "ran": {name: next(one["ran"][name] for one in records if name in one["ran"]) for name in names},
        "abstained": {name: why for record in reversed(records) for name, why in record["abstained"].items()},
        "stopped": list(dict.fromkeys(name for record in records for name in record.get("stopped", []))),
        "notes": [*_once(notes), {"reference": subject.name, "note": note}],
        "checks": checks,
        "adjudication": _adjudication(records),
        "masks": _masks([record["masks"] for record in records]),
        "pixels": _pixels(case.name, [record["pixels"] for record in records], folder),
    }


def _first_stage(records: Sequence[CaseRecord]) -> CaseRecord:
    """Return the record that blames the earliest stage, the uppermost of several."""
    order = [stage.value for stage in Stage]
    return min(records, key=lambda record: order.index(record["stage"]) if record["stage"] else len(order))


def _reason(reason: str | None, checks: Iterable[CheckRecord]) -> str | None:
    """Return a band's reason, with what the check that it names says of all bands."""
    for check in checks:
        about = f"{check['configuration']} against {check['reference']}, {check['stage']}: "
        if reason is not None and reason.startswith(about):
            return f"{about}{check['reason']}"
    return reason


def _once(entries: Iterable[NoteRecord]) -> list[NoteRecord]:
    found: list[NoteRecord] = []
    for entry in entries:
        if entry not in found:
            found.append(entry)
    return found


def _render(each: Sequence[RenderRecord]) -> RenderRecord:
    return {
        **each[0],
        "error": next((one["error"] for one in each if one["error"]), None),
        "cached": all(one["cached"] for one in each),
        "seconds": round(sum(one["seconds"] for one in each), 4),
    }


def _aligned(records: Sequence[CaseRecord]) -> list[list[CheckRecord]]:
    """Return each band's checks in the first one's order; of what a band lacks the check is missing."""

    def key(check: CheckRecord) -> tuple[str, str, str]:
        return check["configuration"], check["reference"], check["stage"]

    keys = list(dict.fromkeys(key(check) for record in records for check in record["checks"]))
    found = []
    for record in records:
        own = {key(check): check for check in record["checks"]}
        found.append([own.get(one) or _missing(*one) for one in keys])
    return found


def _missing(configuration: str, reference: str, stage: str) -> CheckRecord:
    return {
        "configuration": configuration,
        "reference": reference,
        "stage": stage,
        "verdict": Outcome.MISSING.value,
        "reason": "a band has none",
        "ratio": 0.0,
        "end_to_end": None,
        "continued": None,
        "examined": None,
        "because": "",
    }


def _check(each: Sequence[CheckRecord], planned: PlannedCase) -> CheckRecord:
    """Return the check of the whole image."""
    verdicts = [Outcome(check["verdict"]) for check in each]
    verdict = worst(verdicts)
    sources = [check for check in each if check["verdict"] == verdict]
    source = max(sources, key=lambda check: float(check["ratio"]))
    kept = ("configuration", "reference", "stage", "because", "evidence", "finding")
    found = cast("CheckRecord", {key: source[key] for key in kept if key in source})
    found["end_to_end"] = _measurement([check["end_to_end"] for check in each])
    found["continued"] = _measurement([check["continued"] for check in each])
    ledgers = [check["examined"] for check in each if check["examined"]]
    found["examined"] = {kind: sum(one[kind] for one in ledgers) for kind in ledgers[0]} if ledgers else None
    found["ratio"] = max((check["ratio"] for check in each), key=float)
    found["verdict"], found["reason"] = verdict.value, source["reason"]
    if set(verdicts) <= {Outcome.PASS, Outcome.UNDECIDED}:
        why = _undecided(each, found, planned.case.most_edge)
        found["verdict"] = (Outcome.PASS if why is None else Outcome.UNDECIDED).value
        found["reason"] = why or ""
    biases = [bias for check in each if (bias := check.get("bias"))]
    if biases:
        found["bias"] = _bias(biases)
    return found


def _undecided(each: Sequence[CheckRecord], found: CheckRecord, most_edge: float) -> str | None:
    """Return why the whole image's check says nothing, none of whose bands failed, or None."""
    reasons = [check["reason"] for check in each if check["verdict"] == Outcome.UNDECIDED]
    measured, ledger = found["end_to_end"], found["examined"]
    if not reasons or found["stage"] in (Stage.CAMERA, Stage.RAY):
        return reasons[0] if reasons else None
    if measured is None or ledger is None or any(check["end_to_end"] is None for check in each):
        return reasons[0]
    if not measured["interior"]:
        return reasons[0]
    pixels = ledger["pixels"]
    if measured["edge"] > most_edge * pixels:
        return f"{measured['edge'] / pixels:.4f} of the pixels are edge, and more than {most_edge} tell nothing"
    if ledger["interval"] > most_interval(pixels):
        return f"{ledger['interval']} of {pixels} pixels are held to an interval only, which says too little"
    return None


def _measurement(each: Sequence[MeasurementRecord | None]) -> MeasurementRecord | None:
    """Return the measurement of all bands: counts in total, the rest of the worst pixel, the first of equals."""
    there = [one for one in each if one is not None]
    if not there:
        return None
    most = max(there, key=lambda one: _size(one["worst_ratio"]))
    inside: list[Number | None] = [one["worst_inside"] for one in there]
    found: MeasurementRecord = {**most, "worst_inside": max(inside, key=_size)}
    for name in COUNTS:
        found[name] = sum(one[name] for one in there)
    return found


def _size(ratio: float | str | None) -> float:
    """Return a ratio as a number; one that is none is the worst."""
    return np.inf if ratio is None else at_worst(ratio)


def _bias(each: Sequence[BiasRecord]) -> BiasRecord:
    """Return each group's factors of the band in which they are farthest over their limits."""
    groups: dict[tuple[int, tuple[int, ...], int | None, bool], FactorGroupRecord] = {}
    for bias in each:
        for group in bias["groups"]:
            key = group["shape"], tuple(group["lights"]), group.get("fitted"), "wide" in group
            known = groups.get(key)
            pixels = group["pixels"] + (known["pixels"] if known else 0)
            groups[key] = {**(group if known is None or _over(group) > _over(known) else known), "pixels": pixels}
    offs = [
        value
        for group in groups.values()
        if group.get("fitted") is None and "wide" not in group
        for value in group["off"]
        if value is not None
    ]
    found: BiasRecord = {
        "ratio": max((bias["ratio"] for bias in each), key=_size),
        "sees": min((bias["sees"] for bias in each), key=float),
        "common": float(f"{np.median(list(map(float, offs))):.4g}") if offs else None,
        "allowance": max((bias["allowance"] for bias in each), key=float),
        "groups": list(groups.values()),
    }
    wide = [bias["wide"] for bias in each if "wide" in bias]
    if wide:
        pixels, above, below = (sum(one[key] for one in wide) for key in ("pixels", "above", "below"))
        found["wide"] = {"pixels": pixels, "above": above, "below": below}
    continued = [bias["continued"] for bias in each if bias.get("continued")]
    if continued:
        found["continued"] = max(continued, key=lambda one: _size(one["ratio"]))
    return found


def _over(group: FactorGroupRecord) -> float:
    """Return how far a group's worst channel is off over its limit."""
    pairs = zip(group["off"], group["sees"], strict=True)
    return max(
        (abs(float(off)) / float(sees) for off, sees in pairs if off is not None and sees and float(sees) > 0),
        default=0.0,
    )


def _adjudication(records: Sequence[CaseRecord]) -> dict[str, AdjudicationRecord]:
    """Return everybody against everybody over all bands, and who stands alone in the whole image."""
    configurations = {check["configuration"] for check in records[0]["checks"]}
    first: dict[str, str] = {}
    found: dict[str, AdjudicationRecord] = {}
    bands = [record["adjudication"] or {} for record in records]
    for stage in dict.fromkeys(stage for band in bands for stage in band):
        each = [band[stage] for band in bands if stage in band]
        matrix = _matrix(Stage(stage), each)
        one = standing(matrix, lambda name: voice(name, configurations))
        conventions = _conventions([band["conventions"] for band in each if "conventions" in band])
        words, who = "", (one.alone or ("",))[0]
        if who in first:
            words, conventions = f" It is off from {first[who]} on.", []
        elif who and stage != Stage.CAMERA:
            first[who] = stage
            words = in_words(conventions)
        found[stage] = {
            "baseline": each[0]["baseline"],
            **matrix.as_json(),
            "alone": ", ".join(one.alone) or None,
            "why": one.why + words,
        }
        if conventions:
            found[stage]["conventions"] = [result.as_json() for result in conventions]
    return found


def _matrix(stage: Stage, each: Sequence[AdjudicationRecord]) -> Matrix:
    names = tuple(dict.fromkeys(name for band in each for name in band["renderers"]))
    cells: dict[tuple[str, str], Cell] = {}
    for band in each:
        for row, ratios, counts in zip(band["renderers"], band["ratio"], band["differing"], strict=True):
            for column, ratio, differing in zip(band["renderers"], ratios, counts, strict=True):
                if ratio is None or differing is None:
                    continue
                known = cells.get((row, column), Cell(ratio=0.0, differing=0))
                # The camera is one, of which each band tells anew.
                total = max(known.differing, differing) if stage is Stage.CAMERA else known.differing + differing
                cells[row, column] = Cell(ratio=max(known.ratio, float(ratio), key=_size), differing=total)
    return Matrix(stage=stage, renderers=names, cells=cells)


def _conventions(each: Sequence[list[ConventionRecord]]) -> list[Tested]:
    """Return what the conventions came to in the bands that put them to the test."""
    found: dict[str, Tested] = {}
    for one in (result for results in each for result in results):
        before = found.get(one["what"], Tested(what=one["what"], ratio=0.0, differing=0, interior=0))
        found[one["what"]] = Tested(
            what=one["what"],
            # What was not measured in a band explains nothing there.
            ratio=max(before.ratio, np.inf if one["ratio"] is None else float(one["ratio"]), key=_size),
            differing=before.differing + (one["differing"] or 0),
            interior=before.interior + one["interior"],
        )
    return list(found.values())


def _masks(each: Sequence[MasksRecord | None]) -> MasksRecord | None:
    there = [mask for mask in each if mask is not None and mask["height"]]
    if not there:
        return None
    content = b"".join(inflated(mask["data"], mask["height"] * mask["width"]) for mask in there)
    return {**there[0], "height": sum(mask["height"] for mask in there), "data": pack(content)}


def _pixels(name: str, files: Sequence[str | None], folder: Path) -> str | None:
    """Write the bands' kept pixels as one file, and remove theirs; return its path in `folder`."""
    images: dict[str, dict[Stage, list[np.ndarray]]] = {}
    for file in filter(None, files):
        for renderer, stages in read_pixels(folder / file).items():
            for stage, image in stages.items():
                images.setdefault(renderer, {}).setdefault(stage, []).append(image)
        (folder / file).unlink()
    if not images:
        return None
    (folder / "images" / place_of(name)).rmdir()
    whole = {
        renderer: {stage: np.concatenate(parts) for stage, parts in stages.items()}
        for renderer, stages in images.items()
    }
    rows = {image.shape[0] for stages in whole.values() for image in stages.values()}
    # Who failed in some of the bands has no whole image to show.
    whole = {
        renderer: {stage: image for stage, image in stages.items() if image.shape[0] == max(rows)}
        for renderer, stages in whole.items()
    }
    path = Path("images", f"{place_of(name)}.js")
    write_pixels(folder / path, path.as_posix(), whole, None)
    return path.as_posix()
