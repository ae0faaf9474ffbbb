"""What a case takes in time, memory and disk, told from its scene before anything starts.

The constants are measured: docs/performance.md, "What a case takes", says on what, and how well they do.
"""

from dataclasses import dataclass, replace

import psutil

from rayproof.cases.case import Case
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.reports.subjects import THE_TRACER, Subject

# Seconds of one processor. A renderer's are those of the slowest; the judge's are for one candidate.
RENDER_A_PIXEL, JUDGE_A_PIXEL = 17e-6, 30e-6
RENDER_A_PIXEL_AND_LIGHT, JUDGE_A_PIXEL_AND_LIGHT = 35e-6, 16e-6  # more, for each light
RENDER_A_TRIANGLE, JUDGE_A_TRIANGLE = 25e-6, 40e-6
BY_ANOTHER_ROUTE = 0.25  # of one scene of usual size, which is mostly compiling: 0.05 to 0.7 measured
USUAL_SHARE = 0.5  # of the slowest renderer's time: what one of the panel takes on average
# Bytes of one process beside what it takes to begin with: the judge's, which are the most.
BEGINNING = 300e6
BYTES_A_PIXEL, BYTES_A_PIXEL_AND_LIGHT, BYTES_A_TRIANGLE = 5000, 400, 700
BYTES_AN_IMAGE = 330  # a pixel, of the tracer's image alone
# Bytes of the results folder a pixel and renderer: of a case that passed an eighth.
KEPT_A_PIXEL, KEPT_A_PIXEL_AND_LIGHT = 90, 4

BAND = 0.65e9  # bytes that the judge takes for a band of a large image
KEPT_IN_BANDS = 2**17  # pixels
USUAL_LIMIT = 120.0  # s, for one render or one judgement
SLACK = 10.0  # times what is estimated: this machine may be slower, and others busy on it
LARGE = 2**30  # bytes of a process, from which on one of them runs at a time
LONGEST = 7 * 86400.0  # s of one processor that a run may be estimated to take


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What a case takes."""

    seconds: float  # of one processor, for all that is done
    longest: float  # s, of the longest render or judgement
    memory: float  # bytes of the largest process
    disk: float  # bytes of the results folder, at most


def triangles_of(scene: Scene) -> int:
    """Return how many triangles a scene's meshes have."""
    return sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))


def estimate(case: Case, *, candidates: int, references: int, subject: Subject = THE_TRACER) -> Estimate:
    """Return what it takes to put so many candidates of a subject to a case before so many references.

    Of an image in bands the longest task and the largest process are those of a band, and what is kept is thinned.
    """
    bands = bands_of(case, subject)
    if bands:
        part = replace(case, scene=replace(case.scene, camera=replace(case.scene.camera, rows=bands[0])))
        one = _estimate(part, candidates, references)
        kept = (
            KEPT_IN_BANDS * (candidates + references) * (KEPT_A_PIXEL + KEPT_A_PIXEL_AND_LIGHT * len(case.scene.lights))
        )
        return replace(one, seconds=len(bands) * one.seconds, disk=kept)
    return _estimate(case, candidates, references)


def _estimate(case: Case, candidates: int, references: int) -> Estimate:
    scene, camera = case.scene, case.scene.camera
    pixels, lights, triangles = camera.width * camera.lines, len(scene.lights), triangles_of(scene)
    lit = pixels * max(0, lights - 1)  # the first light is in what a pixel takes
    finer = case.samples**2 if case.samples > 1 else 0
    render = RENDER_A_PIXEL * pixels * (1 + finer) + RENDER_A_PIXEL_AND_LIGHT * lit + RENDER_A_TRIANGLE * triangles
    judge = candidates * (JUDGE_A_PIXEL * pixels + JUDGE_A_PIXEL_AND_LIGHT * lit + JUDGE_A_TRIANGLE * triangles)
    kept = (candidates + references) * (KEPT_A_PIXEL * pixels + KEPT_A_PIXEL_AND_LIGHT * lit)
    return Estimate(
        seconds=judge + USUAL_SHARE * render * (candidates + references),
        longest=max(render, judge),
        memory=memory_of(scene),
        disk=kept,
    )


def memory_of(scene: Scene) -> float:
    """Return about how much memory [bytes] the largest process takes for what is drawn of a scene at once."""
    pixels = scene.camera.width * scene.camera.lines
    return BEGINNING + pixels * _bytes_a_pixel(scene) + triangles_of(scene) * BYTES_A_TRIANGLE


def _bytes_a_pixel(scene: Scene) -> float:
    return BYTES_A_PIXEL + BYTES_A_PIXEL_AND_LIGHT * max(0, len(scene.lights) - 1)


def bands_of(case: Case, subject: Subject) -> tuple[tuple[int, int], ...]:
    """Return the rows of the bands in which a case is drawn and judged, from first to before last; none if it is whole.

    Only images that are large are, and of those only where nothing is asked of the image as a whole: a case of the
    suite promises how many pixels are at edges, closed forms and means are sums, and a program draws what it draws.
    """
    scene, camera = case.scene, case.scene.camera
    most = BAND // _bytes_a_pixel(scene)  # pixels
    if camera.width * camera.height <= 2 * most or case.tuned or case.expectations or case.samples > 1:
        return ()
    if not subject.is_tracer and not _draws_bands(subject):
        return ()
    rows = max(1, int(most // camera.width))
    return tuple((first, min(first + rows, camera.height)) for first in range(0, camera.height, rows))


def _draws_bands(subject: Subject) -> bool:
    from rayproof.reference import REFERENCES

    return subject.name in REFERENCES and bool(getattr(REFERENCES[subject.name], "in_bands", False))


def is_large(scene: Scene) -> bool:
    """Say whether a scene's renders and judgement are to run one at a time."""
    return memory_of(scene) > LARGE


def deadline(case: Case, *, candidates: int, references: int, subject: Subject = THE_TRACER) -> float:
    """Return how long [s] one render of a case, or its judgement, may take where nobody says."""
    takes = estimate(case, candidates=candidates, references=references, subject=subject)
    return max(USUAL_LIMIT, SLACK * takes.longest)


def refuse_too_large(scene: Scene, name: str) -> None:
    """Raise SceneError if this machine has not half of the memory that the tracer's image of a scene takes, at least.

    Half, since the estimate is rough: a scene that might do is tried.
    """
    pixels = scene.camera.width * scene.camera.height
    _refuse(scene, name, pixels * BYTES_AN_IMAGE + triangles_of(scene) * BYTES_A_TRIANGLE)


def refuse_beyond_all(case: Case, name: str, subject: Subject) -> None:
    """Raise SceneError if judging a case takes more than twice this machine's memory, or more than `LONGEST`."""
    takes = estimate(case, candidates=2, references=5, subject=subject)
    _refuse(case.scene, name, takes.memory)
    if takes.seconds > LONGEST:
        camera, days = case.scene.camera, takes.seconds / 86400
        raise SceneError(
            f"{name}: {camera.width} x {camera.height} px take about {days:.0f} days of processor time, "
            f"and at most {LONGEST / 86400:.0f} are tried; make the image smaller"
        )


def _refuse(scene: Scene, name: str, takes: float) -> None:
    there = psutil.virtual_memory().total
    if takes > 2 * there:
        camera = scene.camera
        raise SceneError(
            f"{name}: {camera.width} x {camera.height} px and its meshes take about {takes / 1e9:.0f} GB of memory, "
            f"and this machine has {there / 1e9:.0f} GB; make the image smaller"
        )
