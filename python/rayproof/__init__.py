"""rayproof: a conformance harness for ray tracers.

    import rayproof

    def my_renderer(scene, stages):            # stages: some of "ray", "object", ... "radiance"
        return {"radiance": image}             # float arrays (height, width, channels)

    result = rayproof.run(["primitives"], subject=my_renderer)
    print(result)                              # coverage, then the verdict
    result.raise_if_failed()

docs/python.md describes each of the names; `reports/api` holds them.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rayproof.reports.api.asking import load, oracle, render, select_cases
    from rayproof.reports.api.judging import judge
    from rayproof.reports.api.outcome import compare, view3d
    from rayproof.reports.api.running import run

__all__ = ["compare", "judge", "load", "oracle", "render", "run", "select_cases", "view3d"]
HOLDER = Path(__file__).resolve().parents[1]  # the folder that Python finds this package in
# The folder that holds cases, reference, reports and tracer. In a checkout that is its top, so that no symbolic link is
# needed: the links beside this file serve the type checker and import-linter. An installed wheel holds the four itself.
ROOT = HOLDER.parent if (HOLDER.parent / "pyproject.toml").is_file() else Path(__file__).resolve().parent
__path__[:] = [str(ROOT)]
# Name -> the module below `reports/api` that has it. Keys of the cache cover what modules name: no dotted names here.
_PLACES = {
    "compare": "outcome",
    "judge": "judging",
    "load": "asking",
    "oracle": "asking",
    "render": "asking",
    "run": "running",
    "select_cases": "asking",
    "view3d": "outcome",
}


def __getattr__(name: str) -> Any:
    """Import a name of the API when it is first used."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.reports.api.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    """Return the names of the API beside the module's own."""
    return sorted({*globals(), *__all__})
