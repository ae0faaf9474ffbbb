"""Limits of whole renderers as JSON, CSV and tables, and the comparison of two such records."""

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from rayproof.reports.results.files import as_json, write_text
from rayproof.reports.results.outcomes import Outcome

FOLDER, NAME = "stability", "limits.json"
WORDS = {
    Outcome.FAIL.value: "",
    Outcome.UNDECIDED.value: "undecided",
    Outcome.UNSUPPORTED.value: "unsupported",
    Outcome.MISSING.value: "missing",
    Outcome.ERROR.value: "error",
}


class ScaleRecord(Struct, frozen=True, kw_only=True):
    """A ladder of scenes, from easy to hard."""

    ladder: str
    quantity: str
    unit: str
    values: list[float]
    control: bool  # whether all values are always rendered


class RungVerdict(Struct, frozen=True, kw_only=True):
    """The verdict at one rendered value of a ladder."""

    value: float
    verdict: str


class LimitRecord(Struct, frozen=True, kw_only=True):
    """The limit of one renderer on one ladder."""

    renderer: str
    ladder: str
    limit: float | None  # the last passing value before the first failing one; None if the first value fails
    breaks_at: float | None  # the first value that does not pass; None if all pass
    verdict: str  # at `breaks_at`
    stage: str
    items: list[str]  # items of the specification that may be wrong
    reason: str
    monotone: bool
    rungs: list[RungVerdict]


class LimitsRecord(Struct, frozen=True, kw_only=True):
    """The limits of all renderers, as `rayproof limits` writes them."""

    schema: int
    subject: str
    renderers: list[str]  # the subject first
    ladders: list[ScaleRecord]
    limits: list[LimitRecord]
    environment: dict[str, str]


class ChangeRecord(Struct, frozen=True, kw_only=True):
    """The change of one limit of the subject between two records."""

    ladder: str
    quantity: str
    unit: str
    before: str
    after: str
    rungs: int  # increase of the limit in steps of the ladder


class LimitsError(ValueError):
    """The file contains no valid record of limits."""


def place_of(path: Path) -> Path:
    """Return the path of the file with the limits: inside `path` if it is a folder, else `path` itself."""
    return path / FOLDER / NAME if path.is_dir() else path


def load_limits(path: Path) -> LimitsRecord:
    """Return the limits in a file or in a folder that was written by `--out`.

    Raises:
        LimitsError: the file contains no valid limits.
        OSError: the file cannot be read.

    """
    place = place_of(path)
    try:
        return msgspec.json.decode(place.read_bytes(), type=LimitsRecord)
    except msgspec.MsgspecError as error:
        raise LimitsError(f"{place}: these are no limits of a renderer: {error}") from error


def write_limits(folder: Path, limits: LimitsRecord) -> None:
    """Write limits as JSON and CSV into the folder of the ladders."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / NAME, as_json(limits, indent=2) + "\n")
    write_text(folder / "limits.csv", as_csv(limits))


def as_csv(limits: LimitsRecord) -> str:
    """Return limits as CSV, one line per renderer and ladder."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("limit", "breaks_at", "verdict", "stage")
    writer.writerow(("renderer", "ladder", "quantity", "unit", "end", *names, "items", "monotone", "renders", "reason"))
    scales = {scale.ladder: scale for scale in limits.ladders}
    for limit in limits.limits:
        scale = scales[limit.ladder]
        about = limit.renderer, limit.ladder, scale.quantity, scale.unit, f"{scale.values[-1]:g}"
        cells = ["" if (value := getattr(limit, name)) is None else value for name in names]
        more = " ".join(limit.items), "yes" if limit.monotone else "no", len(limit.rungs), limit.reason
        writer.writerow((*about, *cells, *more))
    return text.getvalue()


def in_words(limit: LimitRecord | None) -> str:
    """Return a limit as the text of a cell, with `all` at the ladder's end and `*` if later values pass again."""
    if limit is None:
        return "-"
    if limit.limit is None:
        return "never right" if limit.verdict == Outcome.FAIL.value else WORDS.get(limit.verdict, limit.verdict)
    end = "" if limit.breaks_at is not None else "all, "
    return f"{end}{limit.limit:g}{'' if limit.monotone else ' *'}"


def blame(limit: LimitRecord) -> str:
    """Return the stage and the items of the specification that may be wrong beyond a limit, or the verdict there."""
    if limit.breaks_at is None:
        return ""
    if limit.items:
        few = limit.items[:3]
        return f"{limit.stage}: {', '.join(few)}{', ...' if len(few) < len(limit.items) else ''}"
    return f"{limit.stage} {WORDS.get(limit.verdict, limit.verdict)}".strip()


def table(record: LimitsRecord) -> tuple[list[str], list[list[str]]]:
    """Return the columns and rows of the table of limits: the subject with the blamed items, then the others."""
    limits = {(limit.renderer, limit.ladder): limit for limit in record.limits}
    first, *others = record.renderers
    columns = ["ladder", "what grows", "unit", f"{first}: right up to", "blamed beyond", *others]
    rows = []
    for scale in record.ladders:
        own = limits[first, scale.ladder]
        beside = [in_words(limits.get((name, scale.ladder))) for name in others]
        about = [scale.ladder, scale.quantity, scale.unit]
        rows.append([*about, in_words(own), blame(own), *beside])
    return columns, rows


def changes(before: LimitsRecord, after: LimitsRecord) -> list[ChangeRecord]:
    """Return the change of each limit of the subject on the ladders of `before`; a ladder missing in `after` is lost.

    Raises:
        LimitsError: the two records have different values of a ladder.

    """
    scales = {scale.ladder: scale for scale in after.ladders}
    own = {limit.ladder: limit for limit in after.limits if limit.renderer == after.renderers[0]}
    moves: list[ChangeRecord] = []
    for limit in before.limits:
        if limit.renderer != before.renderers[0]:
            continue
        scale = next(scale for scale in before.ladders if scale.ladder == limit.ladder)
        if limit.ladder in scales and scales[limit.ladder].values != scale.values:
            raise LimitsError(f"the two have other rungs of the ladder {limit.ladder}; measure the earlier one again")
        now = own.get(limit.ladder)
        rungs = _height(now, scale) - _height(limit, scale)
        moves.append(
            ChangeRecord(
                ladder=limit.ladder,
                quantity=scale.quantity,
                unit=scale.unit,
                before=in_words(limit),
                after=in_words(now),
                rungs=rungs,
            )
        )
    return moves


def _height(limit: LimitRecord | None, scale: ScaleRecord) -> int:
    """Return the number of values of a ladder up to a renderer's limit."""
    return 0 if limit is None or limit.limit is None else scale.values.index(limit.limit) + 1


def worse(records: Sequence[ChangeRecord]) -> list[str]:
    """Return a message for each limit that has become lower."""
    return [
        f"{record.ladder}, right up to [{record.unit}]: {record.before} before, {record.after} now".replace(" []", "")
        for record in records
        if record.rungs < 0
    ]


def share(limit: LimitRecord, scale: ScaleRecord) -> float:
    """Return the position of a limit on its ladder's logarithmic axis, from 0 to 1."""
    first, last = scale.values[0], scale.values[-1]
    if limit.limit is None:
        return 0.0
    return math.log(limit.limit / first) / math.log(last / first)


def bars(limits: LimitsRecord) -> dict[str, Any]:
    """Return the data of the report's page *Limits*: for each ladder one bar per renderer, the subject's first.

    The `share` of a bar is the position of the limit on its ladder's logarithmic axis, from 0 to 1.
    """
    scales = {scale.ladder: scale for scale in limits.ladders}
    drawn = [
        {
            "renderer": limit.renderer,
            "ladder": limit.ladder,
            "verdict": limit.verdict,
            "reason": limit.reason,
            "text": in_words(limit),
            "blame": blame(limit),
            "share": share(limit, scales[limit.ladder]),
        }
        for limit in limits.limits
    ]
    return {"renderers": limits.renderers, "ladders": msgspec.to_builtins(limits.ladders), "bars": drawn}
