"""`Table` (names of things that are imported late) and `Registry` (filled by decorators): things with facts, by name.

Each folder is one extension point, and its `__init__.py` contains the registry and its contract.
* `Table` lists its things as name -> module:attribute with facts. Names and facts are available without any import, and
  a module is imported when a thing in it is first needed: suitable for things whose imports take long.
* `Registry` is filled by decorators; its module, or every module below its package, is imported at the
  first look-up.
In both a module that fails to import stops the run: a formula that is silently missing would not be tested.
"""

import importlib
import pkgutil
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, cast

Thing = TypeVar("Thing")
Registered = TypeVar("Registered")  # for the type checker, a registered class keeps its own type


class Registry(Generic[Thing]):
    """Named things of one kind, registered by the modules of a package."""

    def __init__(self, kind: str, *, package: str) -> None:
        self.kind = kind
        self.package = package
        self._things: dict[str, Thing] = {}
        self._about: dict[str, Mapping[str, Any]] = {}
        self._loaded = False

    def register(self, name: str, **about: Any) -> Callable[[Registered], Registered]:
        """Return a decorator that registers a thing under `name`, with facts `about` it.

        Raises:
            ValueError: the name is taken.

        """

        def remember(thing: Registered) -> Registered:
            if name in self._things:
                raise ValueError(f"{self.kind} {name!r} is registered twice")
            self._things[name] = cast(Thing, thing)
            self._about[name] = about
            return thing

        return remember

    def __getitem__(self, name: str) -> Thing:
        """Return the thing called `name`; raise LookupError with the known names."""
        self.load()
        if name not in self._things:
            raise LookupError(f"no {self.kind} is called {name!r}; known: {', '.join(self) or 'none'}")
        return self._things[name]

    def _names(self) -> Collection[str]:
        self.load()
        return self._things

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names in alphabetical order."""
        return iter(sorted(self._names()))

    def __contains__(self, name: object) -> bool:
        return name in self._names()

    def __len__(self) -> int:
        return len(self._names())

    def about(self, name: str) -> Mapping[str, Any]:
        """Return the facts given when `name` was registered; raise LookupError as `[]` does."""
        if name not in self:
            self[name]
        return self._about[name]

    def load(self) -> None:
        """Import the registry's module, and every module below it if it is a package, once."""
        if self._loaded:
            return
        self._loaded = True
        package = importlib.import_module(self.package)
        for module in pkgutil.walk_packages(getattr(package, "__path__", ()), prefix=f"{self.package}."):
            importlib.import_module(module.name)


@dataclass(frozen=True)
class Place:
    """The location of a thing, "module:attribute", relative to the package of its table."""

    path: str

    def load(self, package: str) -> Any:
        """Import the module and return its attribute.

        Raises:
            LookupError: the module has no such attribute.

        """
        module, _, attribute = self.path.partition(":")
        holder = importlib.import_module(f"{package}.{module}")
        if not hasattr(holder, attribute):
            raise LookupError(f"{package}.{module} has no {attribute!r}")
        return getattr(holder, attribute)


class Entry(Place):
    """A line of a table: the location of a thing, and facts about it. A fact may be a `Place` itself."""

    facts: Mapping[str, Any]

    def __init__(self, path: str, **facts: Any) -> None:
        super().__init__(path)
        object.__setattr__(self, "facts", facts)


class _Facts(Mapping[str, Any]):
    """The facts of an entry; a fact that is a `Place` is loaded when it is read."""

    def __init__(self, facts: Mapping[str, Any], package: str) -> None:
        self._facts, self._package = facts, package

    def __getitem__(self, name: str) -> Any:
        fact = self._facts[name]
        return fact.load(self._package) if isinstance(fact, Place) else fact

    def __iter__(self) -> Iterator[str]:
        return iter(self._facts)

    def __len__(self) -> int:
        return len(self._facts)


class Table(Registry[Thing]):
    """Named things of one kind, each a line of one table.

    PUBLISHERS: Table[Publisher] = Table(
        "publisher",
        package="rayproof.reports.publish",
        entries={"junit": Entry("formats.junit:junit"), "html": Entry("page.page:html", pages=True)},
    )
    """

    def __init__(self, kind: str, *, package: str, entries: Mapping[str, Entry]) -> None:
        super().__init__(kind, package=package)
        self._entries = entries
        self._about = {name: _Facts(entry.facts, package) for name, entry in entries.items()}

    def __getitem__(self, name: str) -> Thing:
        """Return the thing called `name`, imported if necessary; raise LookupError with the known names."""
        if name not in self._things and name in self._entries:
            self._things[name] = self._entries[name].load(self.package)
        return super().__getitem__(name)

    def register(self, name: str, **about: Any) -> Callable[[Registered], Registered]:
        """Return a decorator that adds a thing of a test or a user to the table's."""
        if name in self._entries:
            raise ValueError(f"{self.kind} {name!r} is registered twice")
        return super().register(name, **about)

    def module(self, name: str) -> str:
        """Return the dotted name of the module with the thing `name`; raise LookupError if there is none."""
        if name in self._entries:
            return f"{self.package}.{self._entries[name].path.partition(':')[0]}"
        return self[name].__module__

    def load(self) -> None:
        """Import nothing: the table has all names."""

    def _names(self) -> Collection[str]:
        return {*self._entries, *self._things}
