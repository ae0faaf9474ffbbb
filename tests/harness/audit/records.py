"""What audit.json holds, one class a level."""

from typing import TypedDict


class FamilyFinding(TypedDict):
    """What a family's cases made of a fault."""

    cases: int
    killed: int  # cases that showed it
    stage: str | None  # that most of them blamed


class ReferenceFinding(TypedDict):
    """What one reference alone made of a fault."""

    sees: bool
    killed: bool
    missed: list[str]  # cases that it answers and in which others showed the fault
    stage: str | None  # that it blames


class FaultAbout(TypedDict):
    """What a planted fault says of itself."""

    name: str
    where: str  # "tracer", or what else it is planted in
    stage: str  # that it spoils
    covers: list[str]  # the specification's items
    erratum: str | None
    equivalent: str | None  # why it changes no answer


class BlamedItems(TypedDict):
    """Which of the specification's items the cases blame, the most frequent first."""

    blamed_items: list[str]
    items_right: bool | None  # None of a fault that declares no items


class FaultFinding(FaultAbout, BlamedItems):
    """The entry of audit.json of a fault."""

    killed: bool
    blamed_stage: str | None
    blamed: list[str]  # who
    blamed_right: bool
    killed_by: list[str]  # sentences
    wrongly_blamed: list[str]  # sentences
    families: dict[str, FamilyFinding]
    references: dict[str, ReferenceFinding]


class LiarFinding(TypedDict):
    """How many of so many pixels of all stages a liar could spoil, by what the judge says of them."""

    pixels: int
    cases: int
    spoiled_unseen: int
    spoiled_wide: int
    spoiled_epsilon: int
    holes: list[str]


class MutantFinding(TypedDict):
    """What became of one mutant; killers are "case: reason"."""

    name: str
    field: str  # of the scene, or the formula of a tolerance
    what: str
    equivalent: str | None  # why it is a right renderer
    survives: str | None  # why no case kills it by radiance alone, where that is known
    killed_by_radiance: str | None
    killed_by_stages: str | None
    stage: str | None  # that is blamed by all stages
    killed_at_random: str | None  # of what no case kills: the random scene that does
    judged: int  # scenes in which it differs from the oracle after rounding to float32, until it was killed


class MutantFieldFinding(TypedDict):
    """The mutants of a field or formula, counted."""

    field: str
    mutants: int
    equivalent: int
    killed_by_radiance: int
    killed_by_stages: int
    killed_by_new_families: int  # by radiance, by no case of the other families
    survivors: list[str]  # rules


class MutantsScore(TypedDict):
    """The table of mutants."""

    of: int  # that are not equivalent
    equivalent: int
    killed_by_radiance: int
    killed_by_stages: int
    killed_by_new_families: int
    random_scenes: int
    problems: list[str]
    fields: list[MutantFieldFinding]
    mutants: list[MutantFinding]


class AuditScore(TypedDict):
    """What audit.json holds of the faults."""

    planted: int
    killed: int
    equivalent: int
    blamed_right: int
    items_declared: int
    items_right: int
    liar: LiarFinding | None
    false_alarms: int
    unchanged_passed: int
    good: bool
    problems: list[str]
    smallest_detected: dict[str, dict[str, dict[str, float]]]  # quantity -> precision -> stage -> relative error
    faults: list[FaultFinding]


class AuditRecord(AuditScore):
    """What audit.json holds."""

    schema: int
    quick: bool
    only: str  # pattern of the faults that were planted
    seconds: float
    survived_at_first: list[str]  # faults that the first round of cases did not kill
    mutants: MutantsScore | None  # None where none was asked for
