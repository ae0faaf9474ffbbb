"""The liar: a renderer that answers rightly wherever the judge looks, and garbage everywhere else.

It needs no knowledge of the judge but its verdicts: it spoils every pixel of some stages, asks the judge which of them
are wrong, takes those back, and asks again until the judge finds none. What is left is what anybody could hide. A value
within the limits is no lie, nor is one at an edge that some choice of sides gives: that is worked out here anew, from
the oracle's answers all around the pixel and each light's contribution without shadows.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.checks import stage_check
from rayproof.reports.judge.limit_sentinels import rounded
from rayproof.reports.judge.measurement import Kind, ratios
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.pairs import RendererPair
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome
from tests.harness.audit.orders import LiarOrder, LiarReport
from tests.harness.verdicts.judged_values import reach_of

HUGE, SLIGHTLY = 1e30, 1.001
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
ROUNDS = 12  # so often a liar asks; one that is still found out then has given up
COARSELY = (1 / 3, 2 / 3, 1.0)  # px to either side of a centre, where sides are looked for first
# Of a pixel, and of how far rounding moves outlines if that is more: near an outline values change as the root of the
# distance from it, so that samples stand the closer the nearer they are.
PLACES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0)
MOST_HOLES = 5  # that a report tells of


@dataclass(kw_only=True)
class _Spoiled:
    """Where some stage is spoiled unseen, whatever the garbage: bool (height, width) of each kind."""

    unseen: np.ndarray
    wide: np.ndarray
    epsilon: np.ndarray


def lie(order: LiarOrder) -> LiarReport:
    """Return how many pixels of a case's stages a liar could spoil."""
    scene, oracle = order.case.scene, Analytic()
    stages = tuple(stage for stage in stages_of(scene) if stage is not Stage.CAMERA)
    truth = oracle.render(scene, stages_of(scene))
    base = scene_truth(scene, stages_of(scene), oracle, known=truth)
    shape = base.conditioning.hit.shape
    spoiled = {stage: _Spoiled(**{kind: np.zeros(shape, bool) for kind in _KINDS}) for stage in stages}
    holes: list[str] = []
    for answers, lied in _liars(truth, stages):
        honest = _candidate(answers, order)
        for garbage, images in _garbage(scene, oracle, answers, lied).items():
            for stage, found in _hidden(base, honest, images).items():
                for kind in _KINDS:
                    getattr(spoiled[stage], kind)[...] |= found[kind]
                if found["unseen"].any():
                    row, column = np.argwhere(found["unseen"])[0].tolist()
                    count = int(np.count_nonzero(found["unseen"]))
                    whole = "alone" if len(answers) <= 2 else "of all"
                    holes.append(f"{order.case.name}: {stage} {whole}, {garbage}: {count} pixels, ({column}, {row})")
    return LiarReport(
        case=order.case.name,
        pixels=len(stages) * math.prod(shape),
        holes=tuple(holes[:MOST_HOLES]),
        **{kind: sum(int(np.count_nonzero(getattr(one, kind))) for one in spoiled.values()) for kind in _KINDS},
    )


_KINDS = ("unseen", "wide", "epsilon")


def _liars(truth: StageImages, stages: tuple[Stage, ...]) -> Iterator[tuple[StageImages, tuple[Stage, ...]]]:
    """Yield answers and which of them are spoiled: each stage among all, light's together, radiance with no other."""
    good = rounded(truth)
    for stage in stages:
        yield good, (stage,)
    if Stage.RADIANCE in stages:
        yield good, LIGHT
        yield {stage: good[stage] for stage in (Stage.CAMERA, Stage.RADIANCE)}, (Stage.RADIANCE,)


def _candidate(answers: StageImages, order: LiarOrder) -> Answers:
    """Return a stranger's program that gave these answers, each stage by a pass of its own."""
    return Answers(
        name="liar",
        precision="float32",
        items=ITEMS_OF_OTHERS,
        shadow_epsilon=order.epsilon,
        ray_epsilon=order.epsilon,
        answers=answers,
        chained=False,
    )


def _garbage(
    scene: Scene, oracle: Analytic, answers: StageImages, stages: tuple[Stage, ...]
) -> dict[str, dict[Stage, np.ndarray]]:
    """Return each kind of garbage: for each stage that is spoiled an image of nothing else."""
    found: dict[str, dict[Stage, np.ndarray]] = {
        f"{HUGE:g}": {stage: np.full_like(answers[stage], HUGE) for stage in stages if stage is not Stage.OBJECT},
        "0": {stage: np.zeros_like(answers[stage]) for stage in stages},
        "a miss": {stage: np.full_like(answers[stage], -1.0) for stage in stages if stage is Stage.OBJECT},
        "the neighbour's": {stage: np.roll(answers[stage], 1, axis=1) for stage in stages},
        f"times {SLIGHTLY}": {stage: answers[stage] * SLIGHTLY for stage in stages if stage is not Stage.OBJECT},
    }
    if len(scene.lights) > 1 and Stage.VISIBILITY in answers:
        swapped = answers | {Stage.VISIBILITY: np.roll(answers[Stage.VISIBILITY], 1, axis=-1)}
        for stage in LIGHT:
            swapped[stage] = oracle.continue_from(scene, stage, swapped)
        found["another light's shadow"] = {s: swapped[s] for s in stages if s in (*LIGHT, Stage.VISIBILITY)}
    return {name: images for name, images in found.items() if images}


def _hidden(base: SceneTruth, honest: Answers, lies: Mapping[Stage, np.ndarray]) -> dict[Stage, dict[str, np.ndarray]]:
    """Return where lies hide of each stage, by kind (height, width)."""
    good = honest.answers
    assert good is not None
    spoilt = np.ones(base.conditioning.hit.shape, bool)
    checks: list[Check] = []
    found = None
    for _ in range(ROUNDS):
        images = {stage: np.where(spoilt[..., np.newaxis], lie, good[stage]) for stage, lie in lies.items()}
        found = AgainstOracle(base, replace(honest, answers=good | images))
        checks = _checks(found, next(iter(lies)))
        wrong = _wrong(checks, spoilt.shape)
        if not (spoilt & wrong).any():
            break
        spoilt &= ~wrong
    if found is None or any(check.outcome is Outcome.FAIL for check in checks):
        return {}
    return {check.stage: _by_kind(found, check, spoilt) for check in checks if check.stage in lies}


def _checks(against: AgainstOracle, first: Stage) -> list[Check]:
    """Return the checks of the first stage that is spoiled and of those after it, which are continued from it."""
    witness = Answers(name=ORACLE, precision="float64", independent=True, answers=against.base.truth)
    pair, answers = RendererPair(against, AgainstOracle(against.base, witness)), against.renderer.answers
    order = list(Stage)
    after = [stage for stage in answers if stage is not Stage.CAMERA and order.index(stage) >= order.index(first)]
    with np.errstate(all="ignore"):
        return [stage_check(pair, stage) for stage in after]


def _wrong(checks: list[Check], shape: tuple[int, ...]) -> np.ndarray:
    """Return the pixels (height, width) of which some check says that they are wrong."""
    wrong = np.zeros(shape, bool)
    for check in checks:
        for measured in (check.end_to_end, check.continued):
            if measured is not None:
                wrong |= measured.kinds == Kind.WRONG
    return wrong


def _by_kind(against: AgainstOracle, check: Check, spoilt: np.ndarray) -> dict[str, np.ndarray]:
    """Return where a stage is spoiled, by what the judge says of those pixels."""
    stage, truth = check.stage, against.base.truth
    assert check.end_to_end is not None
    ours, kinds = against.renderer.answers[stage], check.end_to_end.kinds
    limit = against.limits.end_to_end.get(stage, np.zeros(spoilt.shape))
    over = spoilt & (ratios(stage, ours, truth[stage], limit)[0] > 1)
    changed = spoilt & np.any(ours != rounded({stage: truth[stage]})[stage], axis=-1)
    rest = over & (kinds != Kind.EPSILON)
    return {
        "unseen": rest & ~_of_a_side(against, stage, ours, limit, rest),
        "epsilon": over & (kinds == Kind.EPSILON),
        "wide": changed & ~over & (kinds == Kind.WIDE),
    }


def _of_a_side(
    against: AgainstOracle, stage: Stage, ours: np.ndarray, limit: np.ndarray, where: np.ndarray
) -> np.ndarray:
    """Return the pixels of `where` whose value some choice of sides gives: between the least and the most around it."""
    found = np.zeros(where.shape, bool)
    for finely in (False, True):
        rows, columns = np.nonzero(where & ~found)
        if len(rows):
            reach = np.maximum(1.0, reach_of(against)[rows, columns])[:, np.newaxis, np.newaxis]
            offsets = np.concatenate([_square(PLACES) * np.ones_like(reach), _square(PLACES) * reach], axis=1)
            offsets = offsets if finely else _square(COARSELY) * np.ones_like(reach)
            found[rows, columns] = _among_sides(against, stage, ours, limit, (rows, columns), offsets)
    return found


def _square(places: tuple[float, ...]) -> np.ndarray:
    """Return the offsets (n, 2) of a square of samples around a centre, at so many places to either side of it."""
    steps = np.array([*(-place for place in reversed(places)), 0.0, *places])
    return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)


def _among_sides(
    against: AgainstOracle,
    stage: Stage,
    ours: np.ndarray,
    limit: np.ndarray,
    where: tuple[np.ndarray, np.ndarray],
    offsets: np.ndarray,
) -> np.ndarray:
    """Return which pixels (n,) have a value between the least and the most at the offsets (n, samples, 2) [px]."""
    rows, columns = where
    scene, oracle = against.base.scene, against.base.oracle
    points = (np.stack([columns, rows], axis=-1) + 0.5)[:, np.newaxis] + offsets
    around = oracle.at(scene, stages_of(scene)[1:], points.reshape(-1, 2))
    samples = {name: np.asarray(image).reshape(*points.shape[:2], -1) for name, image in around.items()}
    # Where what is seen changes any light may be seen or not: what hides it from one side says nothing of another.
    changing = [np.ptp(samples[name], axis=1).any(axis=1) for name in (Stage.OBJECT,) if name in samples]
    undecided = np.zeros((len(rows), len(scene.lights)), dtype=bool)
    if Stage.VISIBILITY in samples:
        undecided = (np.ptp(samples[Stage.VISIBILITY], axis=1) > 0) | changing[0][:, np.newaxis]
        # Nor does anybody know of a light in the plane of what it lights.
        here = {name: against.base.truth[name][rows, columns] for name in (Stage.POSITION, Stage.NORMAL)}
        for index, light in enumerate(scene.lights):
            way = np.asarray(light.position) - here[Stage.POSITION]
            cosine = np.abs(np.sum(way * here[Stage.NORMAL], axis=1))
            off = against.limits.cosine[rows, columns, index] * np.linalg.norm(way, axis=1)
            undecided[:, index] |= cosine <= off
    least, most = _range(scene, stage, samples, undecided, against.limits.cosine[rows, columns])
    value = ours[rows, columns]
    slack = limit if limit.ndim == 3 else limit[..., np.newaxis]
    slack = 2 * np.max(slack[rows, columns], axis=-1, keepdims=True) + 2 * UNIT_ROUNDOFF["float32"] * np.abs(value)
    within = (value >= least - slack) & (value <= most + slack)
    if stage in (Stage.OBJECT, Stage.VISIBILITY):
        within &= value == np.round(value)
    return np.all(within, axis=-1)


def _range(
    scene: Scene, stage: Stage, samples: Mapping[Stage, np.ndarray], undecided: np.ndarray, off: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest value around each pixel (pixels, channels).

    `undecided` (pixels, lights) are lights that may be seen or not, and their cosines are `off` (pixels, lights).
    """
    if stage is Stage.VISIBILITY:
        values = samples[stage]
        return np.where(undecided, 0.0, values.min(axis=1)), np.where(undecided, 1.0, values.max(axis=1))
    if stage not in LIGHT:
        return samples[stage].min(axis=1), samples[stage].max(axis=1)
    least = most = np.zeros((*samples[Stage.POSITION].shape[:2], 3))
    for index, light in enumerate(scene.lights):
        toward = np.asarray(light.position) - samples[Stage.POSITION]
        with np.errstate(all="ignore"):
            r = np.linalg.norm(toward, axis=-1)
            cosine = np.clip(np.sum(toward * samples[Stage.NORMAL], axis=-1) / r, 0, None)
            straight = np.ones_like(r) if scene.shading == "simplified" else 1 / (4 * math.pi * r**2)
            # In the plane of what it lights a light may be a little above it: how little only rounding knows.
            higher = straight * (cosine + off[:, index : index + 1])
        arriving, above = (
            np.nan_to_num(share)[..., np.newaxis] * np.asarray(light.flux) for share in (straight * cosine, higher)
        )
        seen = samples[Stage.VISIBILITY][..., index : index + 1]
        either = undecided[:, np.newaxis, index : index + 1]
        least, most = least + np.where(either, 0.0, seen * arriving), most + np.where(either, above, seen * arriving)
    if stage is not Stage.IRRADIANCE:
        table = np.array([shape.albedo for shape in scene.shapes] + [(0.0, 0.0, 0.0)])
        albedo = table[samples[Stage.OBJECT][..., 0].astype(int)]
        least, most = least * albedo, most * albedo
    if stage is Stage.RADIANCE:
        share = 1.0 if scene.shading == "simplified" else 1 / math.pi
        # The back of a surface that has one side only is black, and so may be what lies beside it.
        dark = (samples[Stage.EXITANCE] > 0) & (samples[Stage.RADIANCE] == 0)
        least, most = np.where(dark, 0.0, least * share), np.where(dark, 0.0, most * share)
    return least.min(axis=1), most.max(axis=1)
