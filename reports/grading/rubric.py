"""The rubric in TOML: points of items, cases, how submissions are built and run, limits.

It is TOML (toml.io, version 1.0), checked as a whole before anything is built.
"""

import hashlib
import random
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import msgspec

from rayproof.cases.case import ITEMS_OF_OTHERS, STORING, Case
from rayproof.cases.families import select
from rayproof.cases.random_scenes import FAMILY, LARGEST, random_case
from rayproof.reports.results.outcomes import TITLES
from rayproof.reports.subjects.protocol import Capabilities

GRADED = tuple(item for item in TITLES if item in ITEMS_OF_OTHERS or item == STORING)
# Of a second way nobody knows whether a program takes it: what it does wrong counts as the first way's.
FIRST_WAYS: Mapping[str, str] = {
    "CAM-5": "CAM-4",
    "HIT-6": "HIT-5",
    "HIT-8": "HIT-7",
    **dict.fromkeys(("LIT-2", "LIT-3", "LIT-4", "LIT-5"), "LIT-1"),
}
# What a program may declare, as the rubric calls it, and the capabilities that this is.
DECLARABLE: Mapping[str, tuple[str, ...]] = {
    "shapes": ("shapes", "triangulated"),
    "scenes": ("shading", "clip", "two_sided", "affine"),
    "stages": ("stages",),
    "deterministic": ("deterministic",),
    "chained": ("chained",),
    "world_normals": ("world_normals",),
}
MOST_POINTS, MOST_CASES = 1000.0, 1000


class Program(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """How a submission is built and run, as the rubric's [program] or a submission's own rayproof.toml has it."""

    run: str  # with {scene} and {output}; run in the submission's folder
    build: str = ""  # a shell's line; nothing is built without one
    own: bool = False  # a submission's rayproof.toml may say otherwise


class CasesTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """Which cases are asked: families, cases and patterns, and how many random scenes of a seed."""

    visible: list[str]
    hidden: list[str] = []
    random: int = 0
    seed: int = 0


class LimitsTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The limits of one call, in total."""

    seconds: float = 10.0  # of processor time
    build_seconds: float = 120.0
    memory: float = 2.0  # GiB
    disk: float = 256.0  # MiB
    processes: int = 64


class ReadableTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The folders and variables that a submission can read beside its own."""

    folders: list[str] = []  # toolchains and libraries beyond /usr
    environment: dict[str, str] = {}


class DeclaredTable(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The declarations of a program that count."""

    allowed: list[str] = []
    epsilon: float = 1e-3  # m, at most


class RubricFile(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file as it is written."""

    title: str
    points: dict[str, float]
    program: Program
    cases: CasesTable
    limits: LimitsTable = LimitsTable()
    readable: ReadableTable = ReadableTable()
    declared: DeclaredTable = DeclaredTable()


@dataclass(frozen=True, kw_only=True)
class Rubric:
    """A checked rubric."""

    file: RubricFile
    path: Path
    digest: str
    cases: tuple[Case, ...]  # visible ones by their names, hidden ones by fresh ones, in no order that they had
    hidden: frozenset[str] = field(default_factory=frozenset)  # names of the hidden ones

    @property
    def points(self) -> dict[str, float]:
        """Return the points of each item, in the specification's order."""
        return {item: self.file.points[item] for item in GRADED if item in self.file.points}

    def believed(self, declared: Capabilities) -> Capabilities:
        """Return what a program declares as far as this rubric allows it, and the usual where it does not."""
        rules, usual = self.file.declared, Capabilities()
        refused = [name for word, names in DECLARABLE.items() if word not in rules.allowed for name in names]
        kept = replace(declared, **{name: getattr(usual, name) for name in refused})
        shadow, ray = (min(length, rules.epsilon) for length in (declared.shadow_epsilon, declared.ray_epsilon))
        return replace(kept, shadow_epsilon=shadow, ray_epsilon=ray)


def graded_items(items: Sequence[str]) -> tuple[str, ...]:
    """Return the items that points are given for among some, in their order: first ways instead of second ones."""
    return tuple(dict.fromkeys(FIRST_WAYS.get(item, item) for item in items))


def load_rubric(path: Path) -> Rubric:
    """Return the rubric that a file holds.

    Raises:
        ValueError: it is no rubric; one line says where and why.
        LookupError: a case or an item is not known.
        OSError: it cannot be read.

    """
    content = path.read_bytes()
    try:
        file = msgspec.convert(tomllib.loads(content.decode()), RubricFile)
    except (ValueError, msgspec.ValidationError) as error:
        raise ValueError(f"{path}: {error}") from None
    for item, points in file.points.items():
        if item in FIRST_WAYS:
            raise LookupError(f"{path}: points of {item}: it is a second way; give points to {FIRST_WAYS[item]}")
        if item not in GRADED:
            raise LookupError(f"{path}: points of {item!r}: no item is called so; known: {', '.join(GRADED)}")
        if not 0 <= points <= MOST_POINTS:
            raise ValueError(f"{path}: points of {item} must be from 0 to {MOST_POINTS:g}, got {points}")
    if not any(file.points.values()):
        raise ValueError(f"{path}: no item has points")
    for name in file.declared.allowed:
        if name not in DECLARABLE:
            raise LookupError(f"{path}: declared.allowed: {name!r} is not known; known: {', '.join(DECLARABLE)}")
    _check_numbers(path, file)
    check_program(str(path), file.program)
    return _with_cases(path, file, hashlib.sha256(content).hexdigest())


def _check_numbers(path: Path, file: RubricFile) -> None:
    limits = file.limits
    for name in ("seconds", "build_seconds", "memory", "disk", "processes"):
        if not 0 < getattr(limits, name) < 1e6:
            raise ValueError(f"{path}: limits.{name} must be positive and below 1e6, got {getattr(limits, name)}")
    if not 0 <= file.declared.epsilon <= 1:
        raise ValueError(f"{path}: declared.epsilon must be from 0 to 1 m, got {file.declared.epsilon}")
    if not (0 <= file.cases.random <= MOST_CASES and 0 <= file.cases.seed <= LARGEST):
        raise ValueError(f"{path}: cases.random must be from 0 to {MOST_CASES}, and cases.seed from 0 to {LARGEST}")
    for folder in file.readable.folders:
        if not Path(folder).is_absolute() or not Path(folder).exists():
            raise ValueError(f"{path}: readable.folders: {folder!r} is no absolute path of something")


def check_program(where: str, program: Program) -> None:
    """Raise ValueError if a command to run does not name its scene and image."""
    if "{scene}" not in program.run or not ("{output}" in program.run or "{output.pfm}" in program.run):
        raise ValueError(f"{where}: run must hold {{scene}} and {{output}} or {{output.pfm}}, got {program.run!r}")


def _with_cases(path: Path, file: RubricFile, digest: str) -> Rubric:
    table = file.cases
    if any(pattern.startswith(f"{FAMILY}/") for pattern in table.visible):
        raise ValueError(f"{path}: cases.visible: random scenes are hidden ones; their number is cases.random")
    if not table.visible:
        raise ValueError(f"{path}: cases.visible must name a case")
    visible = select(table.visible)
    hidden = select(table.hidden) if table.hidden else ()
    secret = [*hidden, *(random_case(table.seed, k) for k in range(table.random))]
    seen = {case.name for case in visible}
    fresh = {_fresh(table.seed, case.name): case for case in secret if case.name not in seen}
    cases = [*visible, *(replace(case, name=name) for name, case in fresh.items())]
    random.Random(f"order {table.seed} {digest}").shuffle(cases)
    covered = {item for case in cases for item in covered_items(case)}
    for item, points in file.points.items():
        if points and item not in covered:
            raise ValueError(f"{path}: {item} has points, and no case asks for it")
    return Rubric(file=file, path=path, digest=digest, cases=tuple(cases), hidden=frozenset(fresh))


def covered_items(case: Case) -> tuple[str, ...]:
    """Return the items with points that a case asks for: how its image is stored is part of every case."""
    return (*graded_items(case.covers), STORING)


def _fresh(seed: int, name: str) -> str:
    """Return the name of a hidden case, of which nothing can be known but by the seed."""
    return f"hidden-{hashlib.sha256(f'{seed} {name}'.encode()).hexdigest()[:10]}/scene"


def starter(seed: int) -> str:
    """Return the text of a rubric to begin with."""
    return Path(__file__).with_name("starter.toml").read_text(encoding="utf-8").replace("@SEED@", str(seed))
