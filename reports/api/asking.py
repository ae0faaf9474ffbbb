"""`select_cases`, `load`, `render`, `oracle` and `limit_of`: cases, scenes, and answers of tracer and oracle.

Images come from whatever array library a renderer is written in, as float64 of the shape that a stage has.
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
    """Return the cases that the selectors name: families, family/case, or patterns such as `shadow*/*`.

    Without a selector it is the default suite. A case has a `name`, a `scene`, what it `stresses` and what it `covers`.

    Raises:
        LookupError: a selector names nothing; the message lists names like it.

    """
    return select(selectors) if selectors else all_cases()


def load(scene: str | Path | Mapping[str, Any]) -> Scene:
    """Return the scene of a scene file (ending in .json), of a case by its name, or of JSON data.

    Raises:
        LookupError: no case has the name, or several do.
        ValueError: the file or the data is no valid scene; the message names the place and the bad value.
        OSError: the file cannot be read.

    """
    if isinstance(scene, Mapping):
        return scene_from_json(dict(scene), None, "the scene")
    if str(scene).endswith(".json"):
        return load_scene(scene)
    found = select([str(scene)])
    if len(found) != 1:
        raise LookupError(f"{str(scene)!r} names {len(found)} cases, one is needed")
    return found[0].scene


def render(
    scene: Scene | str | Path | Mapping[str, Any],
    stages: Sequence[str] = ("radiance",),
    configuration: str = "float32",
    formulas: Sequence[str] = (),
) -> Images:
    """Return what the tracer answers about a scene: stage -> float64 array (height, width, channels), row 0 at the top.

    `stages` are names such as "distance" or "radiance"; channels and units are those of docs/specification.md.
    `configuration` is a precision and formulas, such as "float64/triangle=signed_areas"; `formulas` are further ones,
    such as "sphere/textbook" or a function of one's own, "sphere=./mine.py:nearest_hit".

    Raises:
        LookupError: there is no such configuration, or no formula for a shape.
        ValueError: there is no such stage, the scene is beyond what the precision can hold, or a function of one's own
            does not fit its slot.

    """
    choose_packaged_llvm()
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas import FORMULAS
    from rayproof.tracer.formulas.own_file import forget
    from rayproof.tracer.render import render as trace

    asked = image_stages(stages)
    forget()
    chosen = Configuration.parse(configuration)
    named = {one.slot: one.variant for one in map(FORMULAS.named, formulas)}
    chosen = Configuration(precision=chosen.precision, formulas={**chosen.formulas, **named})
    answers = trace(_scene(scene), asked, chosen)
    return {stage.value: answers[stage] for stage in asked}


def oracle(scene: Scene | str | Path | Mapping[str, Any], stages: Sequence[str] | None = None) -> Images:
    """Return what the closed forms answer in float64: stage -> array (height, width, channels), row 0 at the top.

    This is the reference `analytic`, which shares no code with the tracer. Without `stages` it answers all that the
    scene has.

    Raises:
        ValueError: there is no such stage.

    """
    from rayproof.reference.analytic import Analytic
    from rayproof.reports.judge.oracle import stages_of

    asked = _scene(scene)
    wanted = image_stages(stages) if stages is not None else [one for one in stages_of(asked) if one in IMAGE_STAGES]
    answers = Analytic().render(asked, wanted)
    return {stage.value: answers[stage] for stage in wanted}


def image_stages(names: Sequence[str]) -> list[Stage]:
    """Return image stages by their names, in the specification's order; raise ValueError for an unknown name."""
    wanted = {str(name) for name in ([names] if isinstance(names, str) else names)}
    known = [stage.value for stage in IMAGE_STAGES]
    if unknown := sorted(wanted.difference(known)):
        raise ValueError(f"no image stage is called {unknown[0]!r}; known: {', '.join(known)}")
    return [stage for stage in IMAGE_STAGES if stage.value in wanted]


def _scene(scene: Scene | str | Path | Mapping[str, Any]) -> Scene:
    return scene if isinstance(scene, Scene) else load(scene)


def answers_from(answers: Any, scene: Scene, stages: tuple[Stage, ...]) -> dict[Stage, np.ndarray]:
    """Return what a renderer gave as stage -> float64 (height, width, channels).

    `answers` maps stage names to arrays: NumPy's, or anything that speaks DLPack (PyTorch, JAX, Dr.Jit) or that NumPy
    understands. Where one stage alone was asked for it may be the array itself.

    Raises:
        TypeError: it is no mapping, or something in it is no array of numbers.
        ValueError: an array has another shape than (height, width, channels of the stage), or a stage is not known.

    """
    if not isinstance(answers, Mapping):
        if len(stages) != 1:
            raise TypeError(f"expected a mapping from stage to array, got {type(answers).__name__}")
        answers = {stages[0].value: answers}
    found = {}
    for stage in image_stages([str(name) for name in answers]):
        size = (scene.camera.height, scene.camera.width, len(exr_channels(stage, lights=len(scene.lights))))
        found[stage] = _image(answers[stage], stage, size)
    return found


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
    value = value.detach() if hasattr(value, "detach") else value  # PyTorch gives away no array that has a gradient
    if isinstance(value, list | tuple | np.ndarray) or not hasattr(value, "__dlpack__"):
        array = value
    else:
        try:
            array = np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, ValueError, AttributeError):
            array = (
                value  # on a graphics card, or of a type that DLPack has no word for: the library may copy it itself
            )
    try:
        return np.array(array, dtype=np.float64)
    except Exception as error:  # whatever an array library raises
        line = " ".join(str(error).split())
        raise TypeError(f"{stage} is no array of numbers: {type(value).__name__} ({line})") from error


def limit_of(scene: Scene, stage: Stage, precision: str) -> np.ndarray:
    """Return how far an image may be off against the closed forms, as `CaseResult.limit` describes it."""
    from rayproof.cases.case import ITEMS_OF_OTHERS
    from rayproof.reference.analytic import Analytic
    from rayproof.reports.judge.against_oracle import AgainstOracle
    from rayproof.reports.judge.answers import Answers
    from rayproof.reports.judge.oracle import stages_of
    from rayproof.reports.judge.scene_truth import scene_truth

    base = scene_truth(scene, stages_of(scene), Analytic())
    ours = Answers(name="ours", precision=precision, items=ITEMS_OF_OTHERS, answers=base.truth)
    against = AgainstOracle(base, ours)
    limit = np.array(against.limits.end_to_end.get(stage, base.no_limit), dtype=np.float64)
    limit[against.undecided(stage)] = np.nan
    return limit
