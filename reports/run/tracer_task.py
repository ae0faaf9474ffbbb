"""The tracer's task: render a scene by one configuration, with shadow epsilons and seconds of the kernels.

The cost of the answers is added: the seconds that the kernels of one launch ran, as the median of several launches.
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

    It depends on the coordinates of eye and hit, on the extent of the hit face beyond them, and on the face's
    amplification of rounding. Only the hit face counts, not the worst face of its mesh.
    """
    coordinates = np.maximum(np.abs(answers[Stage.POSITION]).max(axis=-1), np.abs(scene.camera.eye).max())
    spreads, eye = np.ones(coordinates.shape), float(np.linalg.norm(scene.camera.eye))
    objects, faces = answers[Stage.OBJECT][..., 0], answers[Stage.OBJECT][..., 1].astype(int)
    for index, shape in enumerate(scene.shapes):
        visible = objects == index
        spreads[visible] = traced(shape).spreads()[faces[visible]]
        whole = (eye + answers[Stage.DISTANCE][visible][:, 0] + traced(shape).reaches()[faces[visible]]) / WIDEST
        coordinates[visible] = np.maximum(coordinates[visible], whole)
    return shadow_epsilon(configuration, scale=coordinates, spread=spreads)


LONG = 0.1  # s; no repetition begins later, since one launch measures such a time well enough
SMALL = 2**16  # px; one thread renders such an image as soon as several do, with half of their processor time


def prepare() -> None:
    """Load the backend and the formulas of the default configuration, which every scene needs."""
    versions()
    for formula in Configuration().chosen:
        formula.load()


def use_own_formulas(configuration: str, *, own: tuple[str, ...], copies: tuple[tuple[str, str], ...]) -> None:
    """Load the user's own formulas of a configuration from their copies on this machine, if there are any.

    `own` has each formula with the SHA-256 of its file when the run began; `copies` has each path with its copy's path.

    Raises:
        RuntimeError: a file has changed since.

    """
    for path, copy in copies:
        copied(path, Path(copy))
    if own:
        _unchanged(Configuration.parse(configuration), own)


def trace(scene: Scene, configuration: str, *, samples: int = 1, launches: int = 1) -> Render:
    """Render a scene with the tracer; the kernels are launched `launches` times, and the median time is returned."""
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


def _unchanged(configuration: Configuration, expected: tuple[str, ...]) -> None:
    """Raise RuntimeError if a user's file has changed since the run began; answers are stored under its digest."""
    for place, digest in configuration.own.items():
        if f"{place} {digest}" not in expected:
            raise RuntimeError(f"{place} has changed since the run began")
