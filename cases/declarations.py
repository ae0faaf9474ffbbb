"""A registry that reads what its folder declares and imports a thing when it is asked for, and not before.

For things whose imports take long, and of which a process needs one: what
`@REFERENCES.register("certified", independent=True)` says is read from the source, names and facts alike.
"""

import ast
import importlib
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from cases.registry import Registry

Thing = TypeVar("Thing")


class DeclaredRegistry(Registry[Thing]):
    """Named things of one kind, each in a file of the package or of a folder right below it.

    The decorator stands on a class or function, under the registry's name in capitals, with literal arguments.
    """

    def __init__(self, kind: str, *, package: str, name: str) -> None:
        super().__init__(kind, package=package)
        self._decorator = f"{name}.register"
        self._modules: dict[str, str] = {}

    def load(self) -> None:
        """Read what the package's files declare, once; import none of them.

        Raises:
            ValueError: a name is declared twice, or a fact is no literal.

        """
        if self._loaded:
            return
        self._loaded = True
        spec = find_spec(self.package)
        for folder in (spec and spec.submodule_search_locations) or ():
            for path in sorted([*Path(folder).glob("*.py"), *Path(folder).glob("*/*.py")]):
                source = path.read_bytes()
                if f"@{self._decorator}(".encode() in source:
                    self._read(ast.parse(source, path), _module(self.package, path.relative_to(folder)))

    def _read(self, tree: ast.Module, module: str) -> None:
        for node in tree.body:
            for decorator in getattr(node, "decorator_list", ()):
                if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) == self._decorator:
                    name = ast.literal_eval(decorator.args[0])
                    if self._modules.setdefault(name, module) != module:
                        raise ValueError(f"{self.kind} {name!r} is registered twice")
                    self._about[name] = {str(fact.arg): ast.literal_eval(fact.value) for fact in decorator.keywords}

    def __getitem__(self, name: str) -> Thing:
        """Return the thing called `name`, imported now; raise LookupError that lists what is known."""
        self.load()
        if name not in self._things and name in self._modules:
            importlib.import_module(self._modules[name])
        if name not in self._things:
            raise LookupError(f"no {self.kind} is called {name!r}; known: {', '.join(self) or 'none'}")
        return self._things[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names in alphabetical order."""
        return iter(sorted(self._names()))

    def __contains__(self, name: object) -> bool:
        return name in self._names()

    def __len__(self) -> int:
        return len(self._names())

    def _names(self) -> set[str]:
        self.load()
        return {*self._modules, *self._things}

    def about(self, name: str) -> Mapping[str, Any]:
        """Return the facts given where `name` is registered; raise LookupError as `[]` does."""
        if name not in self:
            self[name]
        return self._about[name]


def _module(package: str, path: Path) -> str:
    """Return the name of the module in a file, relative to its package's folder."""
    parts = path.with_suffix("").parts
    return ".".join([package, *(parts[:-1] if parts[-1] == "__init__" else parts)])
