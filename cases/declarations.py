"""A registry that reads what its folder declares and imports a thing when it is asked for, and not before.

For things whose imports take long, and of which a process needs few: what
`@REFERENCES.register("certified", independent=True)` says is read from the source, names and facts alike.
"""

import ast
import importlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from rayproof.cases.registry import Registry
from rayproof.cases.stages import Stage

Thing = TypeVar("Thing")


class DeclaredRegistry(Registry[Thing]):
    """Named things of one kind, in any file below the package.

    The decorator stands on a class or function of the module, under the registry's name. Facts are literals and stages
    (`Stage.OBJECT`), alone or in a tuple; any other costs the import of its module when it is asked for.
    """

    def __init__(self, kind: str, *, package: str, name: str) -> None:
        super().__init__(kind, package=package)
        self._name = name
        self._decorator = f"{name}.register"
        self._modules: dict[str, str] = {}

    def load(self) -> None:
        """Read what the package's files declare, once; import none of them.

        Raises:
            ValueError: a name is declared twice or is no literal, or something registers in another way.

        """
        if self._loaded:
            return
        spec = find_spec(self.package)
        for folder in (spec and spec.submodule_search_locations) or ():
            for path in sorted(Path(folder).rglob("*.py")):
                source = path.read_bytes()
                if f"{self._decorator}(".encode() in source:
                    self._read(source, _module(self.package, path.relative_to(folder)))
        # Only now: whoever looks again after an error meets it again, instead of what was read until then.
        self._loaded = True

    def _read(self, source: bytes, module: str) -> None:
        tree = ast.parse(source, module)
        calls = [one for node in tree.body for one in getattr(node, "decorator_list", ()) if self._registers(one)]
        if len(calls) != source.count(f"{self._decorator}(".encode()):
            self._refuse_others(tree, calls, module)
        for call in calls:
            name = ast.literal_eval(call.args[0])
            if self._modules.setdefault(name, module) != module:
                raise ValueError(f"{self.kind} {name!r} is registered twice")
            if name not in self._things:
                facts = {str(fact.arg): fact.value for fact in call.keywords}
                self._about[name] = _Declared(facts, lambda name=name: self._registered(name))

    def _registers(self, node: ast.AST) -> bool:
        match node:
            case ast.Call(func=ast.Attribute(value=ast.Name(id=name), attr="register")):
                return name == self._name
        return False

    def _refuse_others(self, tree: ast.Module, calls: Collection[ast.expr], module: str) -> None:
        for node in ast.walk(tree):
            if isinstance(node, ast.expr) and self._registers(node) and node not in calls:
                raise ValueError(f"{module}, line {node.lineno}: {self._decorator} must decorate what the module holds")

    def _registered(self, name: str) -> Mapping[str, Any]:
        self[name]
        return self._about[name]

    def __getitem__(self, name: str) -> Thing:
        """Return the thing called `name`, imported now; raise LookupError that lists what is known."""
        self.load()
        if name not in self._things and name in self._modules:
            importlib.import_module(self._modules[name])
        return super().__getitem__(name)

    def module(self, name: str) -> str:
        """Return the dotted name of the module that declares `name`; raise LookupError if nothing does.

        A thing that was registered where nothing is declared (by a test, say) has the module that it was made in.
        """
        self.load()
        return self._modules[name] if name in self._modules else self[name].__module__

    def _names(self) -> Collection[str]:
        self.load()
        return {*self._modules, *self._things}


def _module(package: str, path: Path) -> str:
    """Return the name of the module in a file, relative to its package's folder."""
    parts = path.with_suffix("").parts
    return ".".join([package, *(parts[:-1] if parts[-1] == "__init__" else parts)])


class _Declared(Mapping[str, Any]):
    """The facts of a declaration; those that cannot be read in the source are what `registered` returns."""

    def __init__(self, facts: Mapping[str, ast.expr], registered: Callable[[], Mapping[str, Any]]) -> None:
        self._names = tuple(facts)
        self._registered = registered
        self._known: dict[str, Any] = {}
        for name, node in facts.items():
            with suppress(ValueError):
                self._known[name] = _value(node)

    def __getitem__(self, name: str) -> Any:
        if name in self._names and name not in self._known:
            return self._registered()[name]
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _value(node: ast.expr) -> Any:
    """Return the value of a literal, of a stage, or of a tuple of them; raise ValueError for anything else."""
    match node:
        case ast.Attribute(value=ast.Name(id="Stage"), attr=name) if name in Stage.__members__:
            return Stage[name]
        case ast.Tuple(elts=parts):
            return tuple(_value(part) for part in parts)
        case _:
            return ast.literal_eval(node)
