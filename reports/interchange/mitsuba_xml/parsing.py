"""Mitsuba's XML parser, in double precision and in a process of its own (`cases.mesh_sandbox`); nothing is loaded."""

import json
from bisect import bisect_right
from pathlib import Path
from typing import Any, TypedDict, final

import numpy as np

from rayproof.cases.mesh_sandbox import Parser
from rayproof.reports.interchange.mitsuba_xml.scanning import DEEPEST_INCLUDE

NEWLINE = ord("\n")


@final
class StoredReference(TypedDict):
    """A property that is another element, by its place among all of them."""

    element: int


@final
class StoredSpectrum(TypedDict):
    """A property that is a spectrum, by its samples."""

    spectrum: list[float]
    uniform: bool


@final
class StoredMatrix(TypedDict):
    """A property that is a transform: four rows of four."""

    matrix: list[list[float]]


@final
class StoredOther(TypedDict):
    """A property of any other kind, in words."""

    other: str


Plain = bool | int | float | str | list[float] | list[list[float]]
Stored = Plain | StoredReference | StoredSpectrum | StoredMatrix | StoredOther


class StoredElement(TypedDict):
    """One element as JSON holds it."""

    kind: str
    plugin: str
    id: str
    place: str  # file, line and column
    properties: dict[str, Stored]


class StoredFile(TypedDict):
    """What the parser's process hands over of a file."""

    files: list[str]  # that were read, the first one first
    elements: list[StoredElement]  # the root first


def xml_parser() -> Parser:
    """Return Mitsuba's parser."""
    return answer


def answer(kind: str, content: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the files read and, as JSON, the elements of the file whose path `content` is.

    Its parameters are filled in, older names brought up to date, references resolved.

    Raises:
        ValueError: Mitsuba's parser refuses the file, in its own words.

    """
    import mitsuba as mi  # here, so that who looks up a reader of another kind of file does not wait for it

    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    path = content.decode()
    config = mi.parser.ParserConfig("scalar_rgb")
    config.max_include_depth = DEEPEST_INCLUDE
    config.parallel = False
    try:
        state = mi.parser.parse_file(config, path)
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve_references(config, state)
    except RuntimeError as error:
        raise ValueError(str(error)) from None
    files = [_Lines(Path(str(name)), Path(path).parent) for name in state.files]
    elements = [_element(node, files[node.file_index].place(node.offset)) for node in state.nodes]
    found: StoredFile = {"files": [str(name) for name in state.files], "elements": elements}
    return {}, json.dumps(found).encode()


class _Lines:
    """Where the lines of a file begin: Mitsuba's own word for a place counts them anew for every element."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._name = str(path).removeprefix(f"{folder}/")
        content = path.read_bytes()
        self._starts = [0, *(place + 1 for place, byte in enumerate(content) if byte == NEWLINE)]

    def place(self, offset: int) -> str:
        line = bisect_right(self._starts, offset)
        return f"{self._name} (line {line}, col {offset - self._starts[line - 1] + 1})"


def _element(node: Any, place: str) -> StoredElement:
    properties = node.props
    return {
        "kind": str(node.type).rpartition(".")[2],
        "plugin": properties.plugin_name(),
        "id": properties.id(),
        "place": place,
        "properties": {name: _value(properties[name]) for name in properties.keys()},  # noqa: SIM118 - iterates over nothing
    }


def _value(value: Any) -> Stored:
    """Return a property as JSON holds it; what is no number, text or list of numbers is an object with its kind."""
    kind = type(value).__name__
    if kind == "ResolvedReference":
        return {"element": value.index()}
    if kind == "Spectrum":
        return {"spectrum": [float(level) for level in value.values], "uniform": bool(value.is_uniform())}
    if "Transform" in kind:  # Dr.Jit's arrays have a member called matrix, too
        return {"matrix": np.array(value.matrix, dtype=np.float64).tolist()}
    if isinstance(value, bool | int | float | str):
        return value
    try:
        return np.array(value, dtype=np.float64).tolist()
    except (TypeError, ValueError, RuntimeError):
        return {"other": f"{kind} {value}"[:80]}
