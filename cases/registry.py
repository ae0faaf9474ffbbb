"""A registry: a decorator puts a thing in under a name, an explained lookup takes it out.

One folder is one extension point. Its `__init__.py` makes the registry and states the contract; every module
below the folder is imported at the first look-up, so that a new file needs no second place to be listed in. A
module that fails to import stops the run, because a formula that silently vanished would be a formula not tested.
"""

import importlib
import pkgutil
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, Generic, TypeVar, cast

Thing = TypeVar("Thing")
Registered = TypeVar("Registered")  # keeps its own type: a class stays that class for the type checker


class Registry(Generic[Thing]):
    """Named things of one kind, found by listing the package that holds them."""

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
        """Return the thing called `name`; raise LookupError that lists what is known."""
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
        """Import every module below the registry's package, once."""
        if self._loaded:
            return
        self._loaded = True
        package = importlib.import_module(self.package)
        for module in pkgutil.walk_packages(package.__path__, prefix=f"{self.package}."):
            importlib.import_module(module.name)
