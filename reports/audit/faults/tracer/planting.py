"""How a fault of one path is planted: a method is wrapped, or the trees are built anew while a builder is wrong."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import wraps
from typing import Any

from rayproof.cases.stages import Stage
from rayproof.reports.audit.faults import FAULTS
from rayproof.reports.audit.faults.patching import altered, replaced
from rayproof.tracer.acceleration import shape_bvh, triangle_bvh

Wrong = Callable[..., Any]  # what takes the right function or the right value first, then what that was given


def _forget_trees() -> None:
    triangle_bvh.host_forest.cache_clear()
    shape_bvh.host_crowd.cache_clear()


@contextmanager
def anew(planting: AbstractContextManager[None]) -> Iterator[None]:
    """Plant something, and let no tree be kept from before or for afterwards."""
    _forget_trees()
    try:
        with planting:
            yield
    finally:
        _forget_trees()


def _register(
    name: str,
    plant: Callable[[], AbstractContextManager[None]],
    what: str,
    *,
    path: str,
    stage: Stage,
    cases: Sequence[str],
    routes: Sequence[str] = (),
    also: Sequence[Stage] = (),
    precision: str = "float32",
) -> None:
    @contextmanager
    def planted() -> Iterator[None]:
        with anew(plant()):
            yield

    planted.__doc__ = what
    FAULTS.register(
        f"path/{name}",
        where="tracer",
        stage=stage,
        also=tuple(also),
        cases=tuple(cases),
        path=path,
        routes=tuple(routes),
        precision=precision,
    )(planted)


def method(name: str, owner: type, called: str, wrong: Wrong, what: str, **about: Any) -> None:
    """Register a fault that calls `wrong(right, self, ...)` in place of a method, property or cached property."""
    right = vars(owner)[called]

    def plant() -> AbstractContextManager[None]:
        if isinstance(right, property):
            getter: Any = right.fget
            return altered(owner, called, property(lambda self: wrong(getter, self)))
        if hasattr(right, "func"):
            # A cached property keeps what it computed in the object; so must the wrong one.
            function = right.func

            def kept(self: Any) -> Any:
                if called not in self.__dict__:
                    self.__dict__[called] = wrong(function, self)
                return self.__dict__[called]

            return altered(owner, called, property(kept, lambda self, value: self.__dict__.__setitem__(called, value)))
        if isinstance(right, staticmethod):
            inner = right.__func__
            return altered(owner, called, staticmethod(lambda *given: wrong(inner, *given)))

        @wraps(right)
        def method_of(self: Any, *given: Any, **named: Any) -> Any:
            return wrong(right, self, *given, **named)

        return altered(owner, called, method_of)

    _register(name, plant, what, **about)


def function(name: str, right: Any, wrong: Wrong, what: str, **about: Any) -> None:
    """Register a fault that calls `wrong(right, ...)` in place of a function, wherever it was imported to."""

    def plant() -> AbstractContextManager[None]:
        return replaced(right, wraps(right)(lambda *given, **named: wrong(right, *given, **named)))

    _register(name, plant, what, **about)
