"""Questions as digests: scenes and other data, the code that answers, and the packages and processor beneath it."""

import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from cases.scene import Mesh

ROOT = Path(__file__).resolve().parents[2]
SUFFIXES = (".py", ".json")  # of files that decide an answer


def digest(content: Any) -> str:
    """Return the SHA-256 of JSON data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def plain(value: Any) -> Any:
    """Return dataclasses as JSON data with the name of their type; a mesh by its digest."""
    if isinstance(value, Mesh):
        return ["Mesh", value.digest, value.file]
    if is_dataclass(value) and not isinstance(value, type):
        return [type(value).__name__, {field.name: plain(getattr(value, field.name)) for field in fields(value)}]
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    return value


def exact(value: Any) -> Any:
    """Return data that holds arrays as JSON data; an array by its type, its shape and the digest of its bytes."""
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
def _sources(place: str) -> tuple[bytes, ...]:
    """Return name and SHA-256 of each source file at or below a place, in an order that depends on names alone."""
    top = ROOT / place
    found = [top] if top.is_file() else []
    for folder, below, names in os.walk(top):
        below[:] = sorted(name for name in below if name != "__pycache__")
        found += [Path(folder, name) for name in sorted(names) if name.endswith(SUFFIXES)]
    told = []
    for path in found:
        content = hashlib.sha256(path.read_bytes()).digest()
        told.append(path.relative_to(ROOT).as_posix().encode() + b"\0" + content)
    return tuple(told)


@cache
def code(places: Sequence[str]) -> str:
    """Return the SHA-256 of the source files at or below `places`, relative to the project's root."""
    content = hashlib.sha256()
    for place in places:
        for file in _sources(place):
            content.update(file)
    return content.hexdigest()


@cache
def _installed(package: str) -> str:
    return f"{package} {version(package)}"


@cache
def machine(packages: Sequence[str]) -> list[str]:
    """Return what beside code and data decides an answer's last bits: packages, interpreter, processor, compiler."""
    installed = [_installed(package) for package in packages]
    chosen = [os.environ.get(name, "") for name in ("DRJIT_LIBLLVM_PATH", "RAYPROOF_BACKEND")]
    return [*installed, platform.python_version(), platform.machine(), *chosen]
