"""A registry that reads what its folder declares and imports a thing when it is asked for, and not before.

For things whose imports take long, and of which a process needs one: what
`@REFERENCES.register("certified", independent=True)` says is read from the source, names and facts alike.
"""

import ast
import importlib
from collections.abc import Collection
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

from cases.registry import Registry

Thing = TypeVar("Thing")


class DeclaredRegistry(Registry[Thing]):
    """Named things of one kind, in any file below the package.

    The decorator stands on a class or function of the module, under the registry's name, with literal arguments.
    """

    def __init__(self, kind: str, *, package: str, name: str) -> None:
        super().__init__(kind, package=package)
        self._decorator = f"{name}.register"
        self._modules: dict[str, str] = {}

    def load(self) -> None:
        """Read what the package's files declare, once; import none of them.

        Raises:
            ValueError: a name is declared twice, a fact is no literal, or something registers in another way.

        """
        if self._loaded:
            return
        spec = find_spec(self.package)
        for folder in (spec and spec.submodule_search_locations) or ():
            for path in sorted(Path(folder).rglob("*.py")):
                source = path.read_bytes()
                if f"{self._decorator}(".encode() in source:
                    self._read(ast.parse(source, path), _module(self.package, path.relative_to(folder)))
        # Only now: whoever looks again after an error meets it again, instead of what was read until then.
        self._loaded = True

    def _read(self, tree: ast.Module, module: str) -> None:
        decorators = [one for node in tree.body for one in getattr(node, "decorator_list", ())]
        for call in ast.walk(tree):
            if not isinstance(call, ast.Call) or ast.unparse(call.func) != self._decorator:
                continue
            if call not in decorators:
                raise ValueError(f"{module}, line {call.lineno}: {self._decorator} must decorate what the module holds")
            name = ast.literal_eval(call.args[0])
            if self._modules.setdefault(name, module) != module:
                raise ValueError(f"{self.kind} {name!r} is registered twice")
            self._about[name] = {str(fact.arg): ast.literal_eval(fact.value) for fact in call.keywords}

    def __getitem__(self, name: str) -> Thing:
        """Return the thing called `name`, imported now; raise LookupError that lists what is known."""
        self.load()
        if name not in self._things and name in self._modules:
            importlib.import_module(self._modules[name])
        return super().__getitem__(name)

    def _names(self) -> Collection[str]:
        self.load()
        return {*self._modules, *self._things}


def _module(package: str, path: Path) -> str:
    """Return the name of the module in a file, relative to its package's folder."""
    parts = path.with_suffix("").parts
    return ".".join([package, *(parts[:-1] if parts[-1] == "__init__" else parts)])
