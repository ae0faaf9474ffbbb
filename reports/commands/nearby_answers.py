"""The values of nearby problems at a pixel that exceeds its limit, for `rayproof probe`."""

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.commands.output import say
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers, well_shaped
from rayproof.reports.judge.measurement import Kind, jsonable
from rayproof.reports.judge.nearby.clouds import Cloud, joined
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.scene_truth import scene_truth

VERDICTS = {
    Kind.STRICT: "within its limit",
    Kind.WIDE: "within its limit, which is more than 1 % of the value",
    Kind.ROUNDING: "explained by rounding",
    Kind.EPSILON: "explained only by a declared epsilon",
    Kind.WRONG: "wrong",
    Kind.UNEXAMINED: "unexamined",
}
MOST_OBJECTS = 6  # objects that are named; a fan of triangles has a thousand
WIDTH, ACROSS = 80, 3  # columns of a line, numbers in a line


@dataclass(frozen=True, kw_only=True)
class StageAtPixel:
    """One stage of a renderer at a pixel where its error exceeds the limit."""

    stage: Stage
    verdict: str  # end to end, as in a run
    continued: str | None  # verdict from the renderer's own previous stages; None without these
    value: tuple[float, ...]
    oracle: tuple[float, ...]
    error: float
    limit: float
    least: tuple[float, ...]  # smallest value of the nearby problems per channel; empty without such problems
    greatest: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class NearbyAnswers:
    """The stages where a renderer exceeds its limit at a pixel, with the values of nearby problems there."""

    renderer: str
    problems: int  # 0 if problems moved eight times as far have the same values, so that the limits decide
    objects: Mapping[str, int]  # name -> number of problems that hit the object
    lights: tuple[int, ...]  # number of problems that see each light; empty if the stages do not depend on lights
    stages: Sequence[StageAtPixel]

    def as_json(self) -> dict[str, object]:
        """Return plain JSON data."""
        return {
            "problems": self.problems,
            "objects": dict(self.objects),
            "lights": list(self.lights),
            "stages": {
                stage.stage.value: {
                    "verdict": stage.verdict,
                    "continued": stage.continued,
                    "error": jsonable(stage.error),
                    "limit": jsonable(stage.limit),
                    "least": jsonable(stage.least),
                    "greatest": jsonable(stage.greatest),
                }
                for stage in self.stages
            },
        }


def nearby_answers(scene: Scene, renderers: Sequence[Answers], x: int, y: int) -> list[NearbyAnswers]:
    """Return the values of nearby problems at pixel (x, y), for each renderer that exceeds a limit there."""
    base = scene_truth(scene, stages_of(scene), Analytic())
    comparisons = (
        AgainstOracle(base, well_shaped(scene, renderer)) for renderer in renderers if renderer.name != ORACLE
    )
    nearby = (_of_renderer(against, x, y) for against in comparisons)
    return [answers for answers in nearby if answers is not None]


def _of_renderer(against: AgainstOracle, x: int, y: int) -> NearbyAnswers | None:
    over = {stage: mask for stage in against.end_to_end if (mask := _at(against.over(stage), x, y)).any()}
    if not over:
        return None
    asking = against.asking(over, keep=True)
    asking.explain()
    clouds = [cloud.at(np.flatnonzero((rows == y) & (columns == x))) for cloud, rows, columns in asking.clouds]
    cloud = joined(clouds) if clouds else None
    lights = () if cloud is None or Stage.VISIBILITY not in cloud.rows else cloud.rows[Stage.VISIBILITY][:, 0]
    return NearbyAnswers(
        renderer=against.renderer.name,
        problems=0 if cloud is None else len(cloud.codes),
        objects={} if cloud is None else _objects(against.base.scene, cloud),
        lights=tuple(int(count) for count in np.sum(np.asarray(lights) > 0, axis=0)) if len(lights) else (),
        stages=[_stage(against, stage, cloud, x, y) for stage in over],
    )


def _at(mask: np.ndarray, x: int, y: int) -> np.ndarray:
    """Return the part of a mask (height, width) at pixel (x, y); all other pixels are False."""
    single = np.zeros_like(mask)
    single[y, x] = mask[y, x]
    return single


def _objects(scene: Scene, cloud: Cloud) -> dict[str, int]:
    """Return how many problems of a cloud at one pixel hit each object, the most frequent object first."""
    counts = Counter(map(tuple, cloud.rows[Stage.OBJECT][:, 0].astype(int).tolist()))
    return {_name(scene, shape, face): count for (shape, face), count in counts.most_common()}


def _name(scene: Scene, shape: int, face: int) -> str:
    """Return the name of the object hit, such as "shapes[2] (mesh) face 5"; "nothing" for a miss."""
    if shape < 0:
        return "nothing"
    kind = scene.shapes[shape]
    face_of_mesh = f" face {face}" if isinstance(kind, Mesh) else ""
    return f"shapes[{shape}] ({type(kind).__name__.lower()}){face_of_mesh}"


def _stage(against: AgainstOracle, stage: Stage, cloud: Cloud | None, x: int, y: int) -> StageAtPixel:
    pixels, alone = against.end_to_end[stage], against.continued(stage)
    error, limit = np.ravel(pixels.error[y, x]), np.ravel(pixels.limit[y, x])
    worst = int(np.argmax(np.nan_to_num(error, nan=np.inf)))
    answers = None if cloud is None else cloud.rows.get(stage)
    least, greatest = ((), ()) if answers is None else (answers[:, 0].min(axis=0), answers[:, 0].max(axis=0))
    return StageAtPixel(
        stage=stage,
        verdict=VERDICTS[Kind(pixels.kinds[y, x])],
        continued=None if alone is None else VERDICTS[Kind(alone.kinds[y, x])],
        value=_numbers(against.renderer.answers[stage][y, x]),
        oracle=_numbers(pixels.value[y, x]),
        error=float(error[worst]),
        limit=float(limit[min(worst, len(limit) - 1)]),
        least=_numbers(least),
        greatest=_numbers(greatest),
    )


def _numbers(values: object) -> tuple[float, ...]:
    return tuple(float(value) for value in np.ravel(np.asarray(values, dtype=np.float64)))


def show_nearby(nearby: Sequence[NearbyAnswers], agreeing: Sequence[str]) -> None:
    """Print the values of nearby problems, within 80 columns; `agreeing` renderers are within their limits."""
    say("")
    if agreeing:
        _say_wrapped(f"within every limit: {', '.join(agreeing)}")
    for answers in nearby:
        stages = ", ".join(stage.stage.value for stage in answers.stages)
        _say_wrapped(f"{answers.renderer} is over its limit: {stages}")
        if answers.problems:
            say(f"  {answers.problems} nearby problems were asked; they hit")
            named = list(answers.objects.items())
            for name, count in named[:MOST_OBJECTS]:
                say(f"    {count:>6}  {name}")
            if len(named) > MOST_OBJECTS:
                rest = sum(count for _, count in named[MOST_OBJECTS:])
                say(f"    {rest:>6}  {len(named) - MOST_OBJECTS} more objects")
            for light, count in enumerate(answers.lights):
                say(f"    {count:>6}  see lights[{light}]")
        else:
            say("  Problems that are moved eight times as far show the same, so that the limit decides.")
        for stage in answers.stages:
            _show_stage(stage)


def _show_stage(values_of_stage: StageAtPixel) -> None:
    whole = values_of_stage.stage in (Stage.OBJECT, Stage.VISIBILITY)
    numbers = "" if whole else f"; error {values_of_stage.error:.4g}, limit {values_of_stage.limit:.4g}"
    say(f"  {values_of_stage.stage}: {values_of_stage.verdict}{numbers}")
    rows = {"this renderer": values_of_stage.value, "oracle": values_of_stage.oracle}
    if not whole:  # for integers, the counts above already show the values of nearby problems
        rows |= {"nearby problems, least": values_of_stage.least, "greatest": values_of_stage.greatest}
    for name, values in rows.items():
        for first in range(0, len(values), ACROSS):
            cells = "".join(f"{value:>17.9g}" for value in values[first : first + ACROSS])
            say(f"    {name if first == 0 else '':<24}{cells}")
    if values_of_stage.continued is not None:
        say(f"    given its own previous stages: {values_of_stage.continued}")


def _say_wrapped(line: str) -> None:
    for part in textwrap.wrap(line, WIDTH, subsequent_indent="  ", break_long_words=False):
        say(part)
