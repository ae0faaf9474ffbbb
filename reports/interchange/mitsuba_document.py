"""Mitsuba XML read by Mitsuba's parser in a worker process, as a tree of plain elements; size checked before.

Before Mitsuba reads it, the file's elements, nesting, includes and expanded parameters are counted. Only `include`,
`path` and `default`, which determine the amount of input, are interpreted here; Mitsuba interprets the rest.
"""

import atexit
import contextlib
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from rayproof.cases.foreign_files import LET_IN, Budget, content_of, is_plain, located, path_within
from rayproof.cases.scene import SceneError, shown
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Channel, Reply, serve

LARGEST = 256 * 2**20  # bytes of a file
DEEPEST_INCLUDE = 8
VARIANT = "scalar_rgb"  # of Mitsuba, and the kind of worker that parses
LONGEST = 1000  # characters of its words
_PARAMETER = re.compile(r"\$(\w+)")
_SOURCE = re.compile(r"\[\w+\.cpp:\d+\] ")  # where in Mitsuba's code a message comes from
# Elements of Nori's scenes (W. Jakob, https://wjakob.github.io/nori), which have no version; Mitsuba's do.
NORI = ("camera", "mesh")


def scan(
    path: Path, budget: Budget, allowed: tuple[Path, ...] = (), parameters: Mapping[str, str] | None = None
) -> tuple[Path, ...]:
    """Spend the budget for reading a file and its includes; return the folders in which it searches for files.

    They are inside its own folder or inside those `allowed`. `parameters` are set before the file's own `default`.

    Raises:
        SceneError: it exceeds the budget, is no XML, is another renderer's file, or includes a file outside of these
            folders; the message does not contain the file's name.

    """
    reading = _Scan(path.parent, budget, allowed, parameters or {})
    reading.file(path.resolve(), path.name, 0)
    return tuple(reading.searched)


class _Scan:
    def __init__(self, folder: Path, budget: Budget, allowed: tuple[Path, ...], parameters: Mapping[str, str]) -> None:
        self._folder, self._budget, self._allowed = folder, budget, allowed
        self._values = dict(parameters)  # so far; the first value counts
        self._versioned = False
        self.searched: list[Path] = []  # folders of `path` elements

    def file(self, path: Path, name: str, level: int) -> None:
        """Scan one file; `level` includes lie around it."""
        if level > DEEPEST_INCLUDE:
            raise SceneError(f"{name} lies {level} includes deep; at most {DEEPEST_INCLUDE} are read")
        try:
            content = content_of(path, largest=LARGEST)
        except OSError as error:
            raise SceneError(f"{name} cannot be read: {error.strerror}") from None
        self._budget.count_file(path, len(content))
        self._budget.expand(len(content), by=name)
        parser = expat.ParserCreate()
        depth = 0

        def start(tag: str, attributes: dict[str, str]) -> None:
            nonlocal depth
            depth += 1
            place = f"{name}, line {parser.CurrentLineNumber}, <{shown(tag)[1:-1]}>"
            self._budget.spend("elements", 1, by=place)
            self._budget.go_down(depth, by=place)
            self._element(tag, attributes, place, path.parent, level)

        def end(_: str) -> None:
            nonlocal depth
            depth -= 1

        def entity(declared: str, *_: object) -> None:
            raise SceneError(f"{name} declares the entity {shown(declared)}, which Mitsuba does not read")

        parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = start, end, entity
        try:
            parser.Parse(content, True)
        except expat.ExpatError as error:
            raise SceneError(f"{name} is no XML: {error}") from None

    def _element(self, tag: str, attributes: dict[str, str], place: str, beside: Path, level: int) -> None:
        for value in attributes.values():
            if "$" in value:
                self._budget.expand(self._length(value), by=f"{place} with its parameters filled in")
        if tag == "default" and "name" in attributes:
            self._values.setdefault(attributes["name"], self._filled(attributes.get("value", "")))
        elif tag == "path":
            self.searched.append(self._inside(self._filled(attributes.get("value", "")), place))
        elif tag == "include":
            self._budget.spend("includes", 1, by=place)
            name = self._filled(attributes.get("filename", ""))
            self.file(self._found(name, place, [beside, *self.searched, self._folder]), name, level + 1)
        elif (
            tag == "spectrum" and "filename" in attributes
        ):  # a file that Mitsuba's parser opens in one of these folders
            name = self._filled(attributes["filename"])
            having = [where for where in (*self.searched, self._folder) if is_plain(name) and (where / name).is_file()]
            for folder in having or [self._folder]:
                path = self._found(name, place, [folder])
                self._budget.count_file(path, path.stat().st_size)
        elif tag == "scene" and level == 0:
            self._versioned = "version" in attributes
        elif tag in NORI and not self._versioned:
            raise SceneError(f"{place}: a scene of Nori, which is not read; Mitsuba 3 XML is (docs/scene.md)")

    def _found(self, name: str, place: str, folders: Sequence[Path]) -> Path:
        """Return the path of a file that is opened now: in the first of the folders that has it."""
        what = f"{place}: filename"
        beside, name = located(name, folders, (self._folder, *self._allowed), what)
        within = next(
            folder for folder in (*self._allowed, self._folder) if _lies_in(beside, folder) or folder is self._folder
        )
        return path_within(name, within, what=what, largest=LARGEST, beside=beside)

    def _inside(self, name: str, place: str) -> Path:
        where = (self._folder / name).resolve() if is_plain(name) else Path("/")
        if not any(_lies_in(where, folder) for folder in (self._folder, *self._allowed)):
            raise SceneError(f"{place}: value must be a folder inside the scene's own, got {shown(name)}; {LET_IN}")
        return where

    def _length(self, text: str) -> int:
        filled_in = sum(
            len(self._values.get(match[1], match[0])) - len(match[0]) for match in _PARAMETER.finditer(text)
        )
        return len(text) + filled_in

    def _filled(self, text: str) -> str:
        return _PARAMETER.sub(lambda match: self._values.get(match[1], match[0]), text)


def _lies_in(where: Path, folder: Path) -> bool:
    return where.resolve().is_relative_to(folder.resolve())


# Mitsuba's parser, in double precision. It runs in a worker process, as renders do, and nothing is loaded.


NEWLINE = ord("\n")
SAMPLED = ("regular", "irregular", "blackbody")  # elements that are spectra
COLOURS = "colours of the spectrum"  # a property that they get here


@dataclass(frozen=True, kw_only=True)
class MatrixProperty:
    """A property that is a matrix, float64 (4, 4)."""

    matrix: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """A property that is a spectrum: a single level at all wavelengths, or the colours of its samples."""

    level: float | None
    reflectance: tuple[float, ...]  # linear sRGB under daylight (D65)
    emission: tuple[float, ...]  # linear sRGB


@dataclass(frozen=True, kw_only=True)
class ElementReference:
    """A property that is another element, by its place among all of them."""

    element: int


Property = bool | int | float | str | list[float] | list[list[float]] | MatrixProperty | Spectrum | ElementReference
# What the worker returns of an element: kind, plug-in, id, place (file, line and column) and properties; and of a file
# the names of the files that were read, the first one first, and the elements, the root first.
ParsedElement = tuple[str, str, str, str, dict[str, Property]]
ParsedFile = tuple[list[str], list[ParsedElement]]


@dataclass(frozen=True, kw_only=True)
class ParsingTask:
    """A file for Mitsuba's parser, and the parameters that are set from outside."""

    path: str
    parameters: dict[str, str]


def serve_parser(kind: str, connection: Channel) -> None:
    """Parse files in a worker."""
    serve(kind, connection, _parser)


def _parser(kind: str) -> Callable[[ParsingTask], ParsedFile | str]:
    """Import Mitsuba and return the function that parses a file."""
    import mitsuba as mi

    mi.set_variant(kind)
    return parsed


def parsed(task: ParsingTask) -> ParsedFile | str:
    """Return the files that were read and their elements, or Mitsuba's words where it refuses the file.

    Parameters are filled in, older names brought up to date, references resolved.
    """
    import mitsuba as mi

    path, parameters = task.path, task.parameters
    if taken := {"config", "filename"} & set(parameters):  # the names of its own arguments
        return f"Mitsuba's parser can set no parameter that is called {min(taken)}"
    files = mi.file_resolver()  # pyright: ignore[reportCallIssue]  it keeps the `path` elements of the file before
    files.clear()
    files.append(str(Path(path).parent))
    config = mi.parser.ParserConfig(VARIANT)
    config.max_include_depth = DEEPEST_INCLUDE
    config.parallel = False
    try:
        state = mi.parser.parse_file(config, path, **parameters)
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve_references(config, state)
    except RuntimeError as error:
        return " ".join(_SOURCE.sub("", str(error)).split())[:LONGEST]
    lines = [_LineStarts(Path(str(name)), Path(path).parent) for name in state.files]
    elements = [_element(node, lines[node.file_index].place(node.offset)) for node in state.nodes]
    return [str(name) for name in state.files], elements


class _LineStarts:
    """Where the lines of a file begin: Mitsuba's own word for a place counts them anew for every element."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._name = str(path).removeprefix(f"{folder}/")
        content = path.read_bytes()
        self._starts = [0, *(place + 1 for place, byte in enumerate(content) if byte == NEWLINE)]

    def place(self, offset: int) -> str:
        line = bisect_right(self._starts, offset)
        return f"{self._name} (line {line}, col {offset - self._starts[line - 1] + 1})"


def _element(node: Any, place: str) -> ParsedElement:
    properties = node.props
    stored = {name: _value(properties[name]) for name in properties.keys()}  # noqa: SIM118 - iterates over nothing
    if properties.plugin_name() in SAMPLED:
        with contextlib.suppress(KeyError, TypeError, ValueError, RuntimeError):  # then it is a texture like any other
            stored[COLOURS] = _of_plugin(properties.plugin_name(), stored)
    return str(node.type).rpartition(".")[2], properties.plugin_name(), properties.id(), place, stored


def _value(value: Any) -> Property:
    """Return a property; of a kind that is not read, its kind and value in words."""
    kind = type(value).__name__
    if kind == "ResolvedReference":
        return ElementReference(element=value.index())
    if kind == "Spectrum":
        return _colours(value)
    if "Transform" in kind:  # Dr.Jit's arrays have a member called matrix, too
        return MatrixProperty(matrix=np.array(value.matrix, dtype=np.float64))
    if isinstance(value, bool | int | float | str):
        return value
    try:
        return np.array(value, dtype=np.float64).tolist()
    except (TypeError, ValueError, RuntimeError):
        return f"{kind} {value}"[:80]


def _colours(spectrum: Any) -> Spectrum:
    """Return a spectrum's colours, integrated as Mitsuba's modes for RGB do (its `bounded` and `d65`)."""
    levels = [float(level) for level in spectrum.values]
    if spectrum.is_uniform():
        return Spectrum(level=levels[0], reflectance=(), emission=())
    return _integrated([float(wave) for wave in spectrum.wavelengths], levels)


def _of_plugin(plugin: str, properties: dict[str, Property]) -> Spectrum:
    """Return the colours of a `SAMPLED` plug-in: samples at wavelengths [nm], or Planck's law [W/(m^2 sr nm)]."""
    if plugin == "blackbody":
        waves = np.arange(360.0, 831.0, 5.0)
        hotness = 1.438776877e7 / (waves * float(properties["temperature"]))  # type: ignore[arg-type]  hc / (lambda k T)
        return _integrated(waves.tolist(), (1.191042972e20 / waves**5 / np.expm1(hotness)).tolist())
    levels = _listed(properties["values"])
    if plugin == "irregular":
        return _integrated(_listed(properties["wavelengths"]), levels)
    first, last = (float(properties[f"wavelength_{end}"]) for end in ("min", "max"))  # type: ignore[arg-type]
    return _integrated(np.linspace(first, last, len(levels)).tolist(), levels)


def _listed(value: Property) -> list[float]:
    return [float(word) for word in str(value).replace(",", " ").strip("[]").split()]


def _integrated(waves: list[float], levels: list[float]) -> Spectrum:
    import mitsuba as mi

    reflectance, emission = (mi.spectrum_list_to_srgb(waves, levels, of, of) for of in (True, False))
    return Spectrum(level=None, reflectance=tuple(map(float, reflectance)), emission=tuple(map(float, emission)))


# Limits of the worker: time, with its start and Mitsuba's import, and memory, with Mitsuba's own code.
SECONDS, BYTES_A_SECOND = 60.0, 2**20
MEMORY, MEMORY_A_BYTE = 2**30, 64  # bytes


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element: its kind ("Shape", "BSDF", "Emitter", ...), its plug-in's name and its properties."""

    kind: str
    plugin: str
    id: str
    place: str  # file, line and column, with its id if it has one
    properties: dict[str, Property]
    budget: Budget  # of the whole scene: an element may occur repeatedly
    folders: tuple[Path, ...]  # the folders of the files that it may name, the scene's own first
    allowed: tuple[Path, ...]  # folders, in addition to the scene's own, whose files may be named
    _all: list["Element"]
    _read: set[str] = field(default_factory=set)  # names of properties that were read

    def get(self, name: str, default: Any) -> Any:
        """Return a property, or `default` if the file lacks it."""
        self._read.add(name)
        return self.properties.get(name, default)

    def number(self, name: str, default: float) -> float:
        """Return a property that is a number."""
        value = self.get(name, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._refusal(name, "a number", value)
        return float(value)

    def whole(self, name: str, default: int) -> int:
        """Return a property that is a whole number."""
        value = self.get(name, default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self._refusal(name, "a whole number", value)
        return value

    def flag(self, name: str, *, default: bool = False) -> bool:
        """Return a property that is true or false."""
        value = self.get(name, default)
        if not isinstance(value, bool):
            raise self._refusal(name, "true or false", value)
        return value

    def text(self, name: str, default: str) -> str:
        """Return a property that is a text."""
        value = self.get(name, default)
        if not isinstance(value, str):
            raise self._refusal(name, "a text", value)
        return value

    def three(self, name: str, default: tuple[float, float, float]) -> np.ndarray:
        """Return a property that is a point, a vector or a colour, float64 (3,)."""
        value = self.get(name, default)
        if isinstance(value, str | bool | MatrixProperty | Spectrum | ElementReference) or np.shape(value) not in (
            (),
            (3,),
        ):
            raise self._refusal(name, "three numbers", value)
        return np.broadcast_to(np.asarray(value, dtype=np.float64), 3)

    def _refusal(self, name: str, what: str, value: Any) -> SceneError:
        kinds = {MatrixProperty: "a transform", Spectrum: "a spectrum", ElementReference: "another element"}
        return SceneError(f"{self.place}: {name} must be {what}, got {kinds.get(type(value), shown(value))}")

    def has(self, name: str) -> bool:
        """Return whether the file contains a property."""
        self._read.add(name)
        return name in self.properties

    def unread(self) -> list[str]:
        """Return the names of plain properties that were not read, if any property of this element was read."""
        plain = [name for name, value in self.properties.items() if not isinstance(value, ElementReference)]
        return [name for name in plain if name not in self._read] if self._read else []

    def children(self, kind: str | None = None) -> Iterator[tuple[str, "Element"]]:
        """Yield the names and elements below this one, in the file's order."""
        for name, value in self.properties.items():
            if isinstance(value, ElementReference):
                self.budget.spend("references", 1, by=self.place)
                child = self._all[value.element]
                if kind is None or child.kind == kind:
                    yield name, child

    def everything(self) -> list["Element"]:
        """Return all elements of the file."""
        return self._all

    def matrix(self) -> np.ndarray:
        """Return `to_world`, float64 (4, 4); the identity if the file lacks it."""
        value = self.get("to_world", None)
        if value is None:
            return np.eye(4)
        if not isinstance(value, MatrixProperty):
            raise self._refusal("to_world", "a transform", value)
        return value.matrix


def read_tree(path: Path, allowed: tuple[Path, ...] = (), parameters: Mapping[str, str] | None = None) -> Element:
    """Return the root element of a file: its parameters filled in, older names brought up to date, references resolved.

    Its `path` elements may name folders inside its own and inside those `allowed`. `parameters` are set from outside.

    Raises:
        SceneError: it asks for too much, Mitsuba's parser refuses it, in its own words on one line, or it includes a
            file from elsewhere.

    """
    budget = Budget()
    searched = scan(path, budget, allowed, parameters)
    task = ParsingTask(path=str(path.resolve()), parameters=dict(parameters or {}))
    reply = _reply(task, seconds=SECONDS + budget.read / BYTES_A_SECOND, memory=MEMORY + MEMORY_A_BYTE * budget.read)
    if reply.error is not None:
        raise SceneError(f"Mitsuba's parser failed: {reply.error}")
    if isinstance(reply.value, str):
        raise SceneError(reply.value)
    files, parsed_elements = reply.value
    inside = [folder.resolve() for folder in (path.parent, *allowed)]
    for included in map(Path, files[1:]):
        if not any(included.resolve().is_relative_to(folder) for folder in inside):
            raise SceneError(f"{included}, which it includes, must lie inside the file's folder")
    elements: list[Element] = []
    for kind, plugin, name, place, properties in parsed_elements:
        elements.append(
            Element(
                kind=kind,
                plugin=plugin,
                id=name,
                place=f"{place}{f', {name!r}' if name else ''}",
                properties=properties,
                budget=budget,
                folders=(path.parent, *searched),
                allowed=allowed,
                _all=elements,
            )
        )
    return elements[0]


@cache
def _pool() -> Pool:
    """Return the pool of the parser's worker, which is kept for the next file and ends with this process."""
    pool = Pool(jobs=1, timeout=SECONDS, target=serve_parser)
    atexit.register(pool.close)
    return pool


def _reply(task: ParsingTask, *, seconds: float, memory: float) -> Reply:
    """Return the worker's reply within the limits of time [s] and memory [bytes]."""
    pool = _pool()
    pool.memory = memory
    try:
        return pool.reply(VARIANT, task, seconds=seconds)
    except BaseException:  # the worker's reply to this file would be read as the next file's
        pool.close()
        _pool.cache_clear()
        raise
