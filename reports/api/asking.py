"""`select_cases`, `load`, `render`, `oracle` and `limit_of`: cases, scenes, and answers of tracer and oracle.

Arrays of any array library are converted to float64 images of shape (height, width, channels of the stage).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.scene import Scene
from rayproof.cases.scene_json import load_scene, scene_from_json
from rayproof.cases.stages import IMAGE_STAGES, Stage, exr_channels
from rayproof.tracer.kernel.compiler import choose_packaged_llvm

Images = dict[str, np.ndarray]


def select_cases(*selectors: str) -> tuple[Case, ...]:
    """Return the cases that match the selectors: families, family/case, or patterns such as `shadow*/*`.

    Without a selector, return the default suite. A case has the attributes `name`, `scene`, `stresses` (its purpose, in
    words) and `covers` (ids of the specification).

    Raises:
        LookupError: a selector matches no case; the message lists similar names.

    """
    return select(selectors) if selectors else all_cases()


def load(scene: str | Path | Mapping[str, Any]) -> Scene:
    """Return the scene of a scene file (ending in .json), of a case with this name, or of JSON data.

    Raises:
        LookupError: no case has the name, or several cases have it.
        ValueError: the file or the data is not a valid scene; the message names the field and the bad value.
        OSError: the file cannot be read.

    """
    if isinstance(scene, Mapping):
        return scene_from_json(dict(scene), None, "the scene")
    if str(scene).endswith(".json"):
        return load_scene(scene)
    cases = select([str(scene)])
    if len(cases) != 1:
        raise LookupError(f"{str(scene)!r} names {len(cases)} cases, one is needed")
    return cases[0].scene


def render(
    scene: Scene | str | Path | Mapping[str, Any],
    stages: Sequence[str] = ("radiance",),
    configuration: str = "float32",
    formulas: Sequence[str] = (),
) -> Images:
    """Render a scene with the tracer: stage -> float64 array (height, width, channels), row 0 at the top.

    `stages` are names such as "distance" or "radiance"; docs/specification.md lists their channels and units.
    `configuration` is a precision and formulas, such as "float64/triangle=signed_areas"; `formulas` are additional
    formulas, such as "sphere/textbook", or functions of the caller's, such as "sphere=./mine.py:nearest_hit".

    Raises:
        LookupError: there is no such configuration, or no formula for a shape.
        ValueError: there is no such stage, the numbers of the scene exceed the precision's range, or a function of the
            caller's does not fit its slot.

    """
    choose_packaged_llvm()
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas import FORMULAS
    from rayproof.tracer.formulas.own_file import forget
    from rayproof.tracer.render import render as trace

    wanted = image_stages(stages)
    forget()
    chosen = Configuration.parse(configuration)
    named = {formula.slot: formula.variant for formula in map(FORMULAS.named, formulas)}
    chosen = Configuration(precision=chosen.precision, formulas={**chosen.formulas, **named})
    answers = trace(_scene(scene), wanted, chosen)
    return {stage.value: answers[stage] for stage in wanted}


def oracle(scene: Scene | str | Path | Mapping[str, Any], stages: Sequence[str] | None = None) -> Images:
    """Evaluate the closed forms of a scene: stage -> float64 array (height, width, channels), row 0 at the top.

    This is the reference `analytic`, which shares no code with the tracer. `stages` are by default all image stages of
    the scene.

    Raises:
        ValueError: there is no such stage.

    """
    from rayproof.reference.analytic import Analytic
    from rayproof.reports.judge.oracle import stages_of

    target = _scene(scene)
    wanted = (
        image_stages(stages) if stages is not None else [stage for stage in stages_of(target) if stage in IMAGE_STAGES]
    )
    answers = Analytic().render(target, wanted)
    return {stage.value: answers[stage] for stage in wanted}


def image_stages(names: Sequence[str]) -> list[Stage]:
    """Return the image stages with these names, in the specification's order; raise ValueError for an unknown name."""
    wanted = {str(name) for name in ([names] if isinstance(names, str) else names)}
    names_of_stages = [stage.value for stage in IMAGE_STAGES]
    if unknown := sorted(wanted.difference(names_of_stages)):
        raise ValueError(f"no image stage is called {unknown[0]!r}; known: {', '.join(names_of_stages)}")
    return [stage for stage in IMAGE_STAGES if stage.value in wanted]


def _scene(scene: Scene | str | Path | Mapping[str, Any]) -> Scene:
    return scene if isinstance(scene, Scene) else load(scene)


def answers_from(answers: Any, scene: Scene, stages: tuple[Stage, ...]) -> dict[Stage, np.ndarray]:
    """Convert a renderer's images to stage -> float64 (height, width, channels).

    `answers` maps stage names to arrays of NumPy, of a library that supports DLPack (PyTorch, JAX, Dr.Jit), or to
    anything that NumPy can convert. If only one stage was requested, it may be the array itself.

    Raises:
        TypeError: `answers` is not a mapping, or a value is not an array of numbers.
        ValueError: an array has another shape than (height, width, channels of the stage), or a stage is unknown.

    """
    if not isinstance(answers, Mapping):
        if len(stages) != 1:
            raise TypeError(f"expected a mapping from stage to array, got {type(answers).__name__}")
        answers = {stages[0].value: answers}
    images = {}
    for stage in image_stages([str(name) for name in answers]):
        size = (scene.camera.height, scene.camera.width, len(exr_channels(stage, lights=len(scene.lights))))
        images[stage] = _image(answers[stage], stage, size)
    return images


def _image(value: Any, stage: Stage, size: tuple[int, int, int]) -> np.ndarray:
    image = _array(value, stage)
    if size[2] == 1 and image.shape == size[:2]:
        image = image[..., np.newaxis]
    if image.shape != size:
        swapped = image.ndim == 2 and image.shape == (size[2], size[0] * size[1])
        hint = f"; components come first in it: transpose it and reshape it to {size}" if swapped else ""
        raise ValueError(f"{stage} must have shape {size} = (height, width, channels), got {image.shape}{hint}")
    return image


def _array(value: Any, stage: Stage) -> np.ndarray:
    """Return a float64 copy of an array of any library."""
    value = value.detach() if hasattr(value, "detach") else value  # PyTorch exports no array that requires a gradient
    if isinstance(value, list | tuple | np.ndarray) or not hasattr(value, "__dlpack__"):
        array = value
    else:
        try:
            array = np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, ValueError, AttributeError):
            array = value  # on a graphics card, or of a type that DLPack lacks: the library's own conversion may work
    try:
        return np.array(array, dtype=np.float64)
    except Exception as error:  # array libraries raise exceptions of any type
        line = " ".join(str(error).split())
        raise TypeError(f"{stage} is no array of numbers: {type(value).__name__} ({line})") from error


def limit_of(scene: Scene, stage: Stage, precision: str) -> np.ndarray:
    """Return the largest allowed error of an image against the closed forms, as described at `CaseResult.limit`."""
    from rayproof.cases.case import ITEMS_OF_OTHERS
    from rayproof.reference.analytic import Analytic
    from rayproof.reports.judge.against_oracle import AgainstOracle
    from rayproof.reports.judge.answers import Answers
    from rayproof.reports.judge.oracle import stages_of
    from rayproof.reports.judge.scene_truth import scene_truth

    base = scene_truth(scene, stages_of(scene), Analytic())
    exact = Answers(name="ours", precision=precision, items=ITEMS_OF_OTHERS, answers=base.truth)
    against = AgainstOracle(base, exact)
    limit = np.array(against.limits.end_to_end.get(stage, base.no_limit), dtype=np.float64)
    limit[against.undecided(stage)] = np.nan
    return limit
