"""Earlier verdicts used again where scene, code, references and answers are bit-identical.

The renderer under test renders again. Only if its answers are equal to the last byte is its earlier record used again.
What failed to render or to be judged is never kept: the machine may have been at fault.
"""

import json
import subprocess
import uuid
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from rayproof.cases.case import Case
from rayproof.reports.judge.answers import Answers
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.compact import compact_case, expand_case
from rayproof.reports.results.files import as_json
from rayproof.reports.run.cache_store import About, DamagedEntryError, Entry, Store
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.reference_cache import Key, code, machine


class Memory:
    """The verdicts that were reached before, for one subject and one panel."""

    def __init__(self, store: Store, options: CaseOptions) -> None:
        self._store, self._options = store, options

    @cached_property
    def _versions(self) -> Mapping[str, str]:
        """Return the version of every reference that would be asked."""
        return {name: version(name) for name in self._options.references}

    def prepare(self) -> None:
        """Ask the references for their versions, once: while the first renders are on their way it costs nothing."""
        _ = self._versions

    def key(self, case: Case, subjects: Sequence[Answers], notes: Sequence[str]) -> str:
        """Return the question that a case is, given what the subject answered and said of it."""
        return judgement_key(case, subjects, self._versions, self._options, notes).digest

    def recall(self, key: str, folder: Path) -> CaseRecord | None:
        """Return the record found before, its files written into the results folder, or None."""
        found = recall(self._store, key)
        if found is None:
            return None
        found.write(folder)
        return found.record

    def keep(self, key: str, folder: Path, record: CaseRecord) -> None:
        """Keep a record with its files."""
        keep(self._store, key, folder, record)


def version(reference: str) -> str:
    """Return a reference's version; one that cannot tell it is never the same twice, and its worker says why."""
    from rayproof.reference import REFERENCES

    try:
        return REFERENCES[reference]().version()
    except (ImportError, OSError, RuntimeError, subprocess.SubprocessError):
        return f"not told, {uuid.uuid4()}"


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
    subjects: tuple[Answers, ...]
    versions: Mapping[str, str]  # the references', by name
    options: Mapping[str, Any]  # `CaseOptions.of_records`
    notes: tuple[str, ...]  # what the subject says of its answers


def judgement_key(
    case: Case, subjects: Sequence[Answers], versions: Mapping[str, str], options: CaseOptions, notes: Sequence[str]
) -> JudgementKey:
    """Return all that a verdict depends on, the code among it."""
    return JudgementKey(
        case=case,
        subjects=tuple(subjects),
        versions=versions,
        options=options.of_records,
        notes=tuple(notes),
        code=code(),
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
    record = expand_case(json.loads(zlib.decompress(arrays.pop(RECORD).tobytes())))
    if not all(map(_belongs, arrays)):
        raise DamagedEntryError("it names files elsewhere than a record's lie")
    files = {name: zlib.decompress(array.tobytes()) for name, array in arrays.items()}
    return Judgement(record=record, files=files)


def keep(store: Store, key: str, folder: Path, record: CaseRecord) -> None:
    """Keep a record with its files; a store that cannot be written keeps nothing, and nothing depends on it."""
    names = [record["scene"], record.get("pixels"), *(render.get("image") for render in record["renders"])]
    arrays = {RECORD: _packed(as_json(compact_case(record)).encode())}
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


@dataclass(frozen=True, kw_only=True)
class GuardKey(Key):
    """That a guard passed."""

    name: str


def ask_once(name: str, guard: Callable[[], object], store: Store) -> None:
    """Ask a guard that never passed this code, or not here; raise what it raises. Only that it passed is kept."""
    if passed(name, store):
        return
    guard()
    try:
        store.put(_key(name), {"kind": "guard", "reference": name}, {})
    except OSError:
        return  # it is asked again next time


def passed(name: str, store: Store) -> bool:
    """Say whether a guard passed this code here before."""
    try:
        return store.get(_key(name)) is not None
    except DamagedEntryError:
        return False  # it is gone, and the guard is asked


def _key(name: str) -> str:
    return GuardKey(name=name, code=code(), machine=machine()).digest
