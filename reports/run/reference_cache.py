"""The cache of references' answers: keys (scene, renderer, version, settings, code), reading and writing.

Only references have cached answers; the renderer under test always renders. A key is a dataclass with a field for
everything that an answer depends on: a change of any field makes another key. Another kind of answer needs a `Key` of
its own. Every read is checked, which takes about as long as a SHA-256 over the entry.
"""

import hashlib
import json
import math
import os
import platform
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from rayproof import ROOT
from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Reference, Stage, StageImages
from rayproof.reports.run.cache_store import About, DamagedEntryError, Entry, Store, usual_store

# Packages that compute numbers of an answer or a verdict.
PACKAGES = (
    "drjit",
    "mitsuba",
    "numpy",
    "openexr",
    "pyradiance",
    "python-flint",
    "scikit-image",
    "scipy",
    "trimesh",
)
# In /proc/cpuinfo: the parts of the processor's model, and its features for computation. The other features, such as
# protections against leaks, depend on the kernel.
_MODEL = ("vendor_id", "cpu family", "model", "CPU implementer", "CPU architecture", "CPU variant", "CPU part")
_COMPUTES = re.compile(r"(sse|ssse|avx|fma|f16c|bmi|amx|abm|popcnt|movbe|adx|gfni|vaes|fp|asimd|sve|sme|bf16|i8mm)")


@dataclass(frozen=True, kw_only=True)
class Key:
    """Everything that one kind of cached answer depends on, field by field: a change of any makes another key."""

    code: str
    machine: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Return the name under which the answer is stored."""
        return digest(exact(self))


PLAIN = frozenset({str, int, float, bool, type(None)})


def digest(content: Any) -> str:
    """Return the SHA-256 of JSON data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def exact(value: Any) -> Any:
    """Return data as JSON data: dataclasses with the name of their type, arrays and meshes by their digests."""
    if type(value) in PLAIN:  # most parts of a scene
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

    Without `tracer` the tracer's sources are left out: no reference can import them, and a verdict is only reused if
    the tracer's answers are bit-identical.
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
    """Return the facts of this machine that decide an answer's last bits: packages, Python, processor, compiler."""
    installed = [_installed(package) for package in packages]
    chosen = [os.environ.get(name, "") for name in ("DRJIT_LIBLLVM_PATH", "RAYPROOF_BACKEND")]
    return (*installed, platform.python_version(), *processor(), *chosen)


@cache
def processor() -> tuple[str, str, str]:
    """Return the architecture, the model, and the features that decide which instructions compilers choose.

    A JIT compiles for the processor on which it runs, so that another processor may round differently. Model and
    features are read from Linux, like LLVM's own target; elsewhere Python's description of the processor is used.
    """
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.machine(), platform.processor(), ""
    values: dict[str, str] = {}
    for line in text.split("\n\n")[0].splitlines():
        name, _, value = line.partition(":")
        values[name.strip()] = value.strip()
    model = " ".join(values[name] for name in _MODEL if name in values)
    features = (values.get("flags") or values.get("Features") or "").split()
    return platform.machine(), model, " ".join(sorted(feature for feature in features if _COMPUTES.match(feature)))


# Reading includes the check, which is about as fast as a SHA-256, and opening a file.
READING = 2e8  # bytes/s
OPENING = 2e-3  # s


@dataclass(frozen=True, kw_only=True)
class Rendered:
    """A reference's images, and whether they are cached."""

    answers: StageImages
    mean: np.ndarray | None  # radiance over a case's samples
    cached: bool
    notes: tuple[str, ...] = ()  # problems with the cache, in sentences


@dataclass(frozen=True, kw_only=True)
class RenderKey(Key):
    """The key of a reference's images of a scene."""

    kind: str  # "render"
    name: str
    version: str
    scene: Scene
    settings: Mapping[str, str]
    stages: tuple[Stage, ...]
    samples: int  # per side of a pixel, for the mean


@dataclass(frozen=True, kw_only=True)
class ReferenceQuestion:
    """A request to a reference: the stages of a scene, and the samples per side of a pixel for the mean."""

    name: str
    reference: Reference
    scene: Scene
    stages: tuple[Stage, ...]
    samples: int

    @cached_property
    def key(self) -> RenderKey:
        """Return the key of the answer."""
        settings = getattr(self.reference, "settings", None)
        return RenderKey(
            kind="render",
            name=self.name,
            version=self.reference.version(),
            scene=self.scene,
            settings=dict(settings(self.scene)) if settings is not None else {},
            stages=self.stages,
            samples=self.samples,
            code=code(),
            machine=machine(),
        )


def recalled(question: ReferenceQuestion, store: Store | None = None) -> Rendered | None:
    """Return the cached answer to a request, or None.

    Raises:
        DamagedEntryError: the entry differs from the written one; it has been removed.

    """
    return (store or usual_store()).read(question.key.digest, _rendered)


def _rendered(entry: Entry) -> Rendered:
    return Rendered(answers=_answers(entry[1]), mean=entry[1].get("mean"), cached=True)


def cached(
    question: ReferenceQuestion,
    render: Callable[[], tuple[StageImages, np.ndarray | None]],
    *,
    store: Store | None = None,
    always: bool = False,
) -> Rendered:
    """Return the cached answer to a request, or the answer of `render`, which is then stored.

    A damaged entry is removed, rendered again and reported in a note. A cache that cannot be written only adds a note.
    An answer that takes less time to render than to read is not stored, unless `always`.
    """
    store = store or usual_store()
    notes: tuple[str, ...] = ()
    try:
        stored = recalled(question, store)
        if stored is not None:
            return stored
    except DamagedEntryError as wrong:
        notes = (damage(wrong),)
    start = time.perf_counter()
    answers, mean = render()
    seconds = math.inf if always else time.perf_counter() - start
    arrays = _arrays(answers) | ({} if mean is None else {"mean": np.asarray(mean)})
    notes += _keep(store, question.key, _seen(question.key, seconds), arrays, seconds)
    return Rendered(answers=answers, mean=mean, cached=False, notes=notes)


def damage(wrong: DamagedEntryError) -> str:
    """Return a case's note about a cached render that was damaged."""
    return f"A kept render was damaged ({wrong}) and was rendered anew."


def _keep(store: Store, key: RenderKey, about: About, arrays: dict[str, np.ndarray], seconds: float) -> tuple[str, ...]:
    """Write an entry if reading it is cheaper than rendering it again; return a sentence if it cannot be written."""
    if seconds <= OPENING + sum(array.nbytes for array in arrays.values()) / READING:
        return ()
    try:
        store.put(key.digest, about, arrays)
    except OSError as wrong:
        return (f"Its render could not be kept in {store.folder}: {wrong.strerror or wrong}.",)
    return ()


def _seen(key: RenderKey, seconds: float) -> About:
    """Return the description of an entry, for listings."""
    scene = key.scene
    return {
        "kind": key.kind,
        "reference": key.name,
        "version": key.version,
        "settings": dict(key.settings),
        "stages": [stage.value for stage in key.stages],
        "samples": key.samples,
        "size": [scene.camera.width, scene.camera.height],
        "shapes": len(scene.shapes),
        "lights": len(scene.lights),
        "seconds": round(seconds, 4) if math.isfinite(seconds) else 0.0,
    }


def _arrays(answers: StageImages) -> dict[str, np.ndarray]:
    """Return answers as named arrays; the camera stage is a dictionary of them."""
    arrays: dict[str, np.ndarray] = {}
    for stage, image in answers.items():
        if stage is Stage.CAMERA:
            arrays |= {f"{stage.value}.{part}": np.asarray(array) for part, array in image.items()}
        else:
            arrays[stage.value] = np.asarray(image)
    return arrays


def _answers(arrays: dict[str, np.ndarray]) -> StageImages:
    answers: StageImages = {}
    for name, array in arrays.items():
        stage, _, part = name.partition(".")
        if part:
            answers.setdefault(Stage(stage), {})[part] = array
        elif name != "mean":
            answers[Stage(stage)] = array
    return answers
