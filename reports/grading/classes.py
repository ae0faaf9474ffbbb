"""A class of submissions: each is graded in a child process; equal roundings between submissions are noted."""

import ctypes
import hashlib
import signal
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib.metadata import version
from itertools import combinations
from multiprocessing import get_context
from pathlib import Path

import msgspec
import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis.diagnosing import shared_by_mistakes
from rayproof.reports.grading.points import ItemGrade, State, grades, unexplained
from rayproof.reports.grading.rubric import Rubric, load_rubric
from rayproof.reports.grading.submission import Place, SubmissionError, built, digest, judged, subject_of
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.results.document import load_results
from rayproof.reports.results.files import replacing
from rayproof.reports.results.images import kept_images
from rayproof.reports.results.records import RunRecord
from rayproof.reports.subjects import PROGRAM

FEWEST_ROUNDINGS = 1000  # pixels rounded otherwise than the oracle's, without which equal images are no hint
SHARING = 15.0  # s of processor time for mistakes that explain some stages each
NAME = "grade.json"
PDEATHSIG = 1  # linux/prctl.h


class Roundings(msgspec.Struct, frozen=True):
    """The pixels of a case's radiance that are not the correctly rounded ones: how many, and a digest of them."""

    pixels: int
    digest: str


class Graded(msgspec.Struct, kw_only=True, frozen=True):
    """The result of one submission."""

    name: str
    digest: str  # of what was handed in
    rubric: str  # the digest of the rubric
    rayproof: str
    confined: bool
    problem: str  # why it could not be run at all, or nothing
    grades: list[ItemGrade]
    roundings: dict[str, Roundings]

    @property
    def points(self) -> float:
        """Return the sum of its points."""
        return sum(grade.points for grade in self.grades)

    @property
    def open(self) -> list[ItemGrade]:
        """Return the items that a teacher has to decide."""
        return [grade for grade in self.grades if grade.state is State.UNDECIDED]


def names(place: Place) -> list[str]:
    """Return the names of the submissions, which are folders; files and links beside them are none."""
    return sorted(path.name for path in place.submissions.iterdir() if path.is_dir() and not path.is_symlink())


def run_folder(place: Place, name: str) -> Path:
    """Return the folder that a submission's run is kept in."""
    return place.teacher / "runs" / name


def grade_class(rubric: Rubric, place: Place, chosen: Sequence[str], *, jobs: int) -> Iterator[Graded]:
    """Yield each submission's grades as they are known.

    Raises:
        KeyboardInterrupt: it was interrupted; what is finished is kept.

    """
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"))
    try:
        waiting = [pool.submit(grade_one, rubric.path, place, name) for name in chosen]
        for done in as_completed(waiting):
            yield done.result()
    finally:
        pool.shutdown(cancel_futures=True)


def grade_one(path: Path, place: Place, name: str) -> Graded:
    """Grade one submission; take up what is known of it under the same rubric and version."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform == "linux":  # end with the command, however that ends
        ctypes.CDLL(None).prctl(PDEATHSIG, signal.SIGTERM)
    rubric, folder = load_rubric(path), run_folder(place, name)
    problem, results, known = "", None, ""
    try:
        known = digest(place.submissions / name)
        if (before := _earlier(folder / NAME, known, rubric, place)) is not None:
            return before
        products = place.teacher / "builds" / name
        program = built(rubric, place, place.submissions / name, products)
        results = judged(rubric, subject_of(rubric, place, program, products, known), folder, resume=True)
    except SubmissionError as error:
        problem = str(error)
    shared = [] if results is None else shared_by_mistakes(folder, results, unexplained(results), seconds=SHARING)
    found = Graded(
        name=name,
        digest=known,
        rubric=rubric.digest,
        rayproof=version("rayproof"),
        confined=place.confined,
        problem=problem,
        grades=grades(results, rubric, shared, problem=problem),
        roundings={} if results is None else _roundings(folder, results),
    )
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / NAME) as draft:
        draft.write_bytes(msgspec.json.encode(found))
    return found


def _earlier(path: Path, known: str, rubric: Rubric, place: Place) -> Graded | None:
    """Return the grades of the same submission under the same rubric, version and confinement, or None."""
    try:
        before = msgspec.json.decode(path.read_bytes(), type=Graded)
    except (OSError, msgspec.DecodeError):
        return None
    told = (before.digest, before.rubric, before.rayproof, before.confined)
    return before if told == (known, rubric.digest, version("rayproof"), place.confined) else None


def results_of(place: Place, name: str) -> RunRecord | None:
    """Return the document of a submission's run, or None if it was never run."""
    folder = run_folder(place, name)
    return load_results(folder) if (folder / "results.json").is_file() else None


def _roundings(folder: Path, results: RunRecord) -> dict[str, Roundings]:
    """Return, for each case, where a submission's radiance is not the oracle's to the last bit, and how."""
    found = {}
    for case in results["cases"]:
        renders, _ = kept_images(folder, case, only=[PROGRAM, ORACLE])
        ours, right = (renders.get(name, {}).get(Stage.RADIANCE) for name in (PROGRAM, ORACLE))
        if ours is not None and right is not None and ours.shape == right.shape:
            ours, right = (np.asarray(image, dtype="<f4") for image in (ours, right))
            other = np.any(ours.view("<u4") != right.view("<u4"), axis=-1)
            told = hashlib.sha256(np.flatnonzero(other).astype("<i8").tobytes() + ours[other].tobytes()).hexdigest()
            found[str(case["name"])] = Roundings(int(np.count_nonzero(other)), told)
    return found


def equal_pairs(graded: Sequence[Graded]) -> list[tuple[str, str, int]]:
    """Return pairs of submissions whose images are equal to the last bit where independent programs round otherwise.

    The number is how many pixels these are. It is a hint for a teacher: a correct program that shares a library's
    formulas may round alike.
    """
    found = []
    for first, second in combinations(graded, 2):
        both = [(first.roundings[case], second.roundings[case]) for case in first.roundings if case in second.roundings]
        pixels = sum(one.pixels for one, _ in both)
        if pixels >= FEWEST_ROUNDINGS and all(one == other for one, other in both):
            found.append((first.name, second.name, pixels))
    return found
