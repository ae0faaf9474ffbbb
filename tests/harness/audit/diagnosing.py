"""How many mistakes are named rightly, and how many wrongly, on a C++ program that shares no code with the tracer.

The program, examples/renderers/mistaken.cpp, makes each of its mistakes on request, or several. Some of them are in no
list, so that a fit has to find them. Some have no hypothesis, on purpose: whatever is said of these is a wrong name.
The tracer with one of its planted faults is measured by the same means.
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
from itertools import combinations, permutations
from multiprocessing import get_context
from pathlib import Path
from typing import TypedDict

import numpy as np

from rayproof import ROOT
from rayproof.cases.case import Case
from rayproof.cases.families import all_cases
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis.answering import Answered
from rayproof.reports.diagnosis.diagnosing import LARGEST, faces
from rayproof.reports.diagnosis.search import search
from rayproof.reports.diagnosis.trials import Evidence, undecided
from rayproof.reports.results.images import read_answers
from rayproof.reports.subjects.protocol import hand_over
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

SOURCE = ROOT / "examples" / "renderers" / "mistaken.cpp"
EPSILON = 1e-7  # m: the program's shadow epsilon, as it declares it
KNOWN, FITTED = "H", "F"  # what the program calls a mistake that has a hypothesis, and one that a fit finds
# What the program calls otherwise than the hypothesis that it should be told by.
CALLED: Mapping[str, str] = {
    "offset_5cm": "feeler_offset",
    "offset_2cm": "feeler_offset",
    "cubic_falloff": "falloff_exponent",
    "cosine_power_1_5": "cosine_power",
    "gamma_2_2": "gamma",
    "gamma_1_8": "gamma",
    "two_for_pi": "factor_of_radiance_physical",
    "pi_twice": "factor_of_radiance",
    "factor_1_3": "factor_of_radiance",
    "radiance_mirrored": "stages_mirrored",
    "radiance_upside_down": "stages_upside_down",
    "height_for_stride": "row_stride",
    "rows_padded": "row_stride",
    "one_pixel_late": "one_place_off",
    "strip_undrawn": "undrawn",
    "rows_left_over": "undrawn",
    "tiles_undrawn": "undrawn",
    "wrapped_bytes": "wrapped",
    "range_window": "light_range_1",
    **dict.fromkeys(
        (
            "linear_fov", "sine_fov", "fixed_fov", "diagonal_fov", "width_minus_one", "right_not_normalised",
            "quarter_pixel", "tilted",
        ),
        "another_camera",
    ),
    **dict.fromkeys(
        ("direction_by_normal_matrix", "rays_by_inverse_transpose"), "ray_by_another_matrix"
    ),
    "origin_untranslated": "no_translation",  # of all but triangles
    "normal_by_model_unnormalised": "normal_by_another_matrix",
    **dict.fromkeys(("facing_mixed", "facing_by_object_ray", "mirrored_two_sided"), "facing_in_another_space"),
    **dict.fromkeys(("last_face", "first_face", "farthest_face", "farthest_hit", "within_20m"), "another_hit"),
    **dict.fromkeys(
        ("clamped_distance", "one_plus_r", "attenuation", "exponential_falloff", "softened_falloff"),
        "curve_of_distance",
    ),
    **dict.fromkeys(("smooth_cosine", "wrapped_cosine"), "curve_of_cosine"),
    **dict.fromkeys(("srgb_albedo", "albedo_power"), "curve_of_albedo"),
    "root_of_lights": "curve_of_number",
}  # fmt: skip
# Mistakes of one and the same image: each is named rightly by the other's name.
SAME: Mapping[str, tuple[str, ...]] = {
    "no_pi": ("factor_of_radiance_physical", "factor_of_exitance_physical", "factor_of_irradiance_physical"),
    "pi_twice": ("factor_of_exitance", "factor_of_irradiance"),
    "two_for_pi": ("factor_of_exitance_physical", "factor_of_irradiance_physical"),
    "factor_1_3": ("factor_of_exitance", "factor_of_irradiance"),
    # By radiance alone, nobody sees that other stages are in their places.
    "radiance_mirrored": ("image_mirrored", "left_handed"),
    "radiance_upside_down": ("upside_down",),
}
STAGED, ALONE = "all stages", "radiance alone"
KNOWN_ONE, KNOWN_NONE = "a mistake that has a hypothesis", "a mistake that has none"
KNOWN_FIT = "a mistake that a fit finds"
TWO, PLANTED = "two mistakes at once", "a planted fault of the tracer"


@dataclass(frozen=True, kw_only=True)
class Renderer:
    """One that is measured: the program with some of its switches, or the tracer with one wrong formula."""

    kind: str  # KNOWN_ONE, KNOWN_FIT, KNOWN_NONE, TWO or PLANTED
    mistakes: tuple[str, ...]  # switches, or the formula
    accepted: tuple[frozenset[str], ...]  # of each mistake that has a hypothesis, the names that are right
    program: Path | None  # None: the tracer

    @property
    def name(self) -> str:
        """Return its mistakes, or an empty text."""
        return "+".join(self.mistakes)

    def answers(self, case: Case, folder: Path) -> StageImages:
        """Return what it answers to a case."""
        if self.program is not None:
            return rendered(self.program, self.mistakes, case, folder)
        from rayproof.reports.judge.oracle import stages_of
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        ((slot, variant),) = (name.split("/") for name in self.mistakes)
        stages = [stage for stage in stages_of(case.scene) if stage is not Stage.CAMERA]
        return render(case.scene, stages, Configuration(precision="float32", formulas={slot: variant}))

    def alone(self) -> "list[Renderer]":
        """Return those that make one of its several mistakes."""
        each = zip(self.mistakes, self.accepted, strict=True) if len(self.mistakes) > 1 else ()
        return [replace(self, mistakes=(name,), accepted=(names,)) for name, names in each]

    def told(self, found: Sequence[tuple[str, ...]]) -> bool:
        """Say whether one of the causes that were found, each of one mistake or two, is what it does."""
        return bool(self.accepted) and any(
            len(names) == len(self.accepted)
            and any(
                all(name in right for name, right in zip(order, self.accepted, strict=True))
                for order in permutations(names)
            )
            for names in found
        )


class OutcomeRecord(TypedDict):
    """What was said of one program, as an `Outcome` has it."""

    programs: str
    mistake: str
    written: str
    failing: int
    named: tuple[str, ...]
    right: bool
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

    programs: str  # KNOWN_ONE, KNOWN_FIT, KNOWN_NONE, TWO or PLANTED
    mistake: str
    written: str  # STAGED or ALONE
    failing: int  # cases that it fails by its pixels; 0 where two mistakes show no more than one of them
    named: tuple[str, ...]  # the class of mistakes that was named
    right: bool
    seconds: float

    @property
    def wrong(self) -> bool:
        """Say whether a wrong name was named."""
        return bool(self.named) and not self.right

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
def _grounds(names: tuple[str, ...]) -> dict[str, tuple[Case, np.ndarray, Answered]]:
    """Return what does not depend on who is judged, for each case of some names; once in a process."""
    choose_packaged_llvm()
    oracle, found = Analytic(), {}
    for case in usable_cases():
        if names and case.name not in names:
            continue
        mask = undecided(case.scene, oracle, shadow_epsilon=EPSILON)
        blank = Evidence(case=case.name, scene=case.scene, load=dict, failed=False, oracle=oracle, undecided=mask)
        found[case.name] = case, mask, blank.right
    return found


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
    oracle, found = Analytic(), {STAGED: [], ALONE: []}
    for case, mask, right in _grounds(tuple(names)).values():
        answers = renderer.answers(case, folder)
        for written in (STAGED, ALONE):
            ours = answers if written == STAGED else {s: i for s, i in answers.items() if s is Stage.RADIANCE}
            if ours:
                found[written].append(_evidence(case, ours, mask, right, oracle))
    return found


def _evidence(case: Case, ours: StageImages, mask: np.ndarray, right: Answered, oracle: Analytic) -> Evidence:
    def made(*, failed: bool) -> Evidence:
        one = Evidence(
            case=case.name, scene=case.scene, load=lambda: ours, failed=failed, oracle=oracle, undecided=mask
        )
        vars(one)["right"] = right  # a cached property: the same for every mistake
        return one

    return made(failed=bool(made(failed=False).wrong.any()))


def outcomes(renderer: Renderer, folder: Path, names: Sequence[str]) -> list[Outcome]:
    """Return what is said of a renderer, twice."""
    found = []
    shown = shows_more(renderer, folder, names)
    for written, evidence in evidence_of(renderer, folder, names).items():
        if not shown[written]:
            evidence = []
        failing = sum(one.failed for one in evidence)
        searched = search(evidence)
        named = tuple(dict.fromkeys(one.hypothesis.mistakes for one in searched.found))
        found.append(
            Outcome(
                programs=renderer.kind,
                mistake=renderer.name,
                written=written,
                failing=failing,
                named=tuple("+".join(names) for names in named),
                right=renderer.told(named),
                seconds=round(searched.seconds, 2),
            )
        )
    return found


def shows_more(renderer: Renderer, folder: Path, names: Sequence[str]) -> dict[str, bool]:
    """Say, by what is written, whether all mistakes of a renderer show something else than any of them alone."""
    found: dict[str, bool] = {STAGED: True, ALONE: True}
    for one in renderer.alone():
        apart = set()
        for case, _, _ in _grounds(tuple(names)).values():
            ours, theirs = renderer.answers(case, folder), one.answers(case, folder)
            apart |= {stage for stage in ours if not np.array_equal(ours[stage], theirs[stage], equal_nan=True)}
        found = {STAGED: found[STAGED] and bool(apart), ALONE: found[ALONE] and Stage.RADIANCE in apart}
    return found


def _job(arguments: tuple[Renderer, Path]) -> list[Outcome]:
    renderer, folder = arguments
    with tempfile.TemporaryDirectory(dir=folder) as place:
        return outcomes(renderer, Path(place), ())


def switched(program: Path) -> list[Renderer]:
    """Return the program without a switch, and with each."""
    found = [Renderer(kind=KNOWN_NONE, mistakes=(), accepted=(), program=program)]
    for name, kind in listed(program):
        right = (frozenset({CALLED.get(name, name), *SAME.get(name, ())}),) if kind != KNOWN_NONE else ()
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


def drawn_faults(count: int, seed: int) -> list[Renderer]:
    """Return the tracer with one of its wrong formulas, so many drawn at random."""
    from rayproof.reports.diagnosis.mistakes.formulas import NAME_OF

    names = sorted(NAME_OF)
    chosen = random.Random(seed).sample(names, min(count, len(names)))
    return [
        Renderer(kind=PLANTED, mistakes=(name,), accepted=(frozenset({NAME_OF[name]}),), program=None)
        for name in chosen
    ]


def table(found: Sequence[Outcome]) -> list[Figures]:
    """Return the figures: named right, named wrong and not named, for each kind of renderers that was measured."""
    rows: list[Figures] = []
    for kind in (KNOWN_ONE, KNOWN_FIT, KNOWN_NONE, TWO, PLANTED):
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
                    "class_of_at_most_2": sum(one.right and len(_classes(one)) <= 2 for one in here),
                    "wrong": wrong,
                    "does_not_know": len(here) - right - wrong,
                    "unseen": len(those) - len(here),
                }
            )
    return rows


def said(one: Outcome) -> str:
    """Return an outcome in a line."""
    verdict = "RIGHT" if one.right else "WRONG" if one.wrong else "does not know" if one.failing else "not seen"
    named = ", ".join(one.named) or "nothing"
    return f"{one.mistake or 'no mistake'}, {one.written}: {verdict}, named {named}; {one.failing} cases fail"


def _classes(one: Outcome) -> set[str]:
    """Return what was named, mistakes of identical images counted once."""
    same = {other: names[0] for names in ((name, *others) for name, others in SAME.items()) for other in names}
    return {same.get(name, name) for name in one.named}


def measure(
    *, jobs: int, quick: bool, only: str = "*", pairs: int = 0, faults: int = 0, seed: int = 0
) -> MeasuredDiagnosis:
    """Return the figures over the switches that patterns with commas name; of one in eight of them if `quick`.

    Instead over so many `pairs` of switches or planted `faults`, or both, drawn by a seed. What is said of one is
    printed as soon as it is known.

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
        if pairs or faults:
            asked = [*drawn_pairs(program, pairs, seed), *drawn_faults(faults, seed)]
        found: list[Outcome] = []
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            waiting = [pool.submit(_job, (renderer, folder)) for renderer in asked]
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
