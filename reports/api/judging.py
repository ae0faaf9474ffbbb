"""`judge`: existing images are judged in this process, without worker, folder or report."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.api.asking import answers_from, limit_of, load
from rayproof.reports.api.outcome import CHECK_COLUMNS, Judgement, checks_table, stage_name
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.run.scenes import case_of_scene

Precision = Literal["float32", "float64"]


def judge(
    scene: Scene | Case | str,
    answers: Mapping[str, Any] | Any,
    precision: Precision = "float32",
    *,
    references: Sequence[str] = (ORACLE,),
) -> Judgement:
    """Judge images of a scene against the closed forms and other references, in the same way as `rayproof run`.

    `scene` is a scene, a case, or the name of either (see `load`). `answers` maps stage names to arrays of NumPy,
    PyTorch, JAX, Dr.Jit or any library that supports DLPack, (height, width, channels), row 0 at the top;
    docs/specification.md lists the channels and units. `precision` is the precision of the renderer's arithmetic; the
    limits are derived for it. `references` are names from `rayproof list references`; "analytic" is always used.

    Raises:
        LookupError: there is no reference or case with this name.
        TypeError, ValueError: an answer is not an array, has another shape than its stage, or there is no image to
            judge.

    """
    from rayproof.reports.api.conformance import Conformance

    case = _case(scene)
    images = answers_from(answers, case.scene, (Stage.RADIANCE,))
    if not images:
        raise ValueError(f"there is nothing to judge: expected some of {', '.join(IMAGE_STAGES)}")
    conformance = Conformance(
        case=case,
        folder=Path(),
        precision=precision,
        stages=[stage.value for stage in images],
        witnesses=tuple(references),
    )
    judged = conformance.judged({stage.value: image for stage, image in images.items()})
    names = dict.fromkeys((ORACLE, *references))
    return Judgement(
        verdict=judged.outcome.value,
        stage=stage_name(judged.stage),
        blamed_items=judged.blamed,
        reason=judged.reason,
        checks=checks_table(CHECK_COLUMNS, [check.recorded() for check in judged.checks]),
        limits=MappingProxyType({stage.value: limit_of(case.scene, stage, precision) for stage in images}),
        references=tuple(names),
    )


def _case(scene: Scene | Case | str) -> Case:
    if isinstance(scene, Case):
        return scene
    loaded = scene if isinstance(scene, Scene) else load(scene)
    return case_of_scene(loaded, name="judged/scene", stresses="A scene that a caller of `rayproof.judge` chose.")
