"""What travels between a run and the machines of a cluster: a batch of whole cases out, records and files back.

Batches carry scenes and not the names of files, answers carry bytes and no paths: no disk is shared. What comes back is
trusted: a worker showed a certificate of the user's own authority.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.case import Terms
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.scenes import place_of

LEVEL = 6  # of zlib


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a worker's processes may take."""

    timeout: float  # s, for one render or one judgement
    memory: float = float("inf")  # bytes of a process
    jobs: int | None = None  # processes at once; None: as many as that machine has processors


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Whole cases for one worker."""

    name: str  # of the run's batches each has another one, also where it is sent again
    run: str  # which run: a worker keeps its processes for the batches of one
    terms: Terms
    limits: Limits
    cases: tuple[PlannedCase, ...]


@dataclass(frozen=True, kw_only=True)
class Finished:
    """One case: its record as deflated JSON, and its files by their paths in a results folder."""

    name: str
    record: bytes
    files: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a worker found of a batch."""

    finished: tuple[Finished, ...]
    seconds: float  # that it took


def packed(name: str, record: CaseRecord, folder: Path) -> Finished:
    """Return a case's record with the files that it has below `folder`."""
    files = {}
    for place in _folders(name):
        for path in sorted(path for path in (folder / place).rglob("*") if path.is_file()):
            files[path.relative_to(folder).as_posix()] = path.read_bytes()
    for file in _single(name):
        if (folder / file).is_file():
            files[file] = (folder / file).read_bytes()
    return Finished(name=name, record=zlib.compress(json.dumps(record).encode(), LEVEL), files=files)


def unpacked(answer: Answer) -> dict[str, tuple[CaseRecord, Mapping[str, bytes]]]:
    """Return the record and the files of each case of an answer, by the case's name."""
    return {case.name: (json.loads(zlib.decompress(case.record)), case.files) for case in answer.finished}


def _single(case: str) -> tuple[str, ...]:
    return f"scenes/{place_of(case)}.json", f"images/{place_of(case)}.js"


def _folders(case: str) -> tuple[str, ...]:
    return f"images/{place_of(case)}", f"calls/{place_of(case)}"


def write(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files below a results folder; raise OSError where that cannot be done."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
