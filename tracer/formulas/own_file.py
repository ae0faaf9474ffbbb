"""A formula in a user's file (slot=FILE.py:function): parsed, imported late, checked against its slot, copied.

Numbers for parameters that the function has beyond its slot's may follow: slot=FILE.py:function(eps=1e-4). To name one
executes nothing: its file is imported when the function is first needed, checked against its slot's contract, and each
mistake is reported in one line.
"""

import hashlib
import importlib.util
import inspect
import math
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial, update_wrapper
from pathlib import Path, PurePath
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rayproof.tracer.formulas import Formula

MARK = ".py:"  # distinguishes a user's function, FILE.py:function, from the name of a variant
# The place of a user's function: its file, its name, and the numbers that are given for its own parameters.
PLACE = re.compile(rf"(?P<path>.*{re.escape(MARK[:-1])}):(?P<function>[^:()]*)(?:\((?P<numbers>[^()]*)\))?")
_LOADED: dict[tuple[object, ...], "Checked"] = {}  # by slot, place, and the file as it was found there
_COPIES: dict[str, Path] = {}  # by the path that the user wrote


def is_own(variant: str) -> bool:
    """Return whether a variant, or a name that has it, is a function of the user's."""
    return MARK in variant


class OwnFormulaError(ValueError):
    """The user's file or function does not fit the slot; the message is one line with its name."""


def canonical(place: str) -> str:
    """Return "FILE.py:function" by the shortest path that may have been written: ./mine.py:f is mine.py:f.

    Numbers are written in one way, by the names of their parameters: mine.py:f(eps=1e-4) is mine.py:f(eps=0.0001).

    Raises:
        OwnFormulaError: a parameter is named twice or is no finite number.

    """
    path, function, numbers = parsed(place)
    parameters = ",".join(f"{name}={value!r}" for name, value in sorted(numbers.items()))
    return f"{PurePath(path)}:{function}" + (f"({parameters})" if parameters else "")


def parsed(place: str) -> tuple[str, str, dict[str, float]]:
    """Return the file, the function and its numbers of "FILE.py:function(name=number,...)".

    Raises:
        OwnFormulaError: it is not written so, a parameter is named twice, or a value is no finite number.

    """
    match = PLACE.fullmatch(place)
    if match is None:
        raise OwnFormulaError(f"a formula of your own is FILE.py:function or FILE.py:function(eps=1e-4), got {place}")
    numbers: dict[str, float] = {}
    for part in filter(None, (match["numbers"] or "").split(",")):
        name, _, text = (word.strip() for word in part.partition("="))
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not name.isidentifier() or name in numbers or not math.isfinite(value):
            raise OwnFormulaError(f"{place}: {part.strip()!r} must be name=number, once a name")
        numbers[name] = value
    return match["path"], match["function"], numbers


def with_number(text: str, name: str, value: float) -> str:
    """Return "slot=FILE.py:function" with a new number for one of the function's parameters."""
    slot, _, place = text.partition("=")
    path, function, numbers = parsed(place)
    parameters = ",".join(f"{key}={number!r}" for key, number in (numbers | {name: value}).items())
    return f"{slot}={path}:{function}({parameters})"


def own_formula(place: str, *, default: Any) -> Any:
    """Return the function at "FILE.py:function" as a `Formula` of the slot of `default`, another one, with its facts.

    `load` imports the file; it raises OwnFormulaError where that fails or the function does not fit the slot.
    """
    place = canonical(place)
    return replace(
        default,
        name=f"{default.slot}={place}",
        variant=place,
        load=lambda: _loaded(place, default),
        default=False,
        kind="right",
        erratum=None,
        known_bad=None,
        leaks=None,
        equivalent=None,
    )


def digest(formula: "Formula") -> str:
    """Return the SHA-256 of the user's file of `formula` and of its neighbours that it imports.

    Raises:
        OwnFormulaError: it cannot be loaded.

    """
    return _own(formula).content


def sources(formula: "Formula") -> tuple[str, Mapping[str, bytes]]:
    """Return the path of the user's file of `formula`, and the content of it and of its neighbours, by relative path.

    Raises:
        OwnFormulaError: it cannot be loaded.

    """
    return parsed(formula.variant)[0], _own(formula).sources


def copied(path: str, copy: Path) -> None:
    """Use a copy in place of the user's file of that path, as a worker on another machine does."""
    _COPIES[path] = copy


def _own(formula: "Formula") -> "Checked":
    loaded = formula.load()
    if not isinstance(loaded, Checked):
        raise TypeError(f"{formula.name} is not the user's")
    return loaded


def forget() -> None:
    """Read the user's files again when they are next needed: in a notebook they change while this process lives."""
    _LOADED.clear()


def _loaded(place: str, default: "Formula") -> "Checked":
    path, name, numbers = parsed(place)
    file = _COPIES.get(path, Path(path))
    try:
        status = file.stat()
    except OSError as error:
        raise OwnFormulaError(f"{path}: there is no such file") from error
    key = (default.slot, place, status.st_dev, status.st_ino, status.st_mtime_ns, status.st_size)
    if key not in _LOADED:
        function, content, sources = _function(file, name)
        _same_signature(place, function, default, numbers)
        if numbers:
            function = update_wrapper(partial(function, **numbers), function)
        _LOADED[key] = Checked(place, function, default, content, sources)
    return _LOADED[key]


def _function(path: Path, name: str) -> tuple[Callable[..., Any], str, dict[str, bytes]]:
    """Return a function of a file, the SHA-256 of the file and its neighbours, and their sources."""
    if not path.is_file():
        raise OwnFormulaError(f"{path}: there is no such file")
    module, content, sources = _imported(path)
    function = getattr(module, name, None)
    if not callable(function):
        functions = [key for key, value in vars(module).items() if inspect.isfunction(value)]
        raise OwnFormulaError(f"{path} has no function {name!r}; it has {', '.join(functions) or 'none'}")
    return function, content, sources


def _imported(path: Path) -> tuple[ModuleType, str, dict[str, bytes]]:
    name = f"rayproof_own_{path.stem}"
    specification = importlib.util.spec_from_file_location(name, path)
    if specification is None or specification.loader is None:
        raise OwnFormulaError(f"{path}: Python cannot import such a file")
    module = importlib.util.module_from_spec(specification)
    # The file may import its neighbours, as a script would.
    folder = path.resolve().parent
    before = frozenset(sys.modules)
    try:
        source = path.read_bytes()
    except OSError as error:
        raise OwnFormulaError(f"{path}: {error.strerror}") from error
    neighbours: list[Path] = []
    sys.path.insert(0, str(folder))
    sys.modules[name] = module  # a dataclass looks up its module there
    try:
        # Compiled here, since the import system could reuse bytecode of an earlier version of the file.
        exec(compile(source, str(path), "exec", dont_inherit=True), vars(module))
    except (Exception, SystemExit) as error:  # the boundary: whatever a stranger's file does on import is its error
        raise OwnFormulaError(f"{path} does not import: {_told(error, path)}") from error
    finally:
        if str(folder) in sys.path:
            sys.path.remove(str(folder))
        sys.modules.pop(name, None)
        neighbours = _forget_neighbours(folder, frozenset(sys.modules) - before)
    content, sources = hashlib.sha256(source), {path.name: source}
    for neighbour in sorted(neighbours):
        data = neighbour.read_bytes()
        content.update(b"\0" + neighbour.name.encode() + b"\0" + hashlib.sha256(data).digest())
        if neighbour.is_relative_to(folder):
            sources[neighbour.relative_to(folder).as_posix()] = data
    return module, content.hexdigest(), sources


def _forget_neighbours(folder: Path, names: frozenset[str]) -> list[Path]:
    """Remove the modules `names` of `folder` from sys.modules, since another file may import others of the same name.

    Return the files that they were read from.
    """
    own = {name for name in names if any(place.parent == folder for place in _places(sys.modules[name]))}
    forgotten = [name for name in names if name.partition(".")[0] in own]
    files = [place for name in forgotten for place in _places(sys.modules[name]) if place.is_file()]
    for name in forgotten:
        del sys.modules[name]
    return files


def _places(module: ModuleType) -> list[Path]:
    """Return the file of a module, and the folders of a package."""
    specification = getattr(module, "__spec__", None)
    if specification is None:
        return []
    # The origin of a built-in module is a word, not a path.
    files = [specification.origin] if specification.has_location else []
    return [Path(str(place)).resolve() for place in (*files, *(specification.submodule_search_locations or ()))]


def _told(error: BaseException, path: Path) -> str:
    """Return an error's kind, first line, and the line of the user's file that it came from."""
    first = (str(error).splitlines() or [""])[0]
    line = None  # the message of a syntax error contains its line
    step = error.__traceback__
    while step is not None:
        if step.tb_frame.f_code.co_filename == str(path):
            line = step.tb_lineno
        step = step.tb_next
    where = f" (line {line})" if line else ""
    return f"{type(error).__name__}: {first}{where}" if first else f"{type(error).__name__}{where}"


def _same_signature(place: str, function: Callable[..., Any], default: "Formula", numbers: Mapping[str, float]) -> None:
    wanted = list(inspect.signature(default.function).parameters)
    try:
        signature = inspect.signature(function)
        signature.bind(*wanted, **numbers)
    except (TypeError, ValueError) as error:
        raise OwnFormulaError(
            f"{place} cannot be called as {default.slot}({', '.join([*wanted, *numbers])}), as the slot's contract asks"
            f"{' and the numbers given' if numbers else ''}: {error}"
        ) from error


class Checked:
    """The user's function; each call compares kind and shape of its result with those of the slot's default.

    The default's result is never evaluated, so it costs no run time and is not part of the kernel.
    """

    def __init__(
        self,
        place: str,
        function: Callable[..., Any],
        default: "Formula",
        content: str,
        sources: Mapping[str, bytes],
    ) -> None:
        self.place, self.default, self.content, self.sources = place, default, content, sources
        self._function = function
        self.__doc__ = function.__doc__

    def __call__(self, *arguments: Any) -> Any:
        """Return the user's result.

        Raises:
            OwnFormulaError: the function raised, or returned another kind or shape of thing than the slot's default.

        """
        try:
            result = self._function(*arguments)
        except Exception as error:  # the boundary: whatever a stranger's function raises is its error
            function = inspect.unwrap(self._function)
            path = Path(function.__code__.co_filename) if inspect.isfunction(function) else Path()
            raise OwnFormulaError(f"{self.place} raised {_told(error, path)}") from error
        problem = _problem(result, self.default.function(*arguments))
        if problem is not None:
            raise OwnFormulaError(f"{self.place} {problem}")
        return result


def _problem(result: Any, wanted: Any) -> str | None:
    """Return a description of a result's wrong kind or shape, or None."""
    if isinstance(wanted, tuple | list):
        if not isinstance(result, tuple | list) or len(result) != len(wanted):
            return f"returns {_kind(result)}, the slot needs {len(wanted)} values: {', '.join(map(_kind, wanted))}"
        return next((problem for pair in zip(result, wanted, strict=True) if (problem := _problem(*pair))), None)
    if type(result) is not type(wanted):
        return f"returns {_kind(result)}, the slot needs {_kind(wanted)}"
    import drjit as dr  # not above: to read a configuration's name takes no Dr.Jit

    if dr.is_array_v(wanted):
        # A result of width 1 applies to every ray; a wider one must have an entry per ray.
        entries, needed = dr.width(result), dr.width(wanted)
        if entries not in (1, needed):
            return f"returns {entries} entries for {needed} rays"
    return None


def _kind(value: Any) -> str:
    kind = type(value)
    return f"{kind.__module__}.{kind.__name__}" if kind.__module__.startswith("drjit") else kind.__name__
