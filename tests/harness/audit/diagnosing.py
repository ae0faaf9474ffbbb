"""How many mistakes are named rightly, and how many wrongly, on a C++ program that shares no code with the tracer.

The program, examples/renderers/mistaken.cpp, makes each of its mistakes on request, or several. Some of them are in no
list, so that a fit has to find them. Some have no hypothesis, on purpose: whatever is said of these is a wrong name.
"""

import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatch
from functools import cache
from itertools import combinations
from multiprocessing import get_context
from pathlib import Path
from typing import TypedDict

import numpy as np

from rayproof import ROOT
from rayproof.cases.case import Case
from rayproof.cases.families import all_cases
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.diagnosis.diagnosing import LARGEST, causes_of, faces
from rayproof.reports.diagnosis.evidence import Evidence
from rayproof.reports.results.images import read_answers
from rayproof.reports.subjects.protocol import hand_over

SOURCE = ROOT / "examples" / "renderers" / "mistaken.cpp"
EPSILON = 1e-7  # m: the program's shadow epsilon, as it declares it
KNOWN, FITTED = "H", "F"  # what the program calls a mistake that has a hypothesis, and one that a fit finds
# What the program calls otherwise than the catalogue, and other names of the same images.
CALLED: Mapping[str, tuple[str, ...]] = {
    "offset_5cm": ("shadow_ray_offset",),
    "offset_2cm": ("shadow_ray_offset",),
    "cosine_power_1_5": ("cosine_power",),
    "gamma_2_2": ("gamma",),
    "gamma_1_8": ("gamma",),
    "factor_1_3": ("factor_of_radiance", "factor_of_exitance", "factor_of_irradiance"),
    "radiance_mirrored": ("stages_mirrored",),
    "radiance_upside_down": ("stages_upside_down",),
    "height_for_stride": ("row_stride",),
    "rows_padded": ("row_stride",),
    "one_pixel_late": ("one_place_off",),
    "strip_undrawn": ("undrawn",),
    "rows_left_over": ("undrawn",),
    "tiles_undrawn": ("undrawn",),
    "wrapped_bytes": ("wrapped", "too_few_bits"),  # of what does not wrap, bytes alone are left
    "range_window": ("light_range_1",),
    "fixed_fov": ("one_fov",),
    "quarter_pixel": ("sample_position",),
    "facing_mixed": ("side_by_local_normal",),
    "facing_by_object_ray": ("side_by_local_ray",),
    "mirrored_two_sided": ("mirrored_turned_away",),
    "within_20m": ("within",),
    "exponential_falloff": ("absorption",),
}
# By radiance alone, or in some scenes, these are one and the same image: each is named rightly by another's name.
SAME: Mapping[str, tuple[str, ...]] = {
    "radiance_mirrored": ("image_mirrored", "left_handed"),
    "radiance_upside_down": ("upside_down",),
    "left_handed": ("image_mirrored",),
    "image_mirrored": ("left_handed",),
    "square_doubled": ("square_halved",),
    "srgb_albedo": ("albedo_power",),
}
STAGED, ALONE = "all stages", "radiance alone"
KNOWN_ONE, KNOWN_NONE = "a mistake that has a hypothesis", "a mistake that has none"
KNOWN_FIT = "a mistake that a fit finds"
TWO = "two mistakes at once"


@dataclass(frozen=True, kw_only=True)
class Renderer:
    """One that is measured: the program with some of its switches."""

    kind: str  # KNOWN_ONE, KNOWN_FIT, KNOWN_NONE or TWO
    mistakes: tuple[str, ...]  # switches
    accepted: tuple[frozenset[str], ...]  # of each mistake that the catalogue has, the names that are right
    program: Path

    @property
    def name(self) -> str:
        """Return its mistakes, or an empty text."""
        return "+".join(self.mistakes)

    def answers(self, case: Case, folder: Path) -> StageImages:
        """Return what it answers to a case."""
        return rendered(self.program, self.mistakes, case, folder)

    def alone(self) -> "list[Renderer]":
        """Return those that make one of its several mistakes."""
        each = zip(self.mistakes, self.accepted, strict=True) if len(self.mistakes) > 1 else ()
        return [replace(self, mistakes=(name,), accepted=(names,)) for name, names in each]

    def slandered(self, found: Sequence[tuple[str, ...]]) -> bool:
        """Say whether a cause that was found, with its alternatives, is nothing that it does."""
        return any(not any(set(names) & right for right in self.accepted) for names in found)

    def told(self, found: Sequence[tuple[str, ...]]) -> bool:
        """Say whether the causes that were found, each with alternatives, are what it does, and no more."""
        named = {name for names in found for name in names}
        every = all(named & right for right in self.accepted)
        return bool(self.accepted and named) and every and not self.slandered(found)


class OutcomeRecord(TypedDict):
    """What was said of one program, as an `Outcome` has it."""

    programs: str
    mistake: str
    written: str
    failing: int
    named: tuple[str, ...]
    right: bool
    wrong: bool
    seconds: float


class Figures(TypedDict):
    """How many programs of a kind were named right, named wrong and not named."""

    programs: str
    written: str
    of: int
    right: int
    class_of_at_most_2: int
    wrong: int
    does_not_know: int
    unseen: int


class MeasuredDiagnosis(TypedDict):
    """What one run of this module prints."""

    table: list[Figures]
    seed: int
    wrong_names: list[OutcomeRecord]
    without_a_switch: list[OutcomeRecord]
    programs: list[OutcomeRecord]
    slowest: float
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What was said of one program."""

    programs: str  # KNOWN_ONE, KNOWN_FIT, KNOWN_NONE or TWO
    mistake: str
    written: str  # STAGED or ALONE
    failing: int  # cases that it fails by its pixels; 0 where two mistakes show no more than one of them
    named: tuple[str, ...]  # the class of mistakes that was named
    right: bool  # all that it does is named, and no more
    wrong: bool  # something that it does not is named; one of two mistakes alone is neither
    seconds: float

    def as_json(self) -> OutcomeRecord:
        """Return plain JSON data."""
        return OutcomeRecord(**asdict(self))


def compiler() -> str | None:
    """Return a C++ compiler, or None."""
    return shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")


def built(folder: Path) -> Path:
    """Compile the switched program into a folder and return it; raise OSError or CalledProcessError if that fails."""
    command = compiler()
    if command is None:
        raise FileNotFoundError("no C++ compiler (c++, g++ or clang++) is on the PATH")
    if not SOURCE.is_file():
        raise FileNotFoundError(f"{SOURCE} is not there: --diagnose needs a checkout of rayproof")
    program = folder / "mistaken"
    subprocess.run(
        [command, "-O2", "-std=c++17", "-o", str(program), str(SOURCE)], check=True, capture_output=True, timeout=300
    )
    return program


def listed(program: Path) -> list[tuple[str, str]]:
    """Return every mistake that the program makes, and of which kind it is."""
    said = subprocess.run([str(program), "--mistakes"], check=True, capture_output=True, text=True, timeout=20).stdout
    rows = [line.split("\t") for line in said.splitlines()]
    kinds = {KNOWN: KNOWN_ONE, FITTED: KNOWN_FIT}
    return [(name, kinds.get(known, KNOWN_NONE)) for name, known, _ in rows]


def usable_cases() -> list[Case]:
    """Return the suite's cases that evidence may come from: one sample a pixel, and not too many faces."""
    return [case for case in all_cases() if case.samples == 1 and faces(case.scene) <= LARGEST]


@cache
def _asked(names: tuple[str, ...]) -> tuple[Case, ...]:
    """Return the cases that patterns name; all without a pattern."""
    return tuple(case for case in usable_cases() if not names or any(fnmatch(case.name, name) for name in names))


def rendered(program: Path, mistakes: Sequence[str], case: Case, folder: Path) -> StageImages:
    """Return what the program answers to a case with some mistakes."""
    where = folder / case.name.replace("/", "-")
    scene = where / "scene.json"
    if not scene.exists():
        where.mkdir(parents=True, exist_ok=True)
        scene = hand_over(case.scene, where)
    image = where / "image.exr"
    words = ["--mistake", ",".join(mistakes)] if mistakes else []
    subprocess.run([str(program), *words, str(scene), str(image)], check=True, capture_output=True, timeout=120)
    with np.errstate(invalid="ignore"):  # what a damaged image holds may be no number at all
        return {stage: np.asarray(value, dtype=np.float64) for stage, value in read_answers(image).items()}


def evidence_of(renderer: Renderer, folder: Path, names: Sequence[str]) -> dict[str, list[Evidence]]:
    """Return what a renderer shows, with all its stages and with radiance alone."""
    found: dict[str, list[Evidence]] = {STAGED: [], ALONE: []}
    for case in _asked(tuple(names)):
        answers = renderer.answers(case, folder)
        for written in (STAGED, ALONE):
            ours = answers if written == STAGED else {s: i for s, i in answers.items() if s is Stage.RADIANCE}
            if ours:
                found[written].append(evidence(case, ours))
    return found


def evidence(case: Case, ours: StageImages) -> Evidence:
    """Return what images of a case show, and whether they fail."""
    one = Evidence(case=case.name, scene=case.scene, load=lambda: ours, failed=False, shadow_epsilon=EPSILON)
    one.failed = bool(one.wrong.any())
    return one


def outcomes(renderer: Renderer, folder: Path, names: Sequence[str]) -> list[Outcome]:
    """Return what is said of a renderer, twice."""
    found = []
    shown = shows_more(renderer, folder, names)
    for written, cases in evidence_of(renderer, folder, names).items():
        if not shown[written]:
            cases = []
        start = time.process_time()
        findings, searched = causes_of(cases)
        # Noise is no formula's name: what scatters at random does so whatever it is called.
        named = [(finding.name,) for finding in findings if finding.name != "noise"]
        for cause in searched.causes:
            others = [name for one in cause.alternatives for name in one.name.split("+")]
            named += [(part.name, *others) for part in cause.mistake.parts or (cause.mistake,)]
        found.append(
            Outcome(
                programs=renderer.kind,
                mistake=renderer.name,
                written=written,
                failing=sum(one.failed for one in cases),
                named=tuple("/".join(dict.fromkeys(names)) for names in named),
                right=renderer.told(named),
                wrong=renderer.slandered(named),
                seconds=round(time.process_time() - start, 2),
            )
        )
    return found


def shows_more(renderer: Renderer, folder: Path, names: Sequence[str]) -> dict[str, bool]:
    """Say, by what is written, whether all mistakes of a renderer show something else than any of them alone."""
    found: dict[str, bool] = {STAGED: True, ALONE: True}
    for one in renderer.alone():
        apart = set()
        for case in _asked(tuple(names)):
            ours, theirs = renderer.answers(case, folder), one.answers(case, folder)
            apart |= {stage for stage in ours if not np.array_equal(ours[stage], theirs[stage], equal_nan=True)}
        found = {STAGED: found[STAGED] and bool(apart), ALONE: found[ALONE] and Stage.RADIANCE in apart}
    return found


def _job(arguments: tuple[Renderer, Path, tuple[str, ...]]) -> list[Outcome]:
    renderer, folder, names = arguments
    with tempfile.TemporaryDirectory(dir=folder) as place:
        return outcomes(renderer, Path(place), names)


def switched(program: Path) -> list[Renderer]:
    """Return the program without a switch, and with each."""
    found = [Renderer(kind=KNOWN_NONE, mistakes=(), accepted=(), program=program)]
    for name, kind in listed(program):
        names = frozenset({name, *CALLED.get(name, ()), *SAME.get(name, ())})
        right = (names,) if kind != KNOWN_NONE else ()
        found.append(Renderer(kind=kind, mistakes=(name,), accepted=right, program=program))
    return found


def drawn_pairs(program: Path, count: int, seed: int) -> list[Renderer]:
    """Return the program with two switches that have a hypothesis, so many pairs drawn at random."""
    ones = [one for one in switched(program) if one.kind == KNOWN_ONE]
    pairs = random.Random(seed).sample(list(combinations(ones, 2)), count)
    return [
        replace(one, kind=TWO, mistakes=one.mistakes + two.mistakes, accepted=one.accepted + two.accepted)
        for one, two in pairs
    ]


def table(found: Sequence[Outcome]) -> list[Figures]:
    """Return the figures: named right, named wrong and not named, for each kind of renderers that was measured."""
    rows: list[Figures] = []
    for kind in (KNOWN_ONE, KNOWN_FIT, KNOWN_NONE, TWO):
        for written in (STAGED, ALONE):
            those = [one for one in found if one.programs == kind and one.written == written]
            if not those:
                continue
            here = [one for one in those if one.failing]
            right, wrong = sum(one.right for one in here), sum(one.wrong for one in here)
            rows.append(
                {
                    "programs": kind,
                    "written": written,
                    "of": len(here),
                    "right": right,
                    "class_of_at_most_2": sum(
                        one.right and all(name.count("/") <= 1 for name in one.named) for one in here
                    ),
                    "wrong": wrong,
                    "does_not_know": len(here) - right - wrong,
                    "unseen": len(those) - len(here),
                }
            )
    return rows


def said(one: Outcome) -> str:
    """Return an outcome in a line."""
    unknown = "in part" if one.named else "does not know" if one.failing else "not seen"
    verdict = "RIGHT" if one.right else "WRONG" if one.wrong else unknown
    named = ", ".join(one.named) or "nothing"
    return f"{one.mistake or 'no mistake'}, {one.written}: {verdict}, named {named}; {one.failing} cases fail"


def measure(
    *, jobs: int, quick: bool, only: str = "*", cases: str = "", pairs: int = 0, seed: int = 0
) -> MeasuredDiagnosis:
    """Return the figures over the switches that patterns with commas name; of one in eight of them if `quick`.

    Instead over so many `pairs` of switches, drawn by a seed; in the `cases` that patterns with commas name, or all.
    What is said of one is printed as soon as it is known.

    Raises:
        LookupError: no switch is called so.
        OSError: there is no compiler, or no source.
        subprocess.CalledProcessError: it does not compile, or the program fails.

    """
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        program = built(folder)
        wanted = only.split(",")
        asked = [one for one in switched(program) if any(fnmatch(one.name, name) for name in wanted)]
        if not asked:
            raise LookupError(f"no mistake of {SOURCE.name} is called {only!r}")
        if quick:
            asked = asked[::8]
        if pairs:
            asked = drawn_pairs(program, pairs, seed)
        names = tuple(filter(None, cases.split(",")))
        found: list[Outcome] = []
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            waiting = [pool.submit(_job, (renderer, folder, names)) for renderer in asked]
            for done in as_completed(waiting):
                found += done.result()
                for one in done.result():
                    print(f"{len(found) // 2} of {len(asked)}: {said(one)}", file=sys.stderr, flush=True)  # noqa: T201
    plain = [one for one in found if not one.mistake]
    found = sorted((one for one in found if one.mistake), key=lambda one: (one.mistake, one.written))
    return {
        "table": table(found),
        "seed": seed,
        "wrong_names": [one.as_json() for one in (*found, *plain) if one.wrong],
        "without_a_switch": [one.as_json() for one in plain],
        "programs": [one.as_json() for one in found],
        "slowest": max((one.seconds for one in found), default=0.0),
        "seconds": round(time.perf_counter() - start, 1),
    }
