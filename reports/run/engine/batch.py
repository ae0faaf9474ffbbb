"""What travels between a run and the machines of a cluster: a batch of whole cases out, records and files back.

Batches carry scenes and not the names of files, answers carry bytes and no paths: no disk is shared. What comes back is
checked as foreign data.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from rayproof.reports.results.images import images_of
from rayproof.reports.results.json_numbers import legible
from rayproof.reports.results.records import MOST_SECONDS, CaseRecord, problem_of_case
from rayproof.reports.run.cases_under_way import Terms
from rayproof.reports.run.plan import PlannedCase
from rayproof.reports.run.record.document import uncountable
from rayproof.reports.run.scene_case import place_of

PLACES = ("scenes", "images", "calls")  # where a case's files lie in a results folder
LARGEST_RECORD, LARGEST_FILES = 2**30, 2**32  # bytes of one case
LEVEL = 6  # of zlib


class BadAnswerError(ValueError):
    """A worker's answer is not what a worker sends; the message says what is wrong."""


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


def unpacked(answer: Any, batch: Batch) -> dict[str, tuple[CaseRecord, Mapping[str, bytes]]]:
    """Return the record and the files of each case of an answer to a batch, by the case's name.

    Raises:
        BadAnswerError: it is not the answer to this batch, or not one at all.

    """
    if not isinstance(answer, Answer):
        raise BadAnswerError(f"it answered with {type(answer).__name__}")
    if not _has_its_form(answer):
        raise BadAnswerError("its answer has values of other types than an answer")
    asked = sorted(one.case.name for one in batch.cases)
    if sorted(one.name for one in answer.finished) != asked:
        raise BadAnswerError(f"it was asked for {len(asked)} cases and answered others")
    return {one.name: (_record(one), _files(one)) for one in answer.finished}


def _has_its_form(answer: Answer) -> bool:
    """Say whether what was unpickled holds what its classes say: nobody has looked at that before."""
    finished: Any = answer.finished
    return (
        isinstance(answer.seconds, int | float)
        and 0 <= answer.seconds <= MOST_SECONDS
        and isinstance(finished, tuple)
        and all(
            isinstance(one, Finished)
            and isinstance(one.name, str)
            and isinstance(one.record, bytes)
            and isinstance(one.files, dict)
            and all(isinstance(name, str) and isinstance(data, bytes) for name, data in one.files.items())
            for one in finished
        )
    )


def _record(one: Finished) -> CaseRecord:
    inflater = zlib.decompressobj()
    try:
        text = inflater.decompress(one.record, LARGEST_RECORD)
        if not inflater.eof:
            raise BadAnswerError(f"the record of {one.name} is cut short or larger than {LARGEST_RECORD} bytes")
        record = json.loads(text)
        if wrong := problem_of_case(record) or uncountable(record):
            raise BadAnswerError(f"the record of {one.name}: {wrong}")
    except (zlib.error, ValueError, RecursionError) as error:
        raise (
            error
            if isinstance(error, BadAnswerError)
            else BadAnswerError(legible(f"the record of {one.name}: {error}"))
        ) from None
    if record["name"] != one.name:
        raise BadAnswerError(f"the record of {one.name} is that of another case")
    named = [record.get("scene"), *images_of(record)]
    if lacking := [name for name in named if name and name not in one.files]:
        raise BadAnswerError(legible(f"the record of {one.name} names {lacking[0]}, which did not come with it"))
    return record


def _files(one: Finished) -> Mapping[str, bytes]:
    size = 0
    for name, data in one.files.items():
        if not _belongs(name, one.name):
            raise BadAnswerError(legible(f"{name} is no file of {one.name}"))
        size += len(data)
    if size > LARGEST_FILES:
        raise BadAnswerError(f"the files of {one.name} have {size} bytes, more than {LARGEST_FILES}")
    return one.files


def _belongs(file: str, case: str) -> bool:
    """Say whether a path in a results folder is one of a case's own files, and leads nowhere else."""
    path = PurePosixPath(file)
    if path.as_posix() != file or ".." in path.parts or "\0" in file:
        return False
    return file in _single(case) or any(PurePosixPath(folder) in path.parents for folder in _folders(case))


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
