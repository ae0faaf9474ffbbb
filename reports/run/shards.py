"""A plan in parts for several machines, and the parts' folders merged into one run.

A digest of a case's name determines its part, so that a case that is added or removed moves no other case.
"""

import hashlib
import re
import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import NAME, Cases, CaseTable, DamagedTableError
from rayproof.reports.results.document import ResultsError, load_results
from rayproof.reports.results.files import legible
from rayproof.reports.results.images import inside
from rayproof.reports.results.records import MOST_SHARDS, RunRecord, ShardRecord
from rayproof.reports.run import totals
from rayproof.reports.run.options import RunOptions, case_options
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.reference_cache import code, digest, exact
from rayproof.reports.run.scenes import FAMILY, place_of
from rayproof.reports.run.totals import come_to, uncountable

FILES = ("scenes", "images", "pictures")
ALIKE = ("code", "plan", "subject", "demands", "of")


def shard_of(text: str) -> tuple[int, int]:
    """Return the number of a part and the number of parts from a text such as 3/8.

    Raises:
        ValueError: it is no such text, or there is no such part.

    """
    match = re.fullmatch("([0-9]{1,9})/([0-9]{1,9})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]) <= MOST_SHARDS:
        raise ValueError(f"--shard is a part's number and of how many, such as 3/8 (at most {MOST_SHARDS}), got {text}")
    return int(match[1]), int(match[2])


def number_of(name: str, parts: int) -> int:
    """Return the number, from 1 to `parts`, of the part that contains the case of this name."""
    return int.from_bytes(hashlib.sha256(name.encode(errors="replace")).digest()[:8], "big") % parts + 1


def part(planned: Sequence[PlannedCase], shard: tuple[int, int]) -> tuple[PlannedCase, ...]:
    """Return the cases of one part, in the order of the plan."""
    return tuple(planned_case for planned_case in planned if number_of(planned_case.case.name, shard[1]) == shard[0])


def told(request: RunOptions, planned: Sequence[PlannedCase], references: tuple[str, ...]) -> ShardRecord:
    """Return a part's record, with the digests by which parts of the same plan recognise each other."""
    assert request.shard is not None
    options = case_options(request, references).of_records
    return {
        "number": request.shard[0],
        "of": request.shard[1],
        "planned": len(planned),
        "names": digest([planned_case.case.name for planned_case in part(planned, request.shard)]),
        "configurations": sorted({name for planned_case in planned for name in planned_case.configurations}),
        "code": code(tracer=True),
        "plan": digest([[exact(planned_case.case), planned_case.configurations] for planned_case in planned]),
        "subject": digest(options["subject"]),
        "demands": digest(exact(options)),
        "out": str(request.out),
        "require": list(request.require),
        "diagnose": request.diagnose,
        "keep_images": str(request.images),
    }


@dataclass(frozen=True, kw_only=True)
class Shard:
    """A part's results folder."""

    folder: Path
    document: RunRecord
    about: ShardRecord


def load_shards(folders: Sequence[Path]) -> list[Shard]:
    """Return the parts of a plan from these folders, in the order of their numbers.

    Raises:
        ResultsError: a folder has no results of a part, the parts are not from the same plan, or a part is there twice;
            a record cannot be read or counted, or was not planned for its part.

    """
    shards: list[Shard] = []
    for folder in folders:
        document = load_results(folder)
        about = document.get("shard")
        if about is None:
            raise ResultsError(f"{folder} holds no part of a run; `rayproof run --shard 1/2 --out DIR` makes one")
        if about["number"] > about["of"]:
            raise ResultsError(f"{folder} holds part {about['number']} of {about['of']}")
        if not (folder / NAME).is_file():
            raise ResultsError(f"{folder / NAME}: no such file")
        shards.append(Shard(folder=folder, document=document, about=about))
    first = shards[0]
    for following in shards[1:]:
        for key in ALIKE:
            if following.about[key] != first.about[key]:
                what = "number of parts" if key == "of" else key
                raise ResultsError(
                    f"{first.folder} and {following.folder} do not belong together: their {what} differs"
                )
    shards.sort(key=lambda shard: shard.about["number"])
    for previous, following in pairwise(shards):
        if previous.about["number"] == following.about["number"]:
            name = f"{previous.about['number']}/{previous.about['of']}"
            raise ResultsError(f"{previous.folder} and {following.folder} are both part {name}")
    for shard in shards:
        _vet(shard)
    return shards


def _vet(shard: Shard) -> None:
    """Read all records of a part before any file is changed; raise ResultsError as `load_shards` does."""
    table, names = shard.folder / NAME, list[str]()
    try:
        for place, _, record in CaseTable(table).entries():
            if wrong := _unplanned(record["name"], place, shard.about) or uncountable(record):
                raise DamagedTableError(f"{table}: {legible(record['name'])}: {wrong}")
            names.append(record["name"])
    except DamagedTableError as error:
        raise ResultsError(str(error)) from error
    if shard.document.get("finished") and digest(names) != shard.about["names"]:
        raise ResultsError(f"{shard.folder}: the cases in it are not those that were planned for the part")


def merge(shards: Sequence[Shard], out: Path, *, tracer: bool) -> tuple[RunRecord, totals.Totals]:
    """Fill `out` with the cases and files of the parts; return the run's document and its totals.

    The cases of absent parts are missing, and the run is not finished.

    Raises:
        OSError: a file cannot be read or written.

    """
    first = shards[0]
    (out / NAME).unlink(missing_ok=True)
    table = CaseTable(out / NAME)
    for shard in shards:
        with table.writing():
            for place, key, record in CaseTable(shard.folder / NAME).entries():
                table.keep(key, _moved(record, shard, out), place=place)
        _copy_files(shard.folder, out)
    cases: Cases = table.cases()
    run_totals = totals.of(cases)
    document: Any = {key: value for key, value in first.document.items() if key not in ("shard", "cases", "gate")}
    document.pop("diagnosis", None)
    document.pop("history", None)
    references = document.get("references") or {}
    document["references"] = {
        name: {**about, "version": run_totals.versions.get(name, "not asked")} for name, about in references.items()
    }
    others = {name: text for name, text in run_totals.versions.items() if name not in references}
    pictures = next((state for shard in shards if (state := _pictures(shard)) != "drawn"), "drawn")
    document["environment"] = {**document.get("environment", {}), **others, "pictures": pictures}
    document |= come_to(run_totals, planned=first.about["planned"], tracer=tracer)
    document["command"] = shlex.join(["rayproof", *sys.argv[1:]])
    document["started"] = min(str(shard.document.get("started")) for shard in shards)
    document["seconds"] = max(float(shard.document.get("seconds") or 0) for shard in shards)
    whole = len(shards) == first.about["of"] and all(shard.document.get("finished") for shard in shards)
    document["finished"] = whole
    document["shards"] = [
        {"number": shard.about["number"], "of": shard.about["of"], "cases": len(shard.document["cases"])}
        for shard in shards
    ]
    document["cases"] = cases
    return document, run_totals


def _unplanned(name: str, place: int, about: ShardRecord) -> str | None:
    """Return the reason why a case of this name and place was not planned for a part, or None."""
    number = number_of(name, about["of"])
    if number != about["number"]:
        return f"it belongs to part {number}/{about['of']}, and this is part {about['number']}"
    if not 0 <= place < about["planned"]:
        return f"its place is {place}, and {about['planned']} cases were planned"
    return "its name is no case's" if ".." in name.split("/") or name.startswith("/") else None


def _pictures(shard: Shard) -> str:
    return str(shard.document.get("environment", {}).get("pictures"))


def _moved(record: CaseRecord, shard: Shard, out: Path) -> CaseRecord:
    """Return a record whose command names the scene file where it is now."""
    if record["family"] == FAMILY and record.get("reproduce"):
        file = Path("scenes", f"{place_of(record['name'])}.json")
        old, new = (shlex.quote(str(folder / file)) for folder in (Path(str(shard.about["out"])), out))
        record["reproduce"] = str(record["reproduce"]).replace(old, new)
    return record


def _copy_files(folder: Path, out: Path) -> None:
    """Copy the files of a part's cases, except links and files outside its folder."""
    for name in FILES:
        for path in (folder / name).rglob("*"):
            place = path.relative_to(folder)
            if not path.is_symlink() and path.is_file() and inside(folder, str(place)):
                (out / place).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, out / place)
