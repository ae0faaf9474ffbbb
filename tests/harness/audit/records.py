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
