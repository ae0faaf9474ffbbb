"""Two mistakes of a renderer that writes radiance alone, searched in a few pixels of a few failing cases.

There nothing says at which stage a mistake was made. But mistakes seldom show in the same cases: where a scene has no
cube, a mistake of cubes shows nothing, and the other alone explains the image. So a mistake is looked for that explains
some case, and another that explains with it a case which it leaves; where there is none, of those that always show, all
are tried together.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rayproof.cases.scene import SceneError
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reports.diagnosis import MISTAKES, Given, Way
from rayproof.reports.diagnosis.answering import LIGHT, Unanswerable, follows
from rayproof.reports.diagnosis.clock import Clock
from rayproof.reports.diagnosis.hypotheses import Hypothesis, bound, middle, together
from rayproof.reports.diagnosis.trial import Evidence
from rayproof.reports.diagnosis.trial_by_stages import concerned, work

WRONG, RIGHT = 80, 40  # pixels of a case that are looked at
NEAR = 1e-3  # relative: what is no farther off is the same; limits are asked of what is left
AGREE = 0.97  # of the pixels
SIMPLE = 8  # failing cases, the simplest of the first so many
AMONG = 40
FIRST = 10  # mistakes that explain some case, beside which others are looked for


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Some pixels of a case."""

    evidence: Evidence
    _kept: dict = field(default_factory=dict)

    @cached_property
    def places(self) -> np.ndarray:
        """Return which pixels, by number: wrong ones and others, none beside an edge of the right answer."""
        plain = ~np.ravel(self.evidence.right.edge)
        chosen = np.random.default_rng(1)
        wrong = np.ravel(self.evidence.wrong) & plain
        found = []
        for some, most in ((wrong, WRONG), (plain & ~wrong, RIGHT)):
            among = np.flatnonzero(some)
            found.append(chosen.choice(among, min(most, len(among)), replace=False))
        return np.concatenate(found)

    def _taken(self, image: np.ndarray) -> np.ndarray:
        return np.asarray(image, dtype=np.float64).reshape(-1, image.shape[-1])[self.places][np.newaxis]

    @cached_property
    def ours(self) -> np.ndarray:
        """Return the renderer's radiance there, (1, pixels, 3)."""
        return self._taken(self.evidence.ours[Stage.RADIANCE])

    def answers(self, way: Way) -> StageImages | None:
        """Return what a way answers there, (1, pixels, channels); None where it has no answer."""
        key = id(way)
        if key not in self._kept:
            try:
                self._kept[key] = way, self._answers(way)
            except (Unanswerable, SceneError, ValueError, OverflowError):
                self._kept[key] = way, None
        return self._kept[key][1]

    def _answers(self, way: Way) -> StageImages:
        scene = self.evidence.scene if way.asked is None else way.asked(self.evidence.scene)
        oracle = self.evidence.oracle
        rays = self.evidence.right.answers[Stage.RAY]
        if scene.camera != self.evidence.scene.camera:
            rays = oracle.continue_from(scene, Stage.RAY, {})
        if Stage.RAY in way.stages:
            rays = way.stages[Stage.RAY](Given(scene=scene, answers={}, right=rays, parameter=0.0))
        found: StageImages = {Stage.RAY: self._taken(rays)}
        small = replace(scene, camera=replace(scene.camera, width=len(self.places), height=1))
        with np.errstate(all="ignore"):
            for stage in IMAGE_STAGES[1:]:
                formulas = concerned(way.formulas, scene, stage)
                value = follows(replace(way, formulas=formulas), small, stage, found, oracle)
                if stage in way.stages:
                    value = way.stages[stage](Given(scene=small, answers=found, right=value, parameter=0.0))
                found[stage] = value
        return found

    def agrees(self, way: Way) -> bool | None:
        """Say whether the renderer has a way's radiance; None where the way has no answer."""
        answers = self.answers(way)
        if answers is None:
            return None
        value, finite = answers[Stage.RADIANCE], float(np.nanmax(np.abs(self.ours), initial=0.0))
        with np.errstate(all="ignore"):
            near = np.abs(value - self.ours) <= NEAR * np.abs(value) + 1e-6 * finite
        same = np.all(near | np.isnan(value) | (value == self.ours), axis=-1)
        return bool(np.count_nonzero(same) >= AGREE * same.size)

    def telling_apart(self, way: Way, other: Way) -> bool:
        """Say whether two ways have other radiance somewhere."""
        one, two = self.answers(way), self.answers(other)
        if one is None or two is None:
            return one is not two
        return not np.allclose(one[Stage.RADIANCE], two[Stage.RADIANCE], rtol=1e-6, atol=0, equal_nan=True)

    def telling(self, way: Way, other: Way) -> int:
        """Return in how many pixels the renderer has a way's radiance, which is not another's."""
        one, two = self.answers(way), self.answers(other)
        if one is None or two is None:
            return 0
        value, theirs = one[Stage.RADIANCE], two[Stage.RADIANCE]
        with np.errstate(all="ignore"):
            here = np.abs(value - self.ours) <= NEAR * np.abs(value)
            apart = np.abs(value - theirs) > 2 * NEAR * np.abs(value)
        return int(np.count_nonzero(np.any(apart, axis=-1) & np.all(here, axis=-1)))

    def with_parameters(self, known: Sequence[Hypothesis], beside: Way) -> list[Hypothesis]:
        """Return the mistakes that have a parameter as it is estimated here, beside another way."""
        right = self.answers(beside)
        found = []
        for name in MISTAKES if right is not None else ():
            fit, way = MISTAKES[name].fit, MISTAKES[name].ways[0]
            if fit is None or fit.grid:
                continue
            samples = fit.samples(self.evidence.scene, right or {}, {Stage.RADIANCE: self.ours})
            value = middle([samples], fit.nothing)
            if value is not None:
                found.append(Hypothesis(mistakes=(name,), parameters={name: value}, way=bound(way, value)))
        return found


def sampled(evidence: Sequence[Evidence]) -> list[Sampled]:
    """Return the cases that have light and radiance."""
    return [Sampled(evidence=one) for one in evidence if one.scene.lights and Stage.RADIANCE in one.stages]


def pairs_of(cases: Sequence[Sampled], plain: Sequence[Hypothesis], clock: Clock) -> Iterator[Hypothesis]:
    """Yield pairs of mistakes that a few pixels do not contradict; `plain` are the mistakes without a parameter.

    `cases` are failing ones.
    """
    look = sorted(cases[:AMONG], key=lambda case: work(case.evidence.scene))[:SIMPLE]
    quick = [one for one in plain if not one.way.formulas]
    fits: list[tuple[int, Hypothesis]] = []
    for case in look:
        for one in case.with_parameters(plain, Way()):
            if case.agrees(one.way) and not any(_same(one, other) for _, other in fits):
                fits.append((sum(other.agrees(one.way) is True for other in look), one))
    for one in quick:
        count = sum(not clock.over and case.agrees(one.way) is True for case in look)
        if count:
            fits.append((count, one))
    firsts = _alike([one for _, one in sorted(fits, key=lambda pair: -pair[0])], look)[:FIRST]
    found = False
    for alike in firsts:
        first = alike[0]
        left = [case for case in look if case.agrees(first.way) is False] or _contradicting(first, cases, clock)
        if not left:
            continue
        for second in [*left[0].with_parameters(plain, first.way), *quick, *_traced(plain, left[0])]:
            if clock.over or not any(_agree(pair.way, left[:1]) for pair in together(first, second)):
                continue
            for pair in (pair for one in alike for pair in together(one, second)):
                if _agree(pair.way, [*left[:3], *look[:3]]):
                    found = True
                    yield pair
        if found:
            return
    yield from _always(look, quick, plain, clock)


def classes(found: Sequence[Hypothesis], cases: Sequence[Sampled]) -> list[list[Hypothesis]]:
    """Return the pairs that the sampled pixels of no case contradict, those of the same pixels together."""
    return _alike([one for one in found if not any(case.agrees(one.way) is False for case in cases)], cases)


def _alike(some: Sequence[Hypothesis], cases: Sequence[Sampled]) -> list[list[Hypothesis]]:
    """Return the hypotheses so that those of the same radiance in all cases stand together."""
    found: list[list[Hypothesis]] = []
    for one in some:
        for alike in found:
            if not any(case.telling_apart(one.way, alike[0].way) for case in cases):
                alike.append(one)
                break
        else:
            found.append([one])
    return found


def tells(one: Hypothesis, cases: Sequence[Sampled], least: int) -> bool:
    """Say whether so many pixels tell two mistakes from each of them alone."""
    return all(sum(case.telling(one.way, alone) for case in cases) >= least for alone in one.way.parts)


def _always(
    look: Sequence[Sampled], quick: Sequence[Hypothesis], plain: Sequence[Hypothesis], clock: Clock
) -> Iterator[Hypothesis]:
    """Yield pairs of mistakes that both show in every case: one of light or of the camera with any other."""
    if not look:
        return
    light = [one for one in quick if one.way.stages and set(one.way.stages) <= set(LIGHT)]
    camera = [one for one in quick if set(one.way.stages) == {Stage.RAY}]
    for first in quick:
        for second in look[0].with_parameters(plain, first.way):
            for pair in () if clock.over else together(first, second):
                if _agree(pair.way, look[:3]):
                    yield pair
    for some in (light, camera):
        for first in some:
            for second in quick:
                for pair in () if clock.over else together(first, second):
                    if _agree(pair.way, look[:3]):
                        yield pair


def _agree(way: Way, cases: Sequence[Sampled]) -> bool:
    some = False
    for case in cases:
        agrees = case.agrees(way)
        if agrees is False:
            return False
        some |= agrees is True
    return some


def _contradicting(one: Hypothesis, cases: Sequence[Sampled], clock: Clock) -> list[Sampled]:
    """Return the simplest cases that contradict a mistake."""
    found = []
    for case in sorted(cases, key=lambda case: work(case.evidence.scene)):
        if clock.over or len(found) == 3:
            break
        if case.agrees(one.way) is False:
            found.append(case)
    return found


def _traced(plain: Sequence[Hypothesis], case: Sampled) -> Iterator[Hypothesis]:
    """Yield the mistakes that the tracer answers for, where they concern a case; of each what differs there."""
    seen = set()
    for one in plain:
        formulas = {
            item for stage in IMAGE_STAGES for item in concerned(one.way.formulas, case.evidence.scene, stage).items()
        }
        key = one.mistakes, frozenset(formulas)
        if formulas and key not in seen:
            seen.add(key)
            yield one


def _same(one: Hypothesis, other: Hypothesis) -> bool:
    if one.mistakes != other.mistakes:
        return False
    return all(abs(value - other.parameters[name]) <= NEAR * abs(value) for name, value in one.parameters.items())
