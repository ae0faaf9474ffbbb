"""Limits of whole renderers as JSON, CSV and tables; two of them compared, or held as a gate."""

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import msgspec

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


class ScaleRecord(TypedDict):
    """A ladder of scenes, from easy to hard."""

    ladder: str
    quantity: str
    unit: str
    values: list[float]
    control: bool  # climbed whole always


class RungVerdict(TypedDict):
    """One rung that was rendered."""

    value: float
    verdict: str


class LimitRecord(TypedDict):
    """How far one renderer carries on one ladder."""

    renderer: str
    ladder: str
    limit: float | None  # the last value up to which every rendered rung passes; None where the first does not
    breaks_at: float | None  # the first value that does not pass; None where all do
    verdict: str  # of that one
    stage: str
    items: list[str]  # of the specification, that may be to blame
    reason: str
    monotone: bool
    rungs: list[RungVerdict]


class LimitsRecord(TypedDict):
    """What `rayproof limits` writes."""

    schema: int
    subject: str
    renderers: list[str]  # the subject first
    ladders: list[ScaleRecord]
    limits: list[LimitRecord]
    environment: dict[str, str]


class ChangeRecord(TypedDict):
    """One limit of the first renderer of two documents."""

    ladder: str
    quantity: str
    unit: str
    before: str
    after: str
    rungs: int  # by how many rungs it carries farther


class BarRecord(TypedDict):
    """A limit as the report draws it."""

    renderer: str
    ladder: str
    verdict: str
    reason: str
    text: str
    blame: str
    share: float  # of its ladder's logarithmic axis


class LimitsPlot(TypedDict):
    """What the report's page *Limits* shows; the subject is the first renderer."""

    renderers: list[str]
    ladders: list[ScaleRecord]
    bars: list[BarRecord]


class LimitsError(ValueError):
    """A file holds no limits that can be read."""


def place_of(path: Path) -> Path:
    """Return the file with a folder's limits; a file is it itself."""
    return path / FOLDER / NAME if path.is_dir() else path


def load_limits(path: Path) -> LimitsRecord:
    """Return the limits that a file, or the folder of `--out`, holds.

    Raises:
        LimitsError: it holds none.
        OSError: it cannot be read.

    """
    place = place_of(path)
    try:
        return msgspec.json.decode(place.read_bytes(), type=LimitsRecord)
    except msgspec.MsgspecError as error:
        raise LimitsError(f"{place}: these are no limits of a renderer: {error}") from error


def write_limits(folder: Path, found: LimitsRecord) -> None:
    """Write limits as JSON and CSV into the folder of the ladders."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / NAME, as_json(found, indent=2) + "\n")
    write_text(folder / "limits.csv", as_csv(found))


def as_csv(found: LimitsRecord) -> str:
    """Return one line a renderer and ladder."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("limit", "breaks_at", "verdict", "stage")
    writer.writerow(("renderer", "ladder", "quantity", "unit", "end", *names, "items", "monotone", "renders", "reason"))
    scales = {scale["ladder"]: scale for scale in found["ladders"]}
    for one in found["limits"]:
        scale = scales[one["ladder"]]
        about = one["renderer"], one["ladder"], scale["quantity"], scale["unit"], f"{scale['values'][-1]:g}"
        cells = ["" if one[name] is None else one[name] for name in names]
        more = " ".join(one["items"]), "yes" if one["monotone"] else "no", len(one["rungs"]), one["reason"]
        writer.writerow((*about, *cells, *more))
    return text.getvalue()


def in_words(limit: LimitRecord | None) -> str:
    """Return "right up to" as a table has it: `all` at the ladder's end, `*` where later rungs pass again."""
    if limit is None:
        return "-"
    if limit["limit"] is None:
        return (
            "never right" if limit["verdict"] == Outcome.FAIL.value else WORDS.get(limit["verdict"], limit["verdict"])
        )
    end = "" if limit["breaks_at"] is not None else "all, "
    return f"{end}{limit['limit']:g}{'' if limit['monotone'] else ' *'}"


def blame(limit: LimitRecord) -> str:
    """Return what is to blame beyond a limit: items, or why nothing can be said."""
    if limit["breaks_at"] is None:
        return ""
    if limit["items"]:
        few = limit["items"][:3]
        return f"{limit['stage']}: {', '.join(few)}{', ...' if len(few) < len(limit['items']) else ''}"
    return f"{limit['stage']} {WORDS.get(limit['verdict'], limit['verdict'])}".strip()


def table(record: LimitsRecord) -> tuple[list[str], list[list[str]]]:
    """Return the columns and rows of "right up to": the subject with what is blamed, then the others."""
    limits = {(one["renderer"], one["ladder"]): one for one in record["limits"]}
    first, *others = record["renderers"]
    columns = ["ladder", "what grows", "unit", f"{first}: right up to", "blamed beyond", *others]
    rows = []
    for scale in record["ladders"]:
        own = limits[first, scale["ladder"]]
        beside = [in_words(limits.get((name, scale["ladder"]))) for name in others]
        about = [scale["ladder"], scale["quantity"], scale["unit"]]
        rows.append([*about, in_words(own), blame(own), *beside])
    return columns, rows


def changes(before: LimitsRecord, after: LimitsRecord) -> list[ChangeRecord]:
    """Return each limit of the two subjects on the ladders of `before`; a ladder that `after` lacks counts as lost."""
    scales = {scale["ladder"]: scale for scale in after["ladders"]}
    own = {limit["ladder"]: limit for limit in after["limits"] if limit["renderer"] == after["renderers"][0]}
    found: list[ChangeRecord] = []
    for limit in before["limits"]:
        if limit["renderer"] != before["renderers"][0]:
            continue
        scale = next(scale for scale in before["ladders"] if scale["ladder"] == limit["ladder"])
        if limit["ladder"] in scales and scales[limit["ladder"]]["values"] != scale["values"]:
            raise LimitsError(
                f"the two have other rungs of the ladder {limit['ladder']}; measure the earlier one again"
            )
        now = own.get(limit["ladder"])
        rungs = _height(now, scale) - _height(limit, scale)
        found.append(
            {
                "ladder": limit["ladder"],
                "quantity": scale["quantity"],
                "unit": scale["unit"],
                "before": in_words(limit),
                "after": in_words(now),
                "rungs": rungs,
            }
        )
    return found


def _height(one: LimitRecord | None, scale: ScaleRecord) -> int:
    """Return how many rungs a renderer climbs."""
    return 0 if one is None or one["limit"] is None else scale["values"].index(one["limit"]) + 1


def worse(found: Sequence[ChangeRecord]) -> list[str]:
    """Return in sentences which limits are lower than they were."""
    return [
        f"{one['ladder']}, right up to [{one['unit']}]: {one['before']} before, {one['after']} now".replace(" []", "")
        for one in found
        if one["rungs"] < 0
    ]


def share(one: LimitRecord, scale: ScaleRecord) -> float:
    """Return how far along its ladder's logarithmic axis a limit lies, from 0 to 1."""
    first, last = scale["values"][0], scale["values"][-1]
    if one["limit"] is None:
        return 0.0
    return math.log(one["limit"] / first) / math.log(last / first)


def bars(limits: LimitsRecord) -> LimitsPlot:
    """Return what the report's page draws: each ladder with a bar a renderer."""
    scales = {scale["ladder"]: scale for scale in limits["ladders"]}
    drawn: list[BarRecord] = [
        {
            "renderer": limit["renderer"],
            "ladder": limit["ladder"],
            "verdict": limit["verdict"],
            "reason": limit["reason"],
            "text": in_words(limit),
            "blame": blame(limit),
            "share": share(limit, scales[limit["ladder"]]),
        }
        for limit in limits["limits"]
    ]
    return {"renderers": limits["renderers"], "ladders": limits["ladders"], "bars": drawn}
