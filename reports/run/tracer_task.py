"""The tracer's task: render a scene by one configuration, with shadow epsilons and seconds of the kernels.

Beside the answers stands what they cost: the seconds that the kernels of one launch ran, the median of some launches.
"""

from contextlib import nullcontext
from pathlib import Path
from statistics import median

import drjit as dr
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.box_filter import finer
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.run.case_answers import Render
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas.own_file import copied
from rayproof.tracer.kernel.arrays import versions
from rayproof.tracer.kernel.compiler import one_thread
from rayproof.tracer.light_path.shadow_stage import shadow_epsilon
from rayproof.tracer.render import render
from rayproof.tracer.shapes.bounds import WIDEST
from rayproof.tracer.shapes.primitives import traced


def shadow_epsilons(scene: Scene, answers: StageImages, configuration: Configuration) -> np.ndarray:
    """Return the configuration's shadow epsilon [m], (height, width).

    It goes by the coordinates at hand, by how far the face hit reaches beyond them, and by how that magnifies rounding:
    a sliver's own face counts, not the worst face of its mesh.
    """
    coordinates = np.maximum(np.abs(answers[Stage.POSITION]).max(axis=-1), np.abs(scene.camera.eye).max())
    spreads, eye = np.ones(coordinates.shape), float(np.linalg.norm(scene.camera.eye))
    objects, faces = answers[Stage.OBJECT][..., 0], answers[Stage.OBJECT][..., 1].astype(int)
    for index, shape in enumerate(scene.shapes):
        seen = objects == index
        spreads[seen] = traced(shape).spreads()[faces[seen]]
        whole = (eye + answers[Stage.DISTANCE][seen][:, 0] + traced(shape).reaches()[faces[seen]]) / WIDEST
        coordinates[seen] = np.maximum(coordinates[seen], whole)
    return shadow_epsilon(configuration, scale=coordinates, spread=spreads)


LONG = 0.1  # s, which no repetition begins after: what takes so long is known well enough by one launch
SMALL = 2**16  # px of an image that one thread renders no later than several, with half of their processor time


def prepare() -> None:
    """Load what any scene needs: the backend and the formulas of the default configuration."""
    versions()
    for formula in Configuration().chosen:
        formula.load()


def use_own_formulas(configuration: str, *, own: tuple[str, ...], copies: tuple[tuple[str, str], ...]) -> None:
    """Load the user's own formulas of a configuration from their copies on this machine, if there are any.

    `own` has each formula with the SHA-256 of its file when the run began; `copies` has paths and where they lie here.

    Raises:
        RuntimeError: a file has changed since.

    """
    for path, copy in copies:
        copied(path, Path(copy))
    if own:
        _unchanged(Configuration.parse(configuration), own)


def trace(scene: Scene, configuration: str, *, samples: int = 1, launches: int = 1) -> Render:
    """Render a scene with the tracer; `launches` is how often its kernels run, of which the median time is returned."""
    chosen = Configuration.parse(configuration)
    answers, seconds = _images(scene, chosen)
    times = [seconds]
    while len(times) < launches and sum(times) < LONG:
        times.append(_images(scene, chosen)[1])
    fine = _images(finer(scene, samples), chosen)[0] if samples > 1 else None
    return Render(
        answers=Answers(
            name=chosen.name,
            precision=chosen.precision,
            items=chosen.items,
            shadow_epsilon=shadow_epsilons(scene, answers, chosen),
            answers=answers,
            fine=fine,
        ),
        versions=versions(),
        launches=(median(times), len(times)),
    )


def _images(scene: Scene, configuration: Configuration) -> tuple[StageImages, float]:
    """Return all stages, and the seconds that their kernels ran."""
    dr.kernel_history_clear()
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        with one_thread() if scene.camera.width * scene.camera.height <= SMALL else nullcontext():
            answers = render(scene, stages_of(scene), configuration)
        return answers, sum(kernel["execution_time"] for kernel in dr.kernel_history([dr.KernelType.JIT])) * 1e-3
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, False)


def _unchanged(configuration: Configuration, known: tuple[str, ...]) -> None:
    """Raise RuntimeError if a user's file is not what it was when the run began; answers are kept under that."""
    for place, digest in configuration.own.items():
        if f"{place} {digest}" not in known:
            raise RuntimeError(f"{place} has changed since the run began")
