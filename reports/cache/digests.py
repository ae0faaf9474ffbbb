"""Questions as digests: scenes and other data, the code that answers, and the packages and processor beneath it."""

import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.scene import Mesh
from rayproof.reports.cache.closure import ROOT, closure

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


@dataclass(frozen=True, kw_only=True)
class Key:
    """All that one kind of kept answer depends on, field by field: a change of any is another question.

    The harness's guards (`reports/run/guards/keys.py`) change one field after another and see another digest.
    """

    code: str
    machine: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Return the name under which the answer is kept."""
        return digest(exact(self))


def digest(content: Any) -> str:
    """Return the SHA-256 of JSON data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def exact(value: Any) -> Any:
    """Return data as JSON data: dataclasses with the name of their type, arrays and meshes by their digests."""
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


@cache
def _content(file: Path) -> bytes:
    return file.relative_to(ROOT).as_posix().encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest()


@cache
def code(modules: Sequence[str], *, without: Sequence[str] = ()) -> str:
    """Return the SHA-256 of all files of ours that `modules` depend on, those in packages `without` left out.

    Raises:
        LookupError: there is no such module.

    """
    content = hashlib.sha256()
    for file in closure(modules, without=without):
        content.update(_content(file))
    return content.hexdigest()


@cache
def _installed(package: str) -> str:
    return f"{package} {version(package)}"


@cache
def machine(packages: Sequence[str] = PACKAGES) -> tuple[str, ...]:
    """Return what beside code and data decides an answer's last bits: packages, interpreter, processor, compiler."""
    installed = [_installed(package) for package in packages]
    chosen = [os.environ.get(name, "") for name in ("DRJIT_LIBLLVM_PATH", "RAYPROOF_BACKEND")]
    return (*installed, platform.python_version(), platform.machine(), *chosen)
