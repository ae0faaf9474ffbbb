"""Verdicts found before: the same answers to the same case before the same witnesses, by the same judge.

The renderer under test rendered again; only if its answers are equal to the last byte is what was said of them said
again. What failed to render or to be judged is never kept: it may have been the machine's fault.
"""

import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from rayproof.cases.case import Case
from rayproof.reports.cache.digests import Key, code, machine
from rayproof.reports.cache.entries import About, DamagedEntryError
from rayproof.reports.cache.store import Entry, Store
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.results.records import CaseRecord

# What asks references, judges, and writes a record with its files; the tracer's code is told by its answers.
CODE = (
    "rayproof.reports.run.tasks.reference_task",
    "rayproof.reports.run.tasks.judge_task",
    "rayproof.reports.run.case_run",
)
TOLD_BY_ANSWERS = ("rayproof.tracer",)
RECORD = "record"  # the array that holds it; files are named by their paths, which have a slash
PLACES = ("images", "scenes")  # where a record's files lie in a results folder
LEVEL = 1  # of zlib: a record is read back as often as it is written


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A case's record and the files that belong to it, by their paths in the results folder."""

    record: CaseRecord
    files: Mapping[str, bytes]

    def write(self, folder: Path) -> None:
        """Write the files below a results folder."""
        for name, data in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


@dataclass(frozen=True, kw_only=True)
class JudgementKey(Key):
    """A verdict: of whose answers, on which case, before which references, and what the run demanded."""

    case: Case
    candidates: tuple[Candidate, ...]
    versions: Mapping[str, str]  # the references', by name
    demands: Any  # `reports.run.demands.Demands`, which this folder does not import
    notes: tuple[str, ...]  # what the subject says of its answers


def judgement_key(
    case: Case, candidates: Sequence[Candidate], versions: Mapping[str, str], demands: Any, notes: Sequence[str]
) -> JudgementKey:
    """Return all that a verdict depends on, the code among it."""
    return JudgementKey(
        case=case,
        candidates=tuple(candidates),
        versions=versions,
        demands=demands,
        notes=tuple(notes),
        code=code(CODE, without=TOLD_BY_ANSWERS),
        machine=machine(),
    )


def recall(store: Store, key: str) -> Judgement | None:
    """Return what was found before, or None; an entry that is damaged is gone, and the case is judged again.

    So it is where an entry names a file elsewhere than a record's files lie: it is not one that was kept here.
    """
    try:
        return store.read(key, _judgement)
    except DamagedEntryError:
        return None


def _judgement(entry: Entry) -> Judgement:
    arrays = dict(entry[1])
    record = json.loads(zlib.decompress(arrays.pop(RECORD).tobytes()))
    if not all(map(_belongs, arrays)):
        raise DamagedEntryError("it names files elsewhere than a record's lie")
    files = {name: zlib.decompress(array.tobytes()) for name, array in arrays.items()}
    return Judgement(record=record, files=files)


def keep(store: Store, key: str, folder: Path, record: CaseRecord) -> None:
    """Keep a record with its files; a store that cannot be written keeps nothing, and nothing depends on it."""
    names = [record["scene"], record.get("pixels"), *(render.get("image") for render in record["renders"])]
    arrays = {RECORD: _packed(json.dumps(record).encode())}
    try:
        for name in filter(None, names):
            if not _belongs(name):
                return
            arrays[name] = _packed((folder / name).read_bytes())
        store.put(key, _about(record), arrays)
    except OSError:
        return


def _belongs(name: str) -> bool:
    """Say whether a path in a results folder is one of a record's files, and leads nowhere else."""
    parts = PurePosixPath(name).parts
    return len(parts) > 1 and parts[0] in PLACES and ".." not in parts


def _packed(data: bytes) -> np.ndarray:
    return np.frombuffer(zlib.compress(data, LEVEL), dtype=np.uint8)


def _about(record: CaseRecord) -> About:
    """Return what a listing tells of an entry."""
    return {
        "kind": "judgement",
        "reference": record["name"],
        "version": record["verdict"],
        "size": [record["width"], record["height"]],
        "shapes": len(record["shapes"]),
        "lights": record["lights"],
        "seconds": record["judge_seconds"],
    }
