"""Which of our own files a module's answers can depend on: all that it imports, directly or not, read from the sources.

Nothing is imported for it. An import anywhere in a file counts, also inside a function; so does a module named in a
string ("package.module"), and of a package that lists itself (a registry's, or one that walks its
modules) everything below. Files that a module names in a string and that lie beside it (findings.json) are part of it.
What is found is too much rather than too little: a name in a comment or docstring may count as an import. Imports for
type checkers alone never happen, and do not count: the package's own would bring everything into every key.
"""

import os
import re
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

from rayproof import HOLDER, ROOT

_FROM = re.compile(r"^[ \t]*from[ \t]+(rayproof(?:\.\w+)*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*import[ \t]+(rayproof(?:\.\w+)*)", re.MULTILINE)
_FOR_TYPES = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+[^\n]*\n|\n)*", re.MULTILINE)
_NAMED = re.compile(r"[\"'](rayproof(?:\.\w+)+)[\"']")
_REGISTRY = re.compile(r"package=[\"'](rayproof(?:\.\w+)*)[\"']")
_LISTS_ITSELF = re.compile(r"\bpkgutil\.\w+\(__path__")
_FILE = re.compile(r"[\"']([\w-]+\.\w+)[\"']")
_WORD = re.compile(r"\w+")


@cache
def closure(modules: Sequence[str], *, without: Sequence[str] = ()) -> tuple[Path, ...]:
    """Return the files below `ROOT` that `modules` (dotted names) depend on, themselves included, sorted.

    Packages in `without` are not entered.

    Raises:
        LookupError: there is no such module.

    """
    found: set[Path] = set()
    waiting = list(modules)
    for module in modules:
        if _file(module) is None:
            raise LookupError(f"no module is called {module}: what depends on it would never change")
    seen: set[str] = set()
    while waiting:
        module = waiting.pop()
        if module in seen or _inside(module, without):
            continue
        seen.add(module)
        file = _file(module)
        if file is None:
            continue  # a name inside a module, a word in a string
        found.add(file)
        parent = module.rpartition(".")[0]
        names, beside = _read(file)
        found.update(beside)
        # To import a module is to import its packages first.
        waiting += [*names, *([parent] if parent else [])]
    return tuple(sorted(found, key=str))


def _inside(module: str, packages: Iterable[str]) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


@cache
def _file(module: str) -> Path | None:
    """Return the file of a module or package, or None."""
    inside = module.removeprefix("rayproof.")
    path = f"{HOLDER if inside == module else ROOT}/{inside.replace('.', '/')}"  # text, as paths are slow
    for file in (f"{path}.py", f"{path}/__init__.py"):
        if os.path.isfile(file):  # noqa: PTH113  as said
            return Path(file)
    return None


@cache
def _read(file: Path) -> tuple[tuple[str, ...], tuple[Path, ...]]:
    """Return the names that a file may import, and the files beside it that it names."""
    text = _FOR_TYPES.sub("", file.read_text(encoding="utf-8"))
    names = {*_IMPORT.findall(text), *_NAMED.findall(text)}
    for package, imported in _FROM.findall(text):
        names |= {package, *(f"{package}.{word}" for word in _WORD.findall(imported))}
    listed = _REGISTRY.findall(text)
    if "pkgutil" in text and _LISTS_ITSELF.search(text):
        listed.append(".".join(["rayproof", *file.parent.relative_to(ROOT).parts]))
    for package in listed:
        names.update(_below(package))
    beside = [f"{file.parent}/{name}" for name in set(_FILE.findall(text))]
    return tuple(names), tuple(Path(path) for path in beside if os.path.isfile(path))  # noqa: PTH113


def _below(package: str) -> Iterable[str]:
    """Yield all modules of a package, by their dotted names."""
    folder = ROOT.joinpath(*package.split(".")[1:])
    for path in folder.rglob("*.py"):
        parts = ("rayproof", *path.relative_to(ROOT).with_suffix("").parts)
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
