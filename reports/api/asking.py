"""Scenes and cases by name, and what the tracer and the oracle answer about them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.scene import Scene
from rayproof.cases.scene_json import load_scene, scene_from_json
from rayproof.cases.stages import IMAGE_STAGES, Stage
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
    """Return image stages by their names, in the specification's order; raise ValueError for what is none."""
    wanted = {str(name) for name in ([names] if isinstance(names, str) else names)}
    known = [stage.value for stage in IMAGE_STAGES]
    if unknown := sorted(wanted.difference(known)):
        raise ValueError(f"no image stage is called {unknown[0]!r}; known: {', '.join(known)}")
    return [stage for stage in IMAGE_STAGES if stage.value in wanted]


def _scene(scene: Scene | str | Path | Mapping[str, Any]) -> Scene:
    return scene if isinstance(scene, Scene) else load(scene)
