"""Scenes without number, from a folder or from a file with one a line: read where they lie, and again when needed.

Of each only its name and its place stay in memory, so that a run of a hundred thousand takes little more than one of a
thousand. All are read once before anything starts, so that the first that is wrong is told then.
"""

import json
import os
import re
import zlib
from array import array
from collections.abc import Iterator, Sequence
from errno import EIO
from pathlib import Path
from typing import Any, overload

from rayproof.cases.case import Case
from rayproof.cases.scene import SceneError
from rayproof.cases.scene_json import LARGEST, scene_from_bytes
from rayproof.reports.results.json_numbers import legible
from rayproof.reports.run.scene_case import FAMILY, case_of_scene
from rayproof.reports.run.size import refuse_beyond_all
from rayproof.reports.subjects import THE_TRACER, Subject

LINES = ".jsonl"
A_FOLDER = 1000  # scenes without a name of their own that are named into one folder of the results
LONGEST_NAME = 200  # characters
_NAME = re.compile(r"(?!\.+(/|$))[\w+=,@ -][\w.+=,@ -]*(/(?!\.+(/|$))[\w+=,@ .-]+)*", re.ASCII)


class SceneStream(Sequence[Case]):
    """The cases of a folder's scene files, in the order of their names, or of a file's lines.

    A line is a scene as in a scene file, with a `name` beside it, or is named by its number. In a folder a scene is
    named by its path.

    Raises:
        SceneError: one is no scene, or two have one name; the file and the line are named.
        OSError: nothing can be read there.

    """

    def __init__(self, path: Path, subject: Subject = THE_TRACER) -> None:
        self._path = path
        self._files: list[str] = []  # in a folder, relative to it
        self._starts, self._lengths, self._sums = array("Q"), array("Q"), array("L")
        self._names: list[str] = []
        self.covers: dict[tuple[str, ...], int] = {}  # what scenes cover: the number of the first one that does
        taken: dict[str, int] = {}
        for number, data in enumerate(self._folder() if path.is_dir() else self._lines()):
            case = self._case(data, number)
            try:
                refuse_beyond_all(case, "")
            except SceneError as error:
                raise SceneError(f"{self._where(number)}{error}") from None
            if case.name in taken:
                first = self._where(taken[case.name])
                raise SceneError(f"{self._where(number)}: {case.name} is the name of {first} too")
            self.covers.setdefault(case.covers, number)
            taken[case.name] = number
            self._sums.append(zlib.crc32(data))
            self._names.append(case.name)
        if not self._names:
            raise SceneError(f"{path}: there are no scenes in it")

    def __len__(self) -> int:
        return len(self._names)

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Case]: ...
    def __getitem__(self, index: int | slice) -> Case | Sequence[Case]:
        if isinstance(index, slice):
            return [self[number] for number in range(len(self))[index]]
        number = range(len(self))[index]
        data = self._read(number)
        if zlib.crc32(data) != self._sums[number]:
            raise OSError(EIO, "it changed while it was read", self._where(number))
        return self._case(data, number)

    def _folder(self) -> Iterator[bytes]:
        self._files = sorted(path.relative_to(self._path).as_posix() for path in self._path.rglob("*.json"))
        for number in range(len(self._files)):
            yield self._read(number)

    def _lines(self) -> Iterator[bytes]:
        with self._path.open("rb") as file:
            while line := file.readline(LARGEST + 1):
                if not line.strip():
                    continue
                self._starts.append(file.tell() - len(line))
                self._lengths.append(len(line))
                if len(line) > LARGEST:
                    raise SceneError(f"{self._where(len(self._starts) - 1)}: has more than {LARGEST} bytes")
                yield line

    def _read(self, number: int) -> bytes:
        if self._files:
            path = self._path / self._files[number]
            if not path.is_file() or path.stat().st_size > LARGEST:
                raise SceneError(f"{legible(str(path))}: is no file of at most {LARGEST} bytes")
            return path.read_bytes()
        with self._path.open("rb") as file:
            file.seek(self._starts[number])
            return file.read(self._lengths[number])

    def _where(self, number: int) -> str:
        if self._files:
            return legible(os.path.join(self._path, self._files[number]))  # noqa: PTH118  as it is written
        with self._path.open("rb") as file:  # blank lines count, too
            before = sum(block.count(b"\n") for block in _blocks(file, self._starts[number]))
        return f"{legible(str(self._path))}, line {before + 1}"

    def _case(self, data: bytes, number: int) -> Case:
        name: Any = None

        def named(document: Any) -> Any:
            nonlocal name
            if not self._files and isinstance(document, dict) and "name" in document:
                name = document.pop("name")
            return document

        try:
            folder = (self._path / self._files[number]).parent if self._files else self._path.parent
            scene = scene_from_bytes(data, folder=folder, where="", prepared=named)
            if self._files:
                name = self._files[number].removesuffix(".json")
            elif name is None:
                name = f"{self._path.stem}/{number // A_FOLDER}/{number % A_FOLDER}"
            if not isinstance(name, str) or len(name) > LONGEST_NAME or _NAME.fullmatch(name) is None:
                raise SceneError(
                    f": name: must be words of letters, digits and ._+=,@- with / between, got {json.dumps(name)[:80]}"
                )
        except SceneError as error:
            raise SceneError(f"{self._where(number)}{_after(str(error))}") from None
        return case_of_scene(scene, name=f"{FAMILY}/{name}", stresses=f"The scene {name} of {self._path.name}.")


def _after(said: str) -> str:
    return said if said.startswith(":") else f": {said}"


def _blocks(file: Any, length: int) -> Iterator[bytes]:
    while length > 0 and (block := file.read(min(length, 2**20))):
        length -= len(block)
        yield block
