"""The plan: the configurations of each case, the references that judge, and keys for `--resume`.

The default suite runs the default configuration in float32 and in float64 on every case, and every alternative
formula, in float32, on the cases that cover its specification item.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from itertools import islice, pairwise
from typing import Any, overload

from rayproof.cases.case import ITEMS, Case, Expectation, ShadowOutline, covering
from rayproof.cases.scene_json import NAMES
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.interchange.stand_ins import rebuilt
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.reference_cache import Key, code, machine
from rayproof.reports.run.scenes import SceneStream
from rayproof.reports.subjects import THE_TRACER, Subject
from rayproof.reports.subjects.protocol import Capabilities

GEOMETRY = IMAGE_STAGES[: IMAGE_STAGES.index(Stage.IRRADIANCE)]
# Items that are not covered by triangles that replace a shape.
OF_SHAPES = {"HIT-3", "HIT-7", "HIT-8", "NRM-2", "NRM-3", "XF-1", "XF-2"}
DEFAULTS = ("float32", "float64")
# The second formula of each item for which the specification has two. Variants of the literature are only used by
# `rayproof stability`.
ALTERNATIVES = (
    "ray/inverse_matrices",
    "triangle/moeller_trumbore",
    "square/half_vectors",
    "shadow_ray/skip_last",
    "shadow_ray/minimum_t",
    "shadow_ray/doubles",
)


@dataclass(frozen=True, kw_only=True)
class PlannedCase:
    """A case and the configurations that render it."""

    case: Case
    configurations: tuple[str, ...]
    twice: bool = False  # it is rendered twice, and both images must be the same


@lru_cache(maxsize=1)
def alternatives() -> dict[str, frozenset[str]]:
    """Return each alternative configuration with the specification items that it covers and the default does not.

    Raises:
        LookupError: an alternative is not registered (any more).
        ValueError: it covers nothing that the default does not.

    """
    from rayproof.tracer.configuration import Configuration
    from rayproof.tracer.formulas import FORMULAS

    usual = Configuration(precision="float32").items
    covered = {}
    for name in ALTERNATIVES:
        formula = FORMULAS[name]
        items = frozenset(formula.covers) - usual
        if not items:
            raise ValueError(f"{name} is no alternative: the default formulas cover {', '.join(formula.covers)} too")
        covered[Configuration(precision="float32", formulas={formula.slot: formula.variant}).name] = items
    return covered


MOST_TWICE = 2**14  # most px of the image that is rendered twice: two usual images of the suite
LOOKED_AT = 32  # cases at the plan's start, among them the case that is rendered twice
ASKED_AGAIN = 20  # cases that a program that stays alive renders again at the end


def with_some_twice(planned: Sequence[PlannedCase], subject: Subject = THE_TRACER) -> Sequence[PlannedCase]:
    """Return the plan with an early case, small and lit, that the subject can draw and that is rendered twice.

    If no early case is small, a program gets the smallest one. A program that stays alive may keep state from one scene
    to the next: it gets `ASKED_AGAIN` such cases, spread over the plan.
    """
    places: Sequence[int] = range(len(planned))
    drawn: Callable[[int], bool] = lambda place: True  # noqa: E731
    if subject.is_program and not isinstance(planned, PlannedScenes):  # a stream is not read for this
        # Only test the scenes that are needed: the test for a refusal may need images of the oracle.
        able = subject.capabilities
        drawn = cache(lambda place: able.refusal(planned[place].case.scene) is None)
    if subject.stays:
        return _with_twice(planned, _spread(len(planned), drawn))
    places = [*islice(filter(drawn, places), LOOKED_AT)]
    firsts = [(place, planned[place]) for place in places[:LOOKED_AT]]
    small = [
        (place, planned_case)
        for place, planned_case in firsts
        if planned_case.case.samples == 1 and _pixels(planned_case) <= MOST_TWICE
    ]
    lit = [(place, planned_case) for place, planned_case in small if planned_case.case.scene.lights]
    if not small and subject.is_program:
        small = sorted(firsts, key=lambda entry: _pixels(entry[1]) * entry[1].case.samples ** 2)[:1]
    return _with_twice(planned, {place for place, _ in (lit or small)[:1]})


def _spread(cases: int, drawn: Callable[[int], bool]) -> list[int]:
    """Return `ASKED_AGAIN` places of cases that can be drawn, spread over the plan; all of them if they are fewer."""
    count = min(ASKED_AGAIN, cases)
    starts = [(2 * number + 1) * cases // (2 * count) for number in range(count)]
    pieces = [range(first, after) for first, after in pairwise([*starts, cases])]
    chosen = [place for piece in pieces if (place := next(filter(drawn, piece), None)) is not None]
    more = (place for place in range(cases) if len(chosen) < count and place not in chosen and drawn(place))
    return [*chosen, *islice(more, count - len(chosen))]


def _with_twice(planned: Sequence[PlannedCase], places: Collection[int]) -> Sequence[PlannedCase]:
    """Return the plan with the cases at these places rendered twice."""
    if isinstance(planned, PlannedScenes):
        planned.twice = frozenset(places)
        return planned
    return tuple(replace(case, twice=place in places) for place, case in enumerate(planned))


def _pixels(planned: PlannedCase) -> int:
    return planned.case.scene.camera.width * planned.case.scene.camera.height


class PlannedScenes(Sequence[PlannedCase]):
    """A stream of scenes, each planned when it is needed."""

    def __init__(self, cases: SceneStream, planned: Callable[[Case], PlannedCase]) -> None:
        self._cases, self._planned = cases, planned
        self.twice: frozenset[int] = frozenset()  # the places of the scenes that are rendered twice
        # Of all scenes: a scene's configurations depend on the items that it covers.
        firsts = cases.covers.values()
        self.configurations = frozenset(name for number in firsts for name in planned(cases[number]).configurations)

    def __len__(self) -> int:
        return len(self._cases)

    @overload
    def __getitem__(self, index: int) -> PlannedCase: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[PlannedCase]: ...
    def __getitem__(self, index: int | slice) -> PlannedCase | Sequence[PlannedCase]:
        if isinstance(index, slice):
            return [self[number] for number in range(len(self))[index]]
        planned_case = self._planned(self._cases[index])
        return replace(planned_case, twice=range(len(self))[index] in self.twice)


def configurations_of(planned: Sequence[PlannedCase]) -> frozenset[str]:
    """Return the configurations of all cases; a sequence that stores them is not read for this."""
    stored = getattr(planned, "configurations", None)
    return (
        frozenset(name for planned_case in planned for name in planned_case.configurations)
        if stored is None
        else stored
    )


def plan(
    cases: tuple[Case, ...],
    configurations: tuple[str, ...],
    subject: Subject = THE_TRACER,
) -> tuple[PlannedCase, ...]:
    """Return every case with its configurations; `configurations`, if any, replace the default suite's.

    A subject other than the tracer has no configurations, only its name; its cases are adapted to the capabilities that
    it declares (`within_reach`).

    Raises:
        LookupError, ValueError: a configuration names something unknown.

    """
    from rayproof.tracer.configuration import Configuration

    if not subject.is_tracer:
        able = subject.capabilities
        return tuple(PlannedCase(case=within_reach(case, able), configurations=(subject.name,)) for case in cases)
    if configurations:
        names = tuple(dict.fromkeys(Configuration.parse(name).name for name in configurations))
        return tuple(PlannedCase(case=case, configurations=names) for case in cases)
    return tuple(
        PlannedCase(
            case=case,
            configurations=DEFAULTS
            + tuple(name for name, items in sorted(alternatives().items()) if items & set(case.covers)),
        )
        for case in cases
    )


def within_reach(case: Case, able: Capabilities) -> Case:
    """Return the case in a form that the program can draw: its model of light, its samples and its shapes.

    The covered items follow from that form. If the program has not the case's own model of light, the geometry is
    unchanged, and the covered items and the closed forms are adapted to the other model.
    """
    case = _with_meshes(case, able)
    if any(able.sample_offset) or able.random:  # closed forms are about the pixels' centres
        case = replace(case, scene=able.through_its_samples(case.scene), expectations=(), tuned=False)
    if able.random:  # its image is a mean already
        case = replace(case, samples=1)
    kinds = {NAMES[type(shape)] for shape in case.scene.shapes}
    if kinds & set(able.stand_ins):
        own = covering(rebuilt(case.scene, able.stand_ins).scene)
        kept = [item for item in case.covers if item in own or item not in OF_SHAPES]
        case = replace(case, covers=tuple(item for item in ITEMS if item in kept or (item == "HIT-6" and item in own)))
    scene = able.under_its_light(case.scene)
    if scene is case.scene:
        return case
    light = {"RAD-1", "RAD-2", "RAD-3", "RAD-4"}
    note = f"Asked under {scene.shading} light, since the program has no {case.scene.shading} one."
    items = {item for item in case.covers if item not in light} | (light & {*covering(scene)})
    return replace(
        case,
        scene=scene,
        covers=tuple(item for item in ITEMS if item in items),
        stresses=f"{case.stresses} {note}",
        expectations=tuple(expectation for expectation in case.expectations if _about_shadows(expectation)),
    )


def _with_meshes(case: Case, able: Capabilities) -> Case:
    """Return the case with the meshes, or squares, that replace spheres and planes for a program that lacks these.

    They are different surfaces: the items of the original shapes are not covered, and their closed forms do not apply.
    Nor does the least number of decidable pixels, which was determined for the original scene.
    """
    notes = able.not_equal(case.scene)
    if not notes:
        return case
    scene = replace(able.asked(case.scene), shading=case.scene.shading)
    own, before = covering(scene), covering(case.scene)
    covers = tuple(item for item in ITEMS if (item in case.covers and item not in before) or item in own)
    return replace(
        case,
        scene=scene,
        covers=covers,
        stresses=" ".join((case.stresses, *notes)),
        expectations=(),
        tuned=False,
    )


def _about_shadows(expectation: Expectation) -> bool:
    """Return whether a closed form holds under either model of light."""
    return isinstance(expectation, ShadowOutline) or getattr(expectation, "stage", None) in GEOMETRY


@dataclass(frozen=True, kw_only=True)
class RecordKey(Key):
    """The key of a finished case's record: the case, its configurations and the options, with subject and panel."""

    case: Case
    configurations: tuple[str, ...]
    twice: bool
    options: Mapping[str, Any]  # `CaseOptions.of_records`


def record_key(planned: PlannedCase, options: CaseOptions) -> RecordKey:
    """Return the key of all data that a finished case depends on; `--resume` finds its record by it."""
    return RecordKey(
        case=planned.case,
        configurations=planned.configurations,
        twice=planned.twice,
        options=options.of_records,
        code=code(tracer=True),
        machine=machine(),
    )


@dataclass(frozen=True, kw_only=True)
class Panel:
    """The references of a run, the oracle first, and the reasons why other references may not judge its subject."""

    names: tuple[str, ...]
    absent: dict[str, str] = field(default_factory=dict)


def panel(require: Sequence[str], subject: Subject = THE_TRACER) -> Panel:
    """Return the references that judge `subject`: the usual ones, whatever is installed, and the required.

    The subject itself is left out, and so is a reference that shares its code with the subject.

    Raises:
        LookupError: a required reference is not known, or is left out.

    """
    from rayproof.reference import REFERENCES, code_of

    names, absent = [], {}
    for name in REFERENCES:
        if REFERENCES.about(name).get("on_request", False) and name not in require:
            continue
        why = None
        if name == subject.name:
            why = "It is under test."
        elif subject.name in REFERENCES and code_of(name) == code_of(subject.name):
            why = f"It shares its code with {subject.name}, which is under test: its word would prove nothing."
        if why is None:
            names.append(name)
        elif name in require:
            raise LookupError(f"--require {name}: {why}")
        else:
            absent[name] = why
    for name in require:
        REFERENCES[name]  # raises LookupError for an unknown name
    return Panel(names=tuple(sorted(names, key=lambda name: (name != ORACLE, name))), absent=absent)
