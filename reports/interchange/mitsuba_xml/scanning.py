"""What a Mitsuba XML file asks for, counted before Mitsuba reads it: elements, nesting, includes, unfolded parameters.

Only what decides how much is read is followed: `include`, `path` and `default`. The rest is Mitsuba's to understand.
"""

import re
from pathlib import Path
from xml.parsers import expat

from rayproof.cases.mesh_files import content_of, path_within
from rayproof.cases.mesh_sandbox import Budget
from rayproof.cases.scene import SceneError, shown

LARGEST = 256 * 2**20  # bytes of a file
DEEPEST_INCLUDE = 8
_PARAMETER = re.compile(r"\$(\w+)")


def scan(path: Path, budget: Budget, allowed: tuple[Path, ...] = ()) -> tuple[Path, ...]:
    """Spend what reading a file and all that it includes takes; return the folders in which it looks for files.

    They lie in its own folder, or in those `allowed`.

    Raises:
        SceneError: it takes too much, is no XML, or includes what does not lie there; without the file's name.

    """
    reading = _Scan(path.parent, budget, allowed)
    reading.file(path.resolve(), path.name, 0)
    return tuple(reading.searched)


class _Scan:
    def __init__(self, folder: Path, budget: Budget, allowed: tuple[Path, ...]) -> None:
        self._folder, self._budget, self._allowed = folder, budget, allowed
        self._values: dict[str, str] = {}  # of the parameters so far; the first value counts
        self.searched: list[Path] = []  # where `path` elements say that files lie

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
            self.file(self._found(name, place, beside), name, level + 1)

    def _found(self, name: str, place: str, beside: Path) -> Path:
        """Return the path of an included file: beside the one that names it, or where a `path` said."""
        candidates = [beside, *self.searched, self._folder]
        usable = next((where for where in candidates if (where / name).exists()), beside) if _plain(name) else beside
        within = next(one for one in (*self._allowed, self._folder) if _lies_in(usable, one) or one is self._folder)
        return path_within(name, within, what=f"{place}: filename", largest=LARGEST, beside=usable)

    def _inside(self, name: str, place: str) -> Path:
        where = (self._folder / name).resolve() if _plain(name) else Path("/")
        if not any(_lies_in(where, one) for one in (self._folder, *self._allowed)):
            hint = "another one is let in by --allow-folder"
            raise SceneError(f"{place}: value must be a folder inside the scene's own, got {shown(name)}; {hint}")
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


def _plain(name: str) -> bool:
    """Say whether a name can be looked up at all: long and unprintable ones cannot."""
    return name.isprintable() and len(name) < 1000 and all(len(part) < 250 for part in Path(name).parts)
