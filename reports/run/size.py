"""What a case takes in time, memory and disk, told from its scene before anything starts.

The constants are measured: docs/performance.md, "What a case takes", says on what, and how well they do.
"""

from dataclasses import dataclass

import psutil

from cases.case import Case
from cases.scene import Mesh, Scene, SceneError

# Seconds of one processor. A renderer's are those of the slowest; the judge's are for one candidate.
RENDER_A_PIXEL, JUDGE_A_PIXEL = 17e-6, 30e-6
RENDER_A_PIXEL_AND_LIGHT, JUDGE_A_PIXEL_AND_LIGHT = 35e-6, 16e-6  # more, for each light
RENDER_A_TRIANGLE, JUDGE_A_TRIANGLE = 25e-6, 40e-6
USUAL_SHARE = 0.5  # of the slowest renderer's time: what one of the panel takes on average
# Bytes of one process beside what it takes to begin with: the judge's, which are the most.
BEGINNING = 300e6
BYTES_A_PIXEL, BYTES_A_PIXEL_AND_LIGHT, BYTES_A_TRIANGLE = 5000, 400, 700
# Bytes of the results folder a pixel and renderer: of a case that passed an eighth.
KEPT_A_PIXEL, KEPT_A_PIXEL_AND_LIGHT = 90, 4

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
    """Return what it takes to put so many candidates to a case before so many references."""
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
    """Return about how much memory [bytes] the largest process takes for a scene."""
    camera = scene.camera
    pixels, lights = camera.width * camera.height, len(scene.lights)
    each = BYTES_A_PIXEL + BYTES_A_PIXEL_AND_LIGHT * max(0, lights - 1)
    return BEGINNING + pixels * each + triangles_of(scene) * BYTES_A_TRIANGLE


def is_large(scene: Scene) -> bool:
    """Say whether a scene's renders and judgement are to run one at a time."""
    return memory_of(scene) > LARGE


def deadline(case: Case, *, candidates: int, references: int) -> float:
    """Return how long [s] one render of a case, or its judgement, may take where nobody says."""
    return max(USUAL_LIMIT, SLACK * estimate(case, candidates=candidates, references=references).longest)


def refuse_too_large(scene: Scene, name: str) -> None:
    """Raise SceneError if this machine has not half of the memory that a scene is estimated to take.

    Half, since the estimate is rough: a scene that might do is tried.
    """
    takes, there = memory_of(scene), psutil.virtual_memory().total
    if takes > 2 * there:
        camera = scene.camera
        raise SceneError(
            f"{name}: {camera.width} x {camera.height} px and its meshes take about {takes / 1e9:.0f} GB of memory, "
            f"and this machine has {there / 1e9:.0f} GB; make the image smaller"
        )
