"""References' earlier answers by content: keys (scene, renderer, version, settings, code), recalling and keeping.

Only references are here: what the renderer under test answers always comes from itself. A key is everything that an
answer depends on, as a dataclass with a field for each: a change of any field is another question. Another kind of
answer needs a `Key` of its own. Every read is checked, which takes about as long as a SHA-256 over the entry.
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

# Whose numbers are in an answer or a verdict.
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
# In /proc/cpuinfo: what makes the processor's model, and which of its features compute. The rest, such as those against
# leaks, depends on the kernel.
_MODEL = ("vendor_id", "cpu family", "model", "CPU implementer", "CPU architecture", "CPU variant", "CPU part")
_COMPUTES = re.compile(r"(sse|ssse|avx|fma|f16c|bmi|amx|abm|popcnt|movbe|adx|gfni|vaes|fp|asimd|sve|sme|bf16|i8mm)")


@dataclass(frozen=True, kw_only=True)
class Key:
    """All that one kind of kept answer depends on, field by field: a change of any is another question."""

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


# Reading is checking too: about as fast as a processor sums a SHA-256, and a file must be opened.
READING = 2e8  # bytes/s
OPENING = 2e-3  # s


@dataclass(frozen=True, kw_only=True)
class Rendered:
    """A reference's images, and where they come from."""

    answers: StageImages
    mean: np.ndarray | None  # radiance over a case's samples
    cached: bool
    notes: tuple[str, ...] = ()  # what went wrong with the cache, in sentences


@dataclass(frozen=True, kw_only=True)
class RenderKey(Key):
    """A reference's images of a scene."""

    kind: str  # "render"
    name: str
    version: str
    scene: Scene
    settings: Mapping[str, str]
    stages: tuple[Stage, ...]
    samples: int  # over so many a side of a pixel a mean is taken


@dataclass(frozen=True, kw_only=True)
class ReferenceQuestion:
    """What a reference is asked: the stages of a scene, and over how many samples a pixel's mean is taken."""

    name: str
    reference: Reference
    scene: Scene
    stages: tuple[Stage, ...]
    samples: int

    @cached_property
    def key(self) -> RenderKey:
        """Return all that an answer depends on."""
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
    """Return what was answered to the same question before, or None.

    Raises:
        DamagedEntryError: the entry is not what was written; it is gone.

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
    """Return what `render` returned for the same question before, or now.

    An entry that is not what was written is removed, rendered anew and told of. A cache that cannot be written costs
    a note and nothing else. What costs less to render than to read is not kept, unless `always`.
    """
    store = store or usual_store()
    notes: tuple[str, ...] = ()
    try:
        found = recalled(question, store)
        if found is not None:
            return found
    except DamagedEntryError as wrong:
        notes = (damage(wrong),)
    start = time.perf_counter()
    answers, mean = render()
    seconds = math.inf if always else time.perf_counter() - start
    arrays = _arrays(answers) | ({} if mean is None else {"mean": np.asarray(mean)})
    notes += _keep(store, question.key, _seen(question.key, seconds), arrays, seconds)
    return Rendered(answers=answers, mean=mean, cached=False, notes=notes)


def damage(wrong: DamagedEntryError) -> str:
    """Return what a case's notes say of a kept render that was damaged."""
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
    """Return what a listing tells of an entry."""
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
    found: dict[str, np.ndarray] = {}
    for stage, image in answers.items():
        if stage is Stage.CAMERA:
            found |= {f"{stage.value}.{part}": np.asarray(array) for part, array in image.items()}
        else:
            found[stage.value] = np.asarray(image)
    return found


def _answers(arrays: dict[str, np.ndarray]) -> StageImages:
    answers: StageImages = {}
    for name, array in arrays.items():
        stage, _, part = name.partition(".")
        if part:
            answers.setdefault(Stage(stage), {})[part] = array
        elif name != "mean":
            answers[Stage(stage)] = array
    return answers
