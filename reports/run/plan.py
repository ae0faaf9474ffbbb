"""The plan: which configurations are asked about which cases, the references that judge, keys for `--resume`.

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
OF_SHAPES = {"HIT-3", "HIT-7", "HIT-8", "NRM-2", "NRM-3", "XF-1", "XF-2"}  # which triangles in their place do not cover
DEFAULTS = ("float32", "float64")
# The specification's second way where it has two. Literature's further variants are for `rayproof stability`.
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
    """A case, and the configurations that it is put to."""

    case: Case
    configurations: tuple[str, ...]
    twice: bool = False  # it is rendered once more, and must give the same image


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
    found = {}
    for name in ALTERNATIVES:
        formula = FORMULAS[name]
        items = frozenset(formula.covers) - usual
        if not items:
            raise ValueError(f"{name} is no alternative: the default formulas cover {', '.join(formula.covers)} too")
        found[Configuration(precision="float32", formulas={formula.slot: formula.variant}).name] = items
    return found


MOST_TWICE = 2**14  # px of the image that is rendered twice: two of the suite's usual ones
LOOKED_AT = 32  # cases of a plan among which it is sought, so that it is an early one
ASKED_AGAIN = 20  # cases of a program that stays alive, once all are answered


def with_some_twice(planned: Sequence[PlannedCase], subject: Subject = THE_TRACER) -> Sequence[PlannedCase]:
    """Return a plan of which one early case, small and lit, is rendered twice, among those that the subject can draw.

    Of a program the smallest early case where none is small. Of a program that stays alive, which may carry something
    from one scene to the next, as many as `ASKED_AGAIN` all over the plan.
    """
    places: Sequence[int] = range(len(planned))
    drawn: Callable[[int], bool] = lambda place: True  # noqa: E731
    if subject.is_program and not isinstance(planned, PlannedScenes):  # a stream is not read for it
        # Whether a scene is refused may need images of the oracle: no more are looked at than are needed.
        able = subject.capabilities
        drawn = cache(lambda place: able.refusal(planned[place].case.scene) is None)
    if subject.stays:
        return _with_twice(planned, _spread(len(planned), drawn))
    places = [*islice(filter(drawn, places), LOOKED_AT)]
    firsts = [(place, planned[place]) for place in places[:LOOKED_AT]]
    small = [(place, one) for place, one in firsts if one.case.samples == 1 and _pixels(one) <= MOST_TWICE]
    lit = [(place, one) for place, one in small if one.case.scene.lights]
    if not small and subject.is_program:
        small = sorted(firsts, key=lambda entry: _pixels(entry[1]) * entry[1].case.samples ** 2)[:1]
    return _with_twice(planned, {place for place, _ in (lit or small)[:1]})


def _spread(cases: int, drawn: Callable[[int], bool]) -> list[int]:
    """Return `ASKED_AGAIN` places of a plan that are drawn, spread over it; all that are drawn if they are fewer."""
    count = min(ASKED_AGAIN, cases)
    starts = [(2 * number + 1) * cases // (2 * count) for number in range(count)]
    pieces = [range(first, after) for first, after in pairwise([*starts, cases])]
    chosen = [place for piece in pieces if (place := next(filter(drawn, piece), None)) is not None]
    more = (place for place in range(cases) if len(chosen) < count and place not in chosen and drawn(place))
    return [*chosen, *islice(more, count - len(chosen))]


def _with_twice(planned: Sequence[PlannedCase], places: Collection[int]) -> Sequence[PlannedCase]:
    """Return a plan of which the cases in some places are rendered twice."""
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
        # Of all: which are asked depends on what a scene covers.
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
        found = self._planned(self._cases[index])
        return replace(found, twice=range(len(self))[index] in self.twice)


def configurations_of(planned: Sequence[PlannedCase]) -> frozenset[str]:
    """Return all configurations that cases are put to; a sequence that knows them is not read for it."""
    known = getattr(planned, "configurations", None)
    return frozenset(name for one in planned for name in one.configurations) if known is None else known


def plan(
    cases: tuple[Case, ...],
    configurations: tuple[str, ...],
    subject: Subject = THE_TRACER,
) -> tuple[PlannedCase, ...]:
    """Return every case with its configurations; `configurations`, if any, replace the default suite's.

    Another subject than the tracer has no configurations, only its name; what it declares not to have is
    asked as far as it can be (`within_reach`).

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
    """Return the case under a model of light that the program has, and with what its shapes cover as it is handed them.

    Where it has not the case's own light, everything but light is the same question, and light is an extra one: what it
    covers and its closed forms are those of the other model.
    """
    case = _with_meshes(case, able)
    kinds = {NAMES[type(shape)] for shape in case.scene.shapes}
    if kinds & set(able.stand_ins):
        own = covering(rebuilt(case.scene, able.stand_ins).scene)
        kept = [item for item in case.covers if item in own or item not in OF_SHAPES]
        case = replace(case, covers=tuple(item for item in ITEMS if item in kept or (item == "HIT-6" and item in own)))
    scene = able.under_its_light(case.scene)
    if scene is case.scene:
        return case
    light = {"RAD-1", "RAD-2", "RAD-3", "RAD-4"}
    told = f"Asked under {scene.shading} light, since the program has no {case.scene.shading} one."
    items = {item for item in case.covers if item not in light} | (light & {*covering(scene)})
    return replace(
        case,
        scene=scene,
        covers=tuple(item for item in ITEMS if item in items),
        stresses=f"{case.stresses} {told}",
        expectations=tuple(one for one in case.expectations if _about_shadows(one)),
    )


def _with_meshes(case: Case, able: Capabilities) -> Case:
    """Return the case about the meshes, or squares, that a program gets for spheres and planes that it does not draw.

    They are other surfaces: the case does not count for the items of those shapes, nor hold by closed forms about them.
    How many of its pixels must be decidable was found out for the original.
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


def _about_shadows(one: Expectation) -> bool:
    """Say whether a closed form holds under either model of light."""
    return isinstance(one, ShadowOutline) or getattr(one, "stage", None) in GEOMETRY


@dataclass(frozen=True, kw_only=True)
class RecordKey(Key):
    """A finished case's record: which case, put to whom, before whom, and by which options."""

    case: Case
    configurations: tuple[str, ...]
    twice: bool
    options: Mapping[str, Any]  # `CaseOptions.of_records`


def record_key(planned: PlannedCase, options: CaseOptions) -> RecordKey:
    """Return all that a finished case depends on: under it `--resume` takes its record up again."""
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
    """The references of a run, the oracle first, and the reasons of those that may not judge its subject."""

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
        REFERENCES[name]  # an unknown one is explained here
    return Panel(names=tuple(sorted(names, key=lambda name: (name != ORACLE, name))), absent=absent)
