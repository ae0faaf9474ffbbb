"""The elements of a Mitsuba XML file as a tree of plain values, read by Mitsuba's parser in a process of its own."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.mesh_sandbox import BYTES_A_BYTE, FREE_BYTES, Budget, ForeignError, ask
from rayproof.cases.scene import SceneError, shown
from rayproof.reports.interchange.mitsuba_xml.parsing import Plain, Stored, StoredFile
from rayproof.reports.interchange.mitsuba_xml.scanning import scan

# What Mitsuba's parser may take beside its own code.
SECONDS, BYTES_A_SECOND = 6.0, 2**20
MEMORY, MEMORY_A_BYTE = 384 * 2**20, 64  # bytes


@dataclass(frozen=True, kw_only=True)
class Transform:
    """A property that is a matrix, float64 (4, 4)."""

    matrix: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """A property that is a spectrum, by its samples."""

    values: tuple[float, ...]
    uniform: bool


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A property that is another element, by its place among all of them."""

    element: int


Property = Plain | Transform | Spectrum | Reference


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element: its kind ("Shape", "BSDF", "Emitter", ...), its plug-in's name and its properties."""

    kind: str
    plugin: str
    id: str
    place: str  # file, line and column, with its id where it has one
    properties: dict[str, Property]
    budget: Budget  # the scene's: an element may be met again and again
    folders: tuple[Path, ...]  # where the files lie that it may name
    _all: list["Element"]
    _read: set[str] = field(default_factory=set)  # names of properties that somebody asked for

    def get(self, name: str, default: Any) -> Any:
        """Return a property, or `default` where the file does not say."""
        self._read.add(name)
        return self.properties.get(name, default)

    def has(self, name: str) -> bool:
        """Return whether the file says something of a property."""
        self._read.add(name)
        return name in self.properties

    def unread(self) -> list[str]:
        """Return the names of plain properties that nobody asked for, if anybody asked for anything of this element."""
        plain = [name for name, value in self.properties.items() if not isinstance(value, Reference)]
        return [name for name in plain if name not in self._read] if self._read else []

    def children(self, kind: str | None = None) -> Iterator[tuple[str, "Element"]]:
        """Yield the names and elements below this one, in the file's order."""
        for name, value in self.properties.items():
            if isinstance(value, Reference):
                self.budget.spend("references", 1, by=self.place)
                child = self._all[value.element]
                if kind is None or child.kind == kind:
                    yield name, child

    def everything(self) -> list["Element"]:
        """Return all elements of the file."""
        return self._all

    def matrix(self) -> np.ndarray:
        """Return `to_world`, float64 (4, 4); the identity where the file does not say."""
        value = self.get("to_world", None)
        if value is None:
            return np.eye(4)
        if not isinstance(value, Transform):
            raise SceneError(f"{self.place}: to_world must be a transform, got {shown(value)}")
        return value.matrix


def read_tree(path: Path, allowed: tuple[Path, ...] = ()) -> Element:
    """Return the root element of a file: its parameters filled in, older names brought up to date, references resolved.

    Its `path` elements may name folders inside its own and inside those `allowed`.

    Raises:
        SceneError: it asks for too much, Mitsuba's parser refuses it, in its own words on one line, or it includes a
            file from elsewhere.

    """
    budget = Budget()
    searched = scan(path, budget, allowed)
    try:
        _, content = ask(
            "rayproof.reports.interchange.mitsuba_xml.parsing:xml_parser",
            "xml",
            str(path.resolve()).encode(),
            seconds=SECONDS + budget.read / BYTES_A_SECOND,
            memory=MEMORY + MEMORY_A_BYTE * budget.read,
            most=FREE_BYTES + BYTES_A_BYTE * budget.read,
        )
    except ForeignError as error:
        raise SceneError(str(error)) from None
    document: StoredFile = json.loads(content)
    inside = [folder.resolve() for folder in (path.parent, *allowed)]
    for included in map(Path, document["files"][1:]):
        if not any(included.resolve().is_relative_to(folder) for folder in inside):
            raise SceneError(f"{included}, which it includes, must lie inside the file's folder")
    elements: list[Element] = []
    for stored in document["elements"]:
        name = stored["id"]
        elements.append(
            Element(
                kind=stored["kind"],
                plugin=stored["plugin"],
                id=name,
                place=f"{stored['place']}{f', {name!r}' if name else ''}",
                properties={key: _property(value) for key, value in stored["properties"].items()},
                budget=budget,
                folders=(path.parent, *searched),
                _all=elements,
            )
        )
    return elements[0]


def _property(value: Stored) -> Property:
    if not isinstance(value, dict):
        return value
    if "element" in value:
        return Reference(element=value["element"])
    if "matrix" in value:
        return Transform(matrix=np.array(value["matrix"], dtype=np.float64))
    if "spectrum" in value:
        return Spectrum(values=tuple(value["spectrum"]), uniform=value["uniform"])
    return value["other"]
