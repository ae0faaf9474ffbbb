"""What a worker says of itself before it gets a batch, and the first thing in which two machines differ.

A record must not depend on which machine made it. So code, packages, processor, references and the program under test
are the same, or the worker gets no work.
"""

import os
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from rayproof.reports.run.case import Terms
from rayproof.reports.run.reference_cache import PACKAGES, code, processor
from rayproof.reports.run.verdict_memory import version as reference_version
from rayproof.reports.subjects.choosing import identity
from rayproof.tracer.kernel.compiler import VARIABLE, packaged_library

LLVM = "karellen-llvm-core"


@dataclass(frozen=True, kw_only=True)
class Facts:
    """One machine, as far as records depend on it: by what, the value."""

    told: dict[str, str]
    model: str  # of the processor, for people

    def difference(self, other: "Facts") -> str | None:
        """Return in words the first thing in which another machine differs from this one, or None."""
        for name in dict.fromkeys((*self.told, *other.told)):
            here, there = self.told.get(name, "not there"), other.told.get(name, "not there")
            if here == there:
                continue
            if name == "processor features":
                here, there = (
                    " ".join(sorted({*one.split()} - {*two.split()})) or "no more"
                    for one, two in ((here, there), (there, here))
                )
            return f"{name}: {_short(there)} there, {_short(here)} here"
        return None


def facts(terms: Terms) -> Facts:
    """Return what this machine is for a run on these terms."""
    architecture, model, features = processor()
    told = {"rayproof's code": code(tracer=True)}
    told |= {package: _installed(package) for package in PACKAGES}
    told |= {
        "Python": platform.python_version(),
        "architecture": architecture,
        "processor": model,
        "processor features": features,
        "LLVM": _llvm(),
        "RAYPROOF_BACKEND": os.environ.get("RAYPROOF_BACKEND", ""),
    }
    told |= {f"reference {name}": reference_version(name) for name in terms.demands.references}
    if terms.subject.is_program:
        told["program under test"] = " ".join(identity(terms.subject))
    return Facts(told=told, model=model)


def _llvm() -> str:
    """Return which LLVM compiles: the version of the one that came with the packages, or where another one lies."""
    chosen, packaged = os.environ.get(VARIABLE), packaged_library()
    return _installed(LLVM) if packaged is not None and chosen in (None, str(packaged)) else str(chosen)


def _installed(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not there"


def _short(value: str) -> str:
    return value if len(value) <= 60 else f"{value[:28]}...{value[-28:]}"
