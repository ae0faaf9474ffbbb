"""From a run's records to points: which items are wrong, so that each mistake costs its own item once.

A failing case says that one of some items is wrong. With its stages written a program is judged at each stage as it
follows from the program's own earlier ones, so that a case may say this of several stages. What a proven mistake
explains costs the mistake's item alone. The rest is explained by as few items as can be, preferring one that is seldom
right elsewhere; items between which nothing decides are left to the teacher.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from rayproof.cases.case import STORING
from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis.diagnosing import CHANGING
from rayproof.reports.diagnosis.stage_by_stage import Shared
from rayproof.reports.grading.rubric import Rubric, covered_items, graded_items
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.verdict import COMPUTED, possible_items
from rayproof.reports.results.case_records import CaseRecord, Check, ratio_of
from rayproof.reports.results.files import at_worst
from rayproof.reports.results.outcomes import MEASURED, Outcome
from rayproof.reports.results.records import CauseRecord, RunRecord

# Of a camera that is fitted as a whole: the words of what is found by which an item is concerned. Its size is CAM-2's.
OF_CAMERAS = {
    "CAM-1": ("turned by", "the length of", "the distance from eye"),
    "CAM-3": ("shifted by", "of n pixels", "first pixel's corner"),
}
OF_FEELERS = frozenset(COMPUTED[Stage.VISIBILITY]) - frozenset(COMPUTED[Stage.OBJECT])
FEWEST = 2  # cases beyond those of a mistake that is charged, in which another one has to show
MOSTLY = 0.5  # of an item's cases: by radiance alone, one that is wrong in more of them is open whatever else is wrong
GARBLED = 0.9  # of the failing cases: where so many are wrong at most stages, the images are stored wrongly
CUTS = (": this explains", ": in ")  # where a cause's sentence begins to speak of cases


class State(StrEnum):
    """The result of an item."""

    EARNED = "earned"
    WRONG = "wrong"
    UNDECIDED = "undecided"
    UNSUPPORTED = "unsupported"
    MISSING = "missing"
    ERROR = "error"


@dataclass(frozen=True, kw_only=True)
class ItemGrade:
    """The points of one item, and why they are not all there."""

    item: str
    of: float
    state: State
    sentence: str = ""
    stage: str | None = None  # at which it shows
    cases: tuple[str, ...] = ()  # in which it shows, the worst first

    @property
    def points(self) -> float:
        """Return what is earned."""
        return self.of if self.state is State.EARNED else 0.0


@dataclass(frozen=True, kw_only=True)
class Clause:
    """A case in which one of some items is wrong at a stage, and how far off it is."""

    case: str
    stage: Stage
    items: frozenset[str]
    possible: frozenset[str]  # with those that the case does not ask for, and which may show all the same
    ratio: float


@dataclass
class _Ledger:
    """What speaks for and against the items."""

    right: dict[str, set[str]] = field(default_factory=dict)  # item -> cases in which it is right
    grades: dict[str, ItemGrade] = field(default_factory=dict)


def grades(
    results: RunRecord | None, rubric: Rubric, shared: Sequence[Shared] = (), *, problem: str = ""
) -> list[ItemGrade]:
    """Return each item's grade; without results, because of a `problem`, nothing is earned.

    `shared` are mistakes that explain some stages of cases that no proven mistake explains.
    """
    points = rubric.points.items()
    if results is None:
        return [ItemGrade(item=item, of=of, state=State.ERROR, sentence=problem) for item, of in points]
    cases, causes = {str(case["name"]): case for case in results["cases"]}, _proven(results)
    # A mistake is named only if no case contradicts it: failing cases that it does not explain say nothing against it.
    explained = {name for name, case in cases.items() if causes and case["verdict"] == Outcome.FAIL}
    ledger, clauses, staged = _Ledger(), [], False
    for name, case in cases.items():
        staged |= _staged(case)
        _acquit(ledger, name, case, explained)
        if case["verdict"] == Outcome.FAIL and name not in explained:
            clauses += _clauses(case)
    for cause in causes:
        _charge_cause(ledger, cause, cases)
    proven = frozenset(item for item, grade in ledger.grades.items() if grade.state is State.WRONG)
    failing = {clause.case for clause in clauses}
    if staged and sum(_garbled(cases[name]) for name in failing) > GARBLED * len(failing):
        # Under which nothing else can be judged.
        said = "Most stages are wrong by themselves: the images are stored in another way."
        _charge(ledger, STORING, State.WRONG, said, _worst_first(cases, sorted(failing)))
        clauses = [replace(clause, possible=clause.possible | {STORING}) for clause in clauses]
    else:
        _explain(ledger, _share_out(ledger, clauses, shared, proven), staged=staged)
    _credit(ledger, clauses)
    if not staged:  # which a scene without light shows nothing of
        cases = {name: case for name, case in cases.items() if case.get("lights") != 0}
    _charge_unmeasured(ledger, cases, rubric)
    _charge_changes(ledger, cases)
    return [_grade(ledger, item, of, cases, rubric) for item, of in points]


def unexplained(results: RunRecord) -> set[str]:
    """Return the failing cases of a program that writes its stages where no mistake is proven; else none."""
    failing = {str(case["name"]) for case in results["cases"] if case["verdict"] == Outcome.FAIL and _staged(case)}
    return set() if _proven(results) else failing


def _proven(results: RunRecord) -> list[CauseRecord]:
    """Return the mistakes that are proven; that images change from call to call proves nothing about a formula."""
    return [cause for cause in results.get("diagnosis", []) if cause["mistake"] not in (None, CHANGING)]


def _own(case: CaseRecord) -> list[Check]:
    """Return a program's checks before the oracle."""
    return [check for check in case.get("checks", []) if check.reference == ORACLE]


def _staged(case: CaseRecord) -> bool:
    """Say whether anything but radiance was written and measured."""
    return any(check.outcome in MEASURED and check.stage != Stage.RADIANCE for check in _own(case))


def _alone(check: Check) -> float:
    """Return by how much a stage is beyond its limit given the program's own earlier stages; 0 where it is within."""
    if check.outcome != Outcome.FAIL:
        return 0.0
    measured, bias = check.continued, check.bias and check.bias.continued
    ratios = [at_worst(measured.worst_ratio if measured else 0.0), at_worst(bias.ratio if bias else 0.0)]
    return max(ratio if ratio > 1 else 0.0 for ratio in ratios)


def _garbled(case: CaseRecord) -> bool:
    """Say whether most stages are wrong by themselves: nothing shows that images are stored as they should be."""
    written = [check for check in _own(case) if check.outcome in MEASURED]
    return 2 * sum(_alone(check) > 0 for check in written) > len(written) > 1


def _covers(case: CaseRecord) -> tuple[str, ...]:
    return (*graded_items(case.get("covers", [])), STORING)


def _acquit(ledger: _Ledger, name: str, case: CaseRecord, explained: set[str]) -> None:
    """Note which items are right in a case: all if it passes, or fails by a proven mistake; else by their stages."""
    verdict = Outcome(case["verdict"])
    if verdict in (Outcome.PASS, Outcome.WARN) or name in explained:
        found: Iterable[str] = _covers(case)
    elif verdict is Outcome.FAIL and _staged(case):
        checks = [check for check in _own(case) if check.outcome in MEASURED]
        wrong = {item for check in checks if _alone(check) for item in COMPUTED[Stage(check.stage)]}
        measured = {item for check in checks for item in COMPUTED[Stage(check.stage)]}
        found = [item for item in _covers(case) if item in measured and item not in graded_items([*wrong])]
        found += [] if _garbled(case) else [STORING]
    else:
        return
    for item in found:
        ledger.right.setdefault(item, set()).add(name)


def _clauses(case: CaseRecord) -> list[Clause]:
    """Return what a failing case says: at each stage that is wrong by itself, that one of some items is."""
    name, covers, checks = str(case["name"]), set(_covers(case)), _own(case)
    written = [Stage(check.stage) for check in checks if check.outcome in MEASURED]
    alone = {Stage(check.stage): ratio for check in checks if (ratio := _alone(check))}
    first = Stage(case["stage"]) if case.get("stage") else Stage.RADIANCE
    if not alone:  # by another reference's word or a closed form, or without stages
        ratios = [ratio_of(check) for check in case.get("checks", []) if check.stage == first]
        alone = {first: max((at_worst(ratio) for ratio in ratios if ratio is not None), default=1.0)}
    found = []
    for stage, ratio in alone.items():
        before = [other for other in written if other is not stage]
        possible = graded_items(possible_items(stage, before, case.get("shapes", [])))
        blamed = case.get("blamed_items", []) if stage is first else []
        graded = set(graded_items(blamed) or possible)
        items = frozenset(graded & covers or graded).union(() if before else (STORING,))
        found.append(Clause(case=name, stage=stage, items=items, possible=items.union(possible), ratio=ratio))
    return found


def own_items(mistake: str, items: Sequence[str], phrase: str) -> tuple[str, ...]:
    """Return the items that a mistake costs: the first that it concerns, or what was found of a camera."""
    if mistake != "another_camera":
        return graded_items(items[:1])
    return tuple(item for item, words in OF_CAMERAS.items() if any(word in phrase for word in words)) or ("CAM-2",)


def _share_out(
    ledger: _Ledger, clauses: list[Clause], shared: Sequence[Shared], proven: frozenset[str]
) -> list[Clause]:
    """Charge the mistakes that explain some stages, and return the clauses that are left to explain."""
    left = list(clauses)
    for part in shared:
        told = {
            own_items(name, MISTAKES[name].items, one.phrase(name)): f"The renderer {one.phrase(name)}."
            for one in reversed(part.hypotheses)
            for name in one.mistakes
        }
        here = [one for one in left if one.stage is part.stage and one.case in part.cases]
        if not here or len(told) != 1:
            continue
        ((items, sentence),) = told.items()
        # What is wrong with shapes shows in hits, too: where it does not, feelers are wrong in another way.
        if part.stage is Stage.VISIBILITY and not OF_FEELERS & {*items} and not {*items} & ledger.grades.keys():
            continue
        places = [(one.case, one.stage.value) for one in sorted(here, key=lambda one: (-one.ratio, one.case))]
        for item in items:
            _charge(ledger, item, State.WRONG, sentence, places)
        concerned = {item for one in part.hypotheses for name in one.mistakes for item in MISTAKES[name].items}
        shown = frozenset({*items, *graded_items([*concerned])})  # what is left of this stage may be the same mistake's
        left = [one for one in left if one not in here and not (one.stage is part.stage and one.possible & shown)]
    return [one for one in left if not one.possible & proven]


def _charge_cause(ledger: _Ledger, cause: CauseRecord, cases: Mapping[str, CaseRecord]) -> None:
    """Charge what a proven mistake concerns first; where mistakes of the same pixels concern others, leave it open."""
    told = [(cause["mistake"], cause["items"], cause["sentence"])]
    told += [(other["mistake"], other["items"], other["sentence"]) for other in cause.get("alternatives", [])]
    named = {own_items(str(name), items, phrase) for name, items, phrase in told if items}
    items = sorted({item for own in named for item in own})
    sentence = cause["sentence"]
    for cut in CUTS:
        sentence = sentence.split(cut)[0]
    state = State.WRONG if len(named) == 1 else State.UNDECIDED
    for item in items:
        asking = [name for name in cause["cases"] if name in cases and item in _covers(cases[name])]
        _charge(ledger, item, state, f"{sentence.rstrip('.')}.", _worst_first(cases, asking or cause["cases"]))


def _worst_first(cases: Mapping[str, CaseRecord], names: Sequence[str]) -> list[tuple[str, str | None]]:
    """Return cases with the stage at which they fail, the largest error first."""

    def off(name: str) -> float:
        ratios = (ratio_of(check) for check in cases[name].get("checks", []))
        return max((at_worst(ratio) for ratio in ratios if ratio is not None), default=0.0)

    known = [name for name in names if name in cases]
    return [(name, cases[name].get("stage")) for name in sorted(known, key=lambda name: (-off(name), name))]


def _charge(ledger: _Ledger, item: str, state: State, sentence: str, places: Sequence[tuple[str, str | None]]) -> None:
    """Note that an item is not right; what is said first stays, unless it was only undecided."""
    known = ledger.grades.get(item)
    if known is None or (known.state is State.UNDECIDED and state is State.WRONG):
        stage = places[0][1] if places else None
        names = tuple(dict.fromkeys(name for name, _ in places))
        ledger.grades[item] = ItemGrade(item=item, of=0, state=state, sentence=sentence, stage=stage, cases=names)


def _explain(ledger: _Ledger, clauses: list[Clause], *, staged: bool) -> None:
    """Charge as few items as explain all clauses; without stages one at most, and leave the rest open."""
    every = frozenset[str]().union(*(clause.items for clause in clauses))
    fails = {item: {clause.case for clause in clauses if item in clause.items} for item in every}
    known = {item for item, grade in ledger.grades.items() if grade.state is State.WRONG}
    left = [clause for clause in clauses if not clause.items & known]
    for clause in [clause for clause in left if len(clause.items) == 1]:
        _blame(ledger, clause.items, left)
    charged = {item for item, grade in ledger.grades.items() if grade.state is State.WRONG}
    left = [clause for clause in left if not clause.items & charged]
    share = {item: len(fails[item]) / len(fails[item] | ledger.right.get(item, set())) for item in fails}
    if left and not staged:
        items = frozenset[str]().union(*(clause.items for clause in left))
        doubtful = frozenset(item for item in items if share[item] > MOSTLY)
        if doubtful or not items.intersection(*(clause.items - {STORING} for clause in left)):
            _blame(ledger, doubtful or items, left, State.UNDECIDED)
            return
    cases = {clause.case for clause in left}
    if len(cases) < FEWEST and cases <= {clause.case for clause in clauses if clause.items & charged}:
        return  # one case, in which an earlier stage is wrong: too little for another mistake
    while left:
        scores = {item: share[item] * sum(item in clause.items for clause in left) for item in fails}
        best = frozenset(item for item, score in scores.items() if score >= max(scores.values()) * (1 - 1e-9))
        _blame(ledger, best, left)
        left = [clause for clause in left if not clause.items & best]


def _credit(ledger: _Ledger, clauses: Sequence[Clause]) -> None:
    """Count what another item's mistake explains as right: it costs that item, and no other one."""
    wrong = {item for item, grade in ledger.grades.items() if grade.state is State.WRONG}
    for clause in clauses:
        for item in clause.items - ledger.grades.keys() if clause.possible & wrong else ():
            ledger.right.setdefault(item, set()).add(clause.case)


def _blame(ledger: _Ledger, items: frozenset[str], left: Sequence[Clause], state: State = State.WRONG) -> None:
    """Charge an item with what is wrong in some cases; leave it open between several."""
    state = state if len(items) == 1 else State.UNDECIDED
    shown = sorted((clause for clause in left if clause.items & items), key=lambda one: (-one.ratio, one.case))
    for item in sorted(items):
        own = [clause for clause in shown if item in clause.items]
        stages = dict.fromkeys(clause.stage.value for clause in own)
        others = f", or {', '.join(sorted(items - {item}))}" if len(items) > 1 else ""
        verb = f"{'is' if len(stages) == 1 else 'are'} wrong{', perhaps' if state is State.UNDECIDED else ''}"
        said = f"The {' and the '.join(stages)} {verb} by {item}{others}."
        _charge(ledger, item, state, said, [(clause.case, clause.stage.value) for clause in own])


def _charge_unmeasured(ledger: _Ledger, cases: Mapping[str, CaseRecord], rubric: Rubric) -> None:
    """Charge what a case without an answer asks for and no other case shows to be right, or what is asked least."""
    count = {item: sum(item in covered_items(case) for case in rubric.cases) for item in rubric.points}
    for name, case in cases.items():
        verdict = Outcome(case["verdict"])
        if verdict not in (Outcome.ERROR, Outcome.UNSUPPORTED, Outcome.MISSING):
            continue
        items = [item for item in _covers(case) if item in count]
        unseen = [item for item in items if not ledger.right.get(item)]
        for item in unseen or sorted(items, key=lambda item: count[item])[:1]:
            _charge(ledger, item, State(verdict.value), case.get("reason") or "", [(name, case.get("stage"))])


def _charge_changes(ledger: _Ledger, cases: Mapping[str, CaseRecord]) -> None:
    """Charge how images are stored with an image that changes from call to call."""
    for name, case in cases.items():
        for again in case.get("repeated", []):
            if again["verdict"] == Outcome.FAIL:
                said = "The same scene gives another image when it is asked for again."
                _charge(ledger, STORING, State.WRONG, said, [(name, again["stage"])])


def _grade(ledger: _Ledger, item: str, points: float, cases: Mapping[str, CaseRecord], rubric: Rubric) -> ItemGrade:
    """Return an item's grade: what it is charged with; earned where it is right somewhere; else what it lacks."""
    known = ledger.grades.get(item)
    if known is not None:
        return replace(known, of=points)
    if ledger.right.get(item):
        return ItemGrade(item=item, of=points, state=State.EARNED)
    asking = [case.name for case in rubric.cases if item in covered_items(case)]
    verdicts = {cases[name]["verdict"] if name in cases else Outcome.MISSING.value for name in asking}
    lacking = (State.ERROR, State.UNSUPPORTED, State.MISSING)
    state = next((state for state in lacking if state.value in verdicts), State.UNDECIDED)
    said = "No case shows whether it is right."
    said = said if state is State.UNDECIDED else "No case that asks for it has an answer."
    return ItemGrade(item=item, of=points, state=state, sentence=said, cases=tuple(asking))
