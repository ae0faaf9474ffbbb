"""What a case takes in time, memory and disk, told from its scene before anything starts.

The constants are measured: docs/performance.md, "What a case takes", says on what, and how well they do.
"""

from dataclasses import dataclass

import psutil

from rayproof.cases.case import Case
from rayproof.cases.scene import Mesh, Scene, SceneError

# Seconds of one processor. A renderer's are those of the slowest; the judge's are for one candidate.
RENDER_A_PIXEL, JUDGE_A_PIXEL = 17e-6, 30e-6
RENDER_A_PIXEL_AND_LIGHT, JUDGE_A_PIXEL_AND_LIGHT = 35e-6, 16e-6  # more, for each light
RENDER_A_TRIANGLE, JUDGE_A_TRIANGLE = 25e-6, 40e-6
USUAL_SHARE = 0.5  # of the slowest renderer's time: what one of the panel takes on average
# Bytes of one process beside what it takes to begin with: the judge's, which are the most.
BEGINNING = 300e6
BYTES_A_PIXEL, BYTES_A_PIXEL_AND_LIGHT, BYTES_A_TRIANGLE = 5000, 400, 700
BYTES_AN_IMAGE = 330  # a pixel, of the tracer's image alone
# Bytes of the results folder a pixel and renderer: of a case that passed an eighth.
KEPT_A_PIXEL, KEPT_A_PIXEL_AND_LIGHT = 90, 4

MOST_PIXELS = 2**22  # of an image that is judged
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


def estimate(case: Case, *, candidates: int, references: int) -> Estimate:
    """Return what it takes to put so many candidates of a subject to a case before so many references."""
    scene, camera = case.scene, case.scene.camera
    pixels, lights, triangles = camera.width * camera.height, len(scene.lights), triangles_of(scene)
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
    pixels = scene.camera.width * scene.camera.height
    return BEGINNING + pixels * _bytes_a_pixel(scene) + triangles_of(scene) * BYTES_A_TRIANGLE


def _bytes_a_pixel(scene: Scene) -> float:
    return BYTES_A_PIXEL + BYTES_A_PIXEL_AND_LIGHT * max(0, len(scene.lights) - 1)


def is_large(scene: Scene) -> bool:
    """Say whether a scene's renders and judgement are to run one at a time."""
    return memory_of(scene) > LARGE


def deadline(case: Case, *, candidates: int, references: int) -> float:
    """Return how long [s] one render of a case, or its judgement, may take where nobody says."""
    takes = estimate(case, candidates=candidates, references=references)
    return max(USUAL_LIMIT, SLACK * takes.longest)


def refuse_beyond_all(case: Case, name: str) -> None:
    """Raise SceneError if a case is too large to be judged: by its pixels, its memory, or its processor time."""
    camera = case.scene.camera
    size = f"{name}: {camera.width} x {camera.height} px"
    if camera.width * camera.height > MOST_PIXELS:
        raise SceneError(f"{size} are more than the {MOST_PIXELS} that are judged; make the image smaller")
    takes = estimate(case, candidates=2, references=5)
    there = psutil.virtual_memory().total
    if takes.memory > there:
        raise SceneError(
            f"{size} and its meshes take about {takes.memory / 1e9:.0f} GB of memory to judge, and this machine has "
            f"{there / 1e9:.0f} GB; make the image smaller"
        )
    if takes.seconds > LONGEST:
        raise SceneError(
            f"{size} take about {takes.seconds / 86400:.0f} days of processor time, and at most "
            f"{LONGEST / 86400:.0f} are tried; make the image smaller"
        )


def refuse_too_large(scene: Scene, name: str) -> None:
    """Raise SceneError if this machine has not half of the memory that the tracer's image of a scene takes, at least.

    Half, since the estimate is rough: a scene that might do is tried.
    """
    camera, there = scene.camera, psutil.virtual_memory().total
    takes = camera.width * camera.height * BYTES_AN_IMAGE + triangles_of(scene) * BYTES_A_TRIANGLE
    if takes > 2 * there:
        raise SceneError(
            f"{name}: {camera.width} x {camera.height} px and its meshes take about {takes / 1e9:.0f} GB of memory, "
            f"and this machine has {there / 1e9:.0f} GB; make the image smaller"
        )
