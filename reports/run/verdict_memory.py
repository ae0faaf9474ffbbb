"""Earlier verdicts, reused if scene, code, references and answers are bit-identical.

The renderer under test always renders. Its earlier record is only reused if its answers are bit-identical. A case with
a failed render or judgement is never stored: the machine may have been at fault.
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
    """The verdicts of earlier runs, for one subject and one panel."""

    def __init__(self, store: Store, options: CaseOptions) -> None:
        self._store, self._options = store, options

    @cached_property
    def _versions(self) -> Mapping[str, str]:
        """Return the version of every reference of the panel."""
        return {name: version(name) for name in self._options.references}

    def prepare(self) -> None:
        """Determine the references' versions, once: during the first renders this costs no time."""
        _ = self._versions

    def key(self, case: Case, subjects: Sequence[Answers], notes: Sequence[str]) -> str:
        """Return the key of the verdict on the subject's answers and notes."""
        return judgement_key(case, subjects, self._versions, self._options, notes).digest

    def recall(self, key: str, folder: Path) -> CaseRecord | None:
        """Return the stored record, and write its files into the results folder; None if there is none."""
        judgement = recall(self._store, key)
        if judgement is None:
            return None
        judgement.write(folder)
        return judgement.record

    def keep(self, key: str, folder: Path, record: CaseRecord) -> None:
        """Store a record with its files."""
        keep(self._store, key, folder, record)


def version(reference: str) -> str:
    """Return a reference's version, or a unique text if that fails; its worker then reports the reason."""
    from rayproof.reference import REFERENCES

    try:
        return REFERENCES[reference]().version()
    except (ImportError, OSError, RuntimeError, subprocess.SubprocessError):
        return f"not told, {uuid.uuid4()}"


RECORD = "record"  # the array with the record; the arrays of files are named by their paths, which have a slash
PLACES = ("images", "scenes")  # folders of a record's files in a results folder
LEVEL = 1  # of zlib: a record is read back as often as it is written


@dataclass(frozen=True, kw_only=True)
class StoredJudgement:
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
    """The key of a verdict: the case, the subject's answers, the references' versions and the run's options."""

    case: Case
    subjects: tuple[Answers, ...]
    versions: Mapping[str, str]  # the references', by name
    options: Mapping[str, Any]  # `CaseOptions.of_records`
    notes: tuple[str, ...]  # of the subject, on its answers


def judgement_key(
    case: Case, subjects: Sequence[Answers], versions: Mapping[str, str], options: CaseOptions, notes: Sequence[str]
) -> JudgementKey:
    """Return the key of everything that a verdict depends on, with the code and the machine."""
    return JudgementKey(
        case=case,
        subjects=tuple(subjects),
        versions=versions,
        options=options.of_records,
        notes=tuple(notes),
        code=code(),
        machine=machine(),
    )


def recall(store: Store, key: str) -> StoredJudgement | None:
    """Return the stored judgement, or None; a damaged entry is removed, and the case is judged again.

    An entry that names a file outside a record's folders counts as damaged, since it was not written here.
    """
    try:
        return store.read(key, _judgement)
    except DamagedEntryError:
        return None


def _judgement(entry: Entry) -> StoredJudgement:
    arrays = dict(entry[1])
    record = expand_case(json.loads(zlib.decompress(arrays.pop(RECORD).tobytes())))
    if not all(map(_belongs, arrays)):
        raise DamagedEntryError("it names files elsewhere than a record's lie")
    files = {name: zlib.decompress(array.tobytes()) for name, array in arrays.items()}
    return StoredJudgement(record=record, files=files)


def keep(store: Store, key: str, folder: Path, record: CaseRecord) -> None:
    """Store a record with its files; if the store cannot be written, nothing is stored and no error is raised."""
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
    """Return whether a path in a results folder is in a folder of a record's files and does not leave it."""
    parts = PurePosixPath(name).parts
    return len(parts) > 1 and parts[0] in PLACES and ".." not in parts


def _packed(data: bytes) -> np.ndarray:
    return np.frombuffer(zlib.compress(data, LEVEL), dtype=np.uint8)


def _about(record: CaseRecord) -> About:
    """Return the description of an entry, for listings."""
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
    """The key of a passed self-test."""

    name: str


def ask_once(name: str, guard: Callable[[], object], store: Store) -> None:
    """Run a self-test, unless it passed with this code on this machine before; only a pass is stored.

    An error of the self-test is raised.
    """
    if passed(name, store):
        return
    guard()
    try:
        store.put(_key(name), {"kind": "guard", "reference": name}, {})
    except OSError:
        return  # it runs again next time


def passed(name: str, store: Store) -> bool:
    """Return whether a self-test passed with this code on this machine before."""
    try:
        return store.get(_key(name)) is not None
    except DamagedEntryError:
        return False  # it has been removed, and the self-test runs


def _key(name: str) -> str:
    return GuardKey(name=name, code=code(), machine=machine()).digest
