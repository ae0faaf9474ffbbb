"""Which verdicts of a case are wrong: about a renderer that is right, or for one that is not.

A failure stands if one value at least is outside the limit of its certified enclosure, and no scene within rounding
has it; it is wrong if none is. A pass is wrong if such a value exists. A reference under suspicion is a failure of
that reference. What is a tie in exact numbers is nobody's fault and counts as undecided.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TypedDict, cast

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.certified.camera import camera_answer
from rayproof.reference.certified.stages import continued
from rayproof.reports.judge import camera_check
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.forward.common_factors import bias
from rayproof.reports.judge.forward.limits import HIT, MATRICES, RAY, Roundoff
from rayproof.reports.judge.measurement import jsonable, ratios
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.scene_truth import SceneTruth, scene_truth
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.results.case_records import Check, Measurement, Number
from rayproof.reports.results.outcomes import Outcome, worst
from tests.harness.verdicts.judged_values import CERTIFIED, GEOMETRY, Held, Pixel, certified_answers
from tests.harness.verdicts.perturbed import CORNERS, perturbed

UNMEASURED = frozenset({Outcome.ERROR, Outcome.MISSING, Outcome.UNDECIDED})
MOST_NAMED = 3  # wrong verdicts a renderer and case that are listed with their pixel
SAMPLE = 200  # pixels by which a scene is called decidable
STEADY = 0.5  # the share of them that must be the same in every scene within rounding
TRIALS = 8  # pairs of scenes
CONSPIRING = 32  # roundings by which these scenes differ: limits count 16, all one way, and what is drawn seldom is

BAKED = CORNERS * UNIT_ROUNDOFF["float32"]  # of its size, by which a triangle's corner is off for everybody


class WrongVerdictRecord(TypedDict, total=False):
    """A verdict that certified arithmetic contradicts, with the pixel that shows it."""

    case: str
    configuration: str
    reference: str | None
    stage: str
    pixel: list[int] | None
    value: list[Number] | None
    enclosure: list[list[Number]] | None  # low and high of each channel
    verdict: str
    why: str


class CertifiedRecord(TypedDict, total=False):
    """What certified arithmetic says of a case's verdicts; the last four are of somebody who was tried beside."""

    wrong: list[WrongVerdictRecord]
    undecided: list[str]
    undecidable: list[str]
    abstained: list[str]
    stopped: list[str]
    why: str | None
    seconds: float
    tried: str
    verdict: str
    stage: str | None
    reason: str | None


@dataclass(frozen=True, kw_only=True)
class WrongVerdict:
    """A verdict that certified arithmetic contradicts, with the pixel that shows it."""

    case: str
    configuration: str
    reference: str | None  # held against whom; None: of the verdict as a whole
    stage: str
    pixel: Pixel | None
    value: list[float | str] | None
    enclosure: list[list[float | str]] | None  # low and high of each channel
    verdict: str
    why: str


@dataclass(frozen=True, kw_only=True)
class Certified:
    """What certified arithmetic says of a case's verdicts."""

    wrong: tuple[WrongVerdict, ...] = ()
    undecided: tuple[str, ...] = ()  # configurations whose verdict is that nothing could be judged, though it can be
    undecidable: tuple[str, ...] = ()  # the same where rounding decides most of what is seen
    abstained: tuple[str, ...] = ()  # references that left checks undecided by what they declare not to see
    stopped: tuple[str, ...] = ()  # who left checks unmeasured because its time was over
    why: str | None = None  # why nothing was certified
    seconds: float = 0.0

    def as_json(self) -> CertifiedRecord:
        """Return plain JSON data."""
        return cast("CertifiedRecord", asdict(self))


@dataclass(kw_only=True)
class Inquest:
    """One case's parties before certified arithmetic."""

    case: Case
    base: SceneTruth
    truth: dict[Stage, np.ndarray]
    held: dict[str, Held] = field(default_factory=dict)
    known: dict[tuple[str, bool, Pixel], tuple[Stage, ...]] = field(default_factory=dict)
    shares: dict[tuple[str, bool, float], float] = field(default_factory=dict)

    def of(self, party: Answers) -> Held:
        """Return a party's values, held against certified ones."""
        if party.name not in self.held:
            self.held[party.name] = Held(base=self.base, truth=self.truth, party=party)
        return self.held[party.name]

    def wrong_at(
        self, party: Answers, pixels: Sequence[Pixel], *, strictly: bool = False
    ) -> dict[Pixel, tuple[Stage, ...]]:
        """Return of pixels the stages at which a party is wrong; only those with any."""
        key = (party.name, strictly)
        new = [pixel for pixel in dict.fromkeys(pixels) if (*key, pixel) not in self.known]
        found = self.of(party).wrong(new, strictly=strictly)
        self.known |= {(*key, pixel): found.get(pixel, ()) for pixel in new}
        return {pixel: self.known[*key, pixel] for pixel in pixels if self.known[*key, pixel]}

    def decidable(self, candidate: Answers, check: Check, witnesses: Sequence[Answers]) -> bool:
        """Return whether most of what a check asks about is the same in every scene within rounding.

        A check is no more decidable than the coarser of its two parties.
        """
        witness = next((witness for witness in witnesses if witness.name == check.reference), None)
        other = witness.precision if witness is not None else "float64"
        precision = max((candidate.precision, other), key=lambda precision: UNIT_ROUNDOFF[precision])
        by_matrices = [party.precision for party in (candidate, witness) if party is not None and party.by_matrices]
        matrices = max((UNIT_ROUNDOFF[one] for one in by_matrices), default=0.0)
        key = precision, check.stage not in GEOMETRY, matrices
        if key not in self.shares:
            # Where which of several surfaces is hit is a tie, something is.
            rows, columns = np.nonzero(~(self.truth[Stage.OBJECT][..., 0] < 0))
            chosen = np.unique(np.linspace(0, len(rows) - 1, SAMPLE).astype(int)) if len(rows) else []
            pixels = np.stack([columns, rows], axis=-1)[chosen]
            self.shares[key] = steady(self, pixels, *key) if len(pixels) else 0.0
        return self.shares[key] >= STEADY

    def report(self, party: str, check: Check | None, stage: Stage, pixel: Pixel | None, verdict: Outcome, why: str):
        """Return a wrong verdict with value and enclosure at the pixel."""
        value = enclosure = None
        answers = self.held[party].party.answers if party in self.held else None
        if pixel is not None and stage is not Stage.CAMERA and answers and stage in answers:
            value = jsonable(tuple(map(float, np.atleast_1d(answers[stage][pixel[1], pixel[0]]))))
            record = CERTIFIED.enclose(self.base.scene, [stage], [pixel], exactly=False)[0]
            enclosure = [jsonable(tuple(map(float, pair))) for pair in record["stages"][str(stage)]]
        return WrongVerdict(
            case=self.case.name,
            configuration=party,
            reference=check.reference if check is not None else None,
            stage=str(stage),
            pixel=pixel,
            value=value,
            enclosure=enclosure,
            verdict=verdict.value,
            why=why,
        )


def certify(
    judged: Judged,
    candidates: Sequence[Answers],
    witnesses: Sequence[Answers],
    oracle: Analytic,
    *,
    planted: bool = False,
) -> Certified:
    """Return which of a case's verdicts are wrong, and which are missing where there is one to be had.

    `planted` says that the candidates are known to be wrong: to fail them is right, even if no pixel proves it.
    """
    scene, stages = judged.case.scene, stages_of(judged.case.scene)
    images = tuple(stage for stage in stages if stage is not Stage.CAMERA)
    truth = certified_answers(scene, images)
    if truth is None:
        return Certified(why="The scene has too many triangles to certify whole images.")
    known = next((witness.answers for witness in witnesses if witness.name == ORACLE), {})
    base = scene_truth(scene, stages, oracle, known=known)
    inquest = Inquest(case=judged.case, base=base, truth=truth)
    wrong: list[WrongVerdict] = []
    decided: dict[str, bool] = {}  # of whom checks are undecided: whether one of them could be decided
    abstained: set[str] = set()
    stopped: set[str] = set()
    for candidate in candidates:
        checks = [check for check in judged.checks if check.configuration == candidate.name]
        outcome = worst([check.outcome for check in checks])
        if any(check.outcome is Outcome.WARN and not check.finding for check in checks):
            # The warning says that this epsilon alone leaves pixels undecided, and that their values are its sides.
            inquest.held[candidate.name] = replace(inquest.of(candidate), granted=np.inf)
        if candidate.error is not None or (planted and outcome is Outcome.FAIL):
            pass
        elif outcome is Outcome.FAIL:
            wrong += _accused(inquest, candidate, [check for check in checks if check.outcome is Outcome.FAIL])
        else:
            wrong += _passed(inquest, candidate, outcome)
        found = [check for check in checks if check.outcome in UNMEASURED]
        stopped |= {_stopped_of(check, candidate) for check in found if check.stopped}
        abstained |= {check.reference for check in found if check.abstains and not check.stopped}
        found = [check for check in found if not (check.abstains or check.stopped)]
        if found:
            decided[candidate.name] = any(inquest.decidable(candidate, check, witnesses) for check in found)
    for witness in witnesses:
        checks = [check for check in judged.checks if _blamed(check) == witness.name]
        if checks and witness.error is None:
            wrong += _accused(inquest, witness, checks)
    return Certified(
        wrong=tuple(wrong),
        undecided=tuple(name for name, decidable in decided.items() if decidable),
        undecidable=tuple(name for name, decidable in decided.items() if not decidable),
        abstained=tuple(sorted(abstained)),
        stopped=tuple(sorted(stopped)),
    )


def _stopped_of(check: Check, candidate: Answers) -> str:
    """Return which party's time was over."""
    return candidate.name if candidate.stopped else check.reference


def _blamed(check: Check) -> str | None:
    """Return whom a check that does not fail accuses: nobody by a warning that is of no finding.

    Such a warning counts the pixels that the one under test leaves undecided by its epsilon, and says that all values
    hold.
    """
    if check.outcome is Outcome.REFERENCE_SUSPECT or (check.outcome is Outcome.WARN and check.finding):
        return check.suspected or check.reference
    return None


def _passed(inquest: Inquest, candidate: Answers, outcome: Outcome) -> list[WrongVerdict]:
    """Return the wrong verdicts on a renderer that nobody failed: values that are nobody's within rounding."""
    held = inquest.of(candidate)
    wrong = inquest.wrong_at(candidate, held.chosen, strictly=True)
    found = [
        inquest.report(
            candidate.name,
            None,
            stages[0],
            pixel,
            outcome,
            f"{', '.join(map(str, stages))}: outside the limit of the certified value, and no scene within rounding "
            "has it, but nothing failed",
        )
        for pixel, stages in wrong.items()
    ]
    if candidate.answers and Stage.CAMERA in candidate.answers and _camera_ratio(inquest, candidate) > 1:
        found.append(inquest.report(candidate.name, None, Stage.CAMERA, None, outcome, "the camera is wrong"))
    return found[:MOST_NAMED]


def _accused(inquest: Inquest, party: Answers, checks: Sequence[Check]) -> list[WrongVerdict]:
    """Return the wrong verdicts on a renderer that was failed or put under suspicion, none if one check is right."""
    held = inquest.of(party)
    found: list[WrongVerdict] = []
    for check in checks:
        if _stands(inquest, party, check):
            return []
        measured = [one for one in (check.end_to_end, check.continued) if one is not None and one.worst_ratio > 1]
        pixel = max(measured, key=lambda one: one.worst_ratio).pixel if measured else None
        why = f"{check.reason}; but no value is outside its certified limit for certain"
        found.append(inquest.report(party.name, check, check.stage, pixel, check.outcome, why))
    if inquest.wrong_at(party, held.chosen):
        return []
    return list({(one.stage, one.pixel): one for one in found}.values())[:MOST_NAMED]


def _stands(inquest: Inquest, party: Answers, check: Check) -> bool:
    """Return whether certified arithmetic bears out what one check says of a party."""
    if check.stage is Stage.CAMERA:
        return _camera_ratio(inquest, party) > 1
    answers = party.answers
    if check.end_to_end is None:
        # An image of another size is wrong without being measured; a copy is none.
        return check.stage in answers and check.stage not in inquest.of(party).stages
    image = np.asarray(answers.get(check.stage, 0.0))
    if np.isnan(image).any():
        return True
    measured = check.end_to_end
    pixel = measured.pixel if not measured.worst_ratio <= 1 else None
    if pixel is not None and check.stage in inquest.wrong_at(party, [pixel]).get(pixel, ()):
        return True
    if _biased(inquest, party, check):
        return True
    own = check.continued
    return own is not None and not own.worst_ratio <= 1 and _stands_alone(inquest, party, check.stage, own)


def _biased(inquest: Inquest, party: Answers, check: Check) -> bool:
    """Return whether a factor that many pixels share, and that a check found off, is so against certified values."""
    held, stage = inquest.of(party), check.stage
    ours, factors = np.asarray(party.answers.get(stage)), held.against.common_factors
    if check.bias is not None and check.bias.ratio > 1:
        base = inquest.base
        exact = SceneTruth(
            scene=base.scene,
            truth=base.truth | held.exact.answers,
            conditioning=base.conditioning,
            oracle=base.oracle,
        )
        explained = factors.explained.get(stage)
        if bias(AgainstOracle(exact, party).common_factors, stage, ours, None, explained).ratio > 1:
            return True
    if check.bias is None or check.bias.continued is None or not check.bias.continued.ratio > 1:
        return False
    value = CERTIFIED.continue_from(inquest.base.scene, stage, party.answers)
    return bias(factors, stage, ours, value, None).ratio > 1


def _stands_alone(inquest: Inquest, party: Answers, stage: Stage, measured: Measurement) -> bool:
    """Return whether a stage is wrong given the party's own previous ones, as certified arithmetic continues them."""
    answers = party.answers
    if answers is None or measured.pixel is None:
        return False
    column, row = measured.pixel
    held = inquest.of(party)
    given = {name: np.asarray(answers[name], dtype=np.float64)[row, column][np.newaxis] for name in held.stages}
    ours = np.asarray(answers[stage], dtype=np.float64)
    if stage is Stage.RAY:
        expected = inquest.truth[stage][row, column]
    else:
        expected = continued(inquest.base.scene, stage, given)[0]
    if np.isnan(expected).any():
        return False
    # Limits are made for images: this one pixel's expected value in an image of the party's own.
    value = ours.copy()
    value[row, column] = expected
    limit = held.against.continued_limit(stage, value)
    if ratios(stage, ours, value, limit)[0][row, column] <= 1:
        return False
    if stage in (Stage.OBJECT, Stage.VISIBILITY, Stage.DISTANCE, Stage.NORMAL):
        # Who took the other side of an edge than exact arithmetic continues to: end to end says whether it is one.
        return stage in inquest.wrong_at(party, [measured.pixel]).get(measured.pixel, ())
    return True


def _camera_ratio(inquest: Inquest, party: Answers) -> float:
    """Return error over limit of a party's camera against the certified one."""
    view = inquest.base.scene.camera
    mine = party.answers.get(Stage.CAMERA)
    if mine is None:
        return 0.0
    return camera_check.compared(mine, camera_answer(view), view, Roundoff(party.precision)).ratio


def steady(inquest: Inquest, pixels: np.ndarray, precision: str, lit: bool, matrices: float) -> float:
    """Return the share of pixels (n, 2) whose discrete answers no perturbation of CONSPIRING roundings changes.

    `lit` says that the lights count. Scenes come in pairs of opposite ones, so that no tie stays on one side by chance.
    `matrices` is the unit roundoff of who makes rays by CAM-5's matrices, 0 if nobody does: they move the pixels'
    centres where the near plane is close to the eye.
    """
    scene, truth, conditioning = inquest.base.scene, inquest.truth, inquest.base.conditioning
    stages = tuple(stage for stage in (Stage.OBJECT, Stage.VISIBILITY)[: 1 + lit] if stage in truth)
    amount, same = CONSPIRING * UNIT_ROUNDOFF[precision], np.ones(len(pixels), dtype=bool)
    columns, rows = pixels.T
    eye = float(np.linalg.norm(scene.camera.eye)) / scene.camera.near
    reach = (
        CONSPIRING * matrices * MATRICES / RAY * eye * (conditioning.axial / conditioning.pixel_angle)[rows, columns]
    )
    if Stage.VISIBILITY in stages:
        # A hit is off its surface, to either side, by what rounding lifts it; no scene's own hits are.
        lifted = CONSPIRING / HIT * inquest.base.limits(Roundoff(precision), by_matrices=False).lifted[rows, columns]
        hit = {stage: truth[stage][rows, columns] for stage in (Stage.OBJECT, Stage.POSITION, Stage.NORMAL)}
        for way in (1, -1):
            off = hit | {Stage.POSITION: hit[Stage.POSITION] + way * lifted[:, np.newaxis] * hit[Stage.NORMAL]}
            same &= (continued(scene, Stage.VISIBILITY, off) == truth[Stage.VISIBILITY][rows, columns]).all(axis=1)
    for number in range(TRIALS):
        for way in (1, -1):
            generator = np.random.default_rng(number)
            near = perturbed(scene, generator, way * amount, unshared=number % 2 == 1, turned=True, corners=BAKED)
            points = pixels + 0.5 + way * reach[:, np.newaxis] * generator.uniform(-1, 1, pixels.shape)
            found = CERTIFIED.at(near, stages, points, exactly=False)
            for stage in stages:
                same &= (found[stage] == truth[stage][rows, columns]).all(axis=1)
    return float(same.mean())
