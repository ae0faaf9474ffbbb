"""Keys of the cache: scenes and other data as digests, with rayproof's sources, the packages and the processor.

A key is everything that an answer depends on, as a dataclass with a field for each: a change of any of them is another
question. To keep another kind of answer, declare a `Key` of its own and ask `cache_store` for it;
`tests/harness/guards/keys.py` then wants a sample of the key, whose every field it changes.
"""

import hashlib
import json
import os
import platform
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from rayproof import ROOT
from rayproof.cases.scene import Mesh

# Whose numbers are in an answer or a verdict.
PACKAGES = (
    "drjit",
    "embreex",
    "mitsuba",
    "numpy",
    "openexr",
    "pyradiance",
    "python-flint",
    "scikit-image",
    "scipy",
    "trimesh",
)
# In /proc/cpuinfo: what makes the processor's model, and which of its features compute. The rest, such as those against
# leaks, depends on the kernel.
_MODEL = ("vendor_id", "cpu family", "model", "CPU implementer", "CPU architecture", "CPU variant", "CPU part")
_COMPUTES = re.compile(r"(sse|ssse|avx|fma|f16c|bmi|amx|abm|popcnt|movbe|adx|gfni|vaes|fp|asimd|sve|sme|bf16|i8mm)")


@dataclass(frozen=True, kw_only=True)
class Key:
    """All that one kind of kept answer depends on, field by field: a change of any is another question.

    The harness's guards (`tests/harness/guards/keys.py`) change one field after another and see another digest.
    """

    code: str
    machine: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Return the name under which the answer is kept."""
        return digest(exact(self))


PLAIN = frozenset({str, int, float, bool, type(None)})


def digest(content: Any) -> str:
    """Return the SHA-256 of JSON data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def exact(value: Any) -> Any:
    """Return data as JSON data: dataclasses with the name of their type, arrays and meshes by their digests."""
    if type(value) in PLAIN:  # most of what a scene is made of
        return value
    if isinstance(value, Mesh):
        return ["Mesh", value.digest, value.file]
    if isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        return ["array", array.dtype.str, list(np.shape(value)), hashlib.sha256(array.tobytes()).hexdigest()]
    if is_dataclass(value) and not isinstance(value, type):
        return [type(value).__name__, {field.name: exact(getattr(value, field.name)) for field in fields(value)}]
    if isinstance(value, Mapping):
        return {str(key): exact(item) for key, item in value.items()}
    if isinstance(value, set | frozenset):
        return sorted(map(str, value))
    if isinstance(value, tuple | list):
        return [exact(item) for item in value]
    return value


def sources(*, tracer: bool) -> list[Path]:
    """Return rayproof's own files whose content may decide an answer: sources, and data that they read."""
    packages = ("cases", "reference", "reports", *(["tracer"] if tracer else []))
    files = (file for package in packages for file in (ROOT / package).rglob("*"))
    return sorted(file for file in files if file.suffix in (".py", ".json", ".ply"))


@cache
def code(*, tracer: bool = False) -> str:
    """Return rayproof's version and the SHA-256 of its sources: whatever changes there may change an answer.

    Without `tracer` its sources are left out: no reference can import them, and a verdict is only taken up again for
    answers of the tracer that are equal to the last bit.
    """
    content = hashlib.sha256()
    for file in sources(tracer=tracer):
        content.update(file.relative_to(ROOT).as_posix().encode() + b"\0")
        content.update(hashlib.sha256(file.read_bytes()).digest())
    return f"rayproof {version('rayproof')} {content.hexdigest()}"


@cache
def _installed(package: str) -> str:
    return f"{package} {version(package)}"


@cache
def machine(packages: Sequence[str] = PACKAGES) -> tuple[str, ...]:
    """Return what beside code and data decides an answer's last bits: packages, interpreter, processor, compiler."""
    installed = [_installed(package) for package in packages]
    chosen = [os.environ.get(name, "") for name in ("DRJIT_LIBLLVM_PATH", "RAYPROOF_BACKEND")]
    return (*installed, platform.python_version(), *processor(), *chosen)


@cache
def processor() -> tuple[str, str, str]:
    """Return the architecture, the model, and the features by which compilers choose instructions.

    A JIT compiles for the processor that it finds, so that another one may round another way. Its model and its
    features are those that Linux tells, of which LLVM makes its target; elsewhere what Python knows must do.
    """
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.machine(), platform.processor(), ""
    told: dict[str, str] = {}
    for line in text.split("\n\n")[0].splitlines():
        name, _, value = line.partition(":")
        told[name.strip()] = value.strip()
    model = " ".join(told[name] for name in _MODEL if name in told)
    features = (told.get("flags") or told.get("Features") or "").split()
    return platform.machine(), model, " ".join(sorted(one for one in features if _COMPUTES.match(one)))
