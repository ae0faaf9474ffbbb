"""What the audit's workers are told to do, and what they saw."""

from dataclasses import dataclass, field

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.reports.results.outcomes import Outcome
from tests.harness.audit.planted import PlantedFault

# Those that every installation has; a fault must be found without the others.
REFERENCES = ("analytic", "mitsuba_scalar", "mitsuba_llvm", "radiance")


@dataclass(frozen=True, kw_only=True)
class CaseOrder:
    """Render a case by the references once, then judge it with each fault planted; and with none."""

    case: Case
    faults: tuple[PlantedFault, ...]
    healthy: tuple[str, ...]  # configurations of the unchanged tracer that must pass


@dataclass(frozen=True, kw_only=True)
class GuardOrder:
    """Plant a fault of the oracle and run the judge's self-test."""

    fault: PlantedFault


@dataclass(frozen=True, kw_only=True)
class GradedOrder:
    """Make one quantity of a case wrong by ever smaller relative amounts, before the tracer alone."""

    case: Case
    quantity: str
    precision: str
    amounts: tuple[float, ...]  # descending


@dataclass(frozen=True, kw_only=True)
class LiarOrder:
    """Let a liar spoil whatever it can of a case, unseen; it declares `epsilon` [m] of eye and shadow rays."""

    case: Case
    epsilon: float


@dataclass(frozen=True, kw_only=True)
class LiarReport:
    """How many pixels of all stages together a liar could spoil, whatever the garbage."""

    case: str
    pixels: int  # of all stages
    unseen: int  # over the limit, no side's value, and passed
    wide: int  # within a limit of more than 1 % of the value
    epsilon: int  # over the limit, and excused by the epsilon that the liar declared
    holes: tuple[str, ...]  # where it is unseen, in words


@dataclass(frozen=True, kw_only=True)
class Look:
    """What the checks against one reference said."""

    kills: bool
    stage: Stage | None  # the first one that it found wrong
    answers: bool  # whether it answers the fault's stage here


@dataclass(frozen=True, kw_only=True)
class Sighting:
    """What became of one fault (or of the unchanged tracer: fault is a configuration) in one case."""

    fault: str
    case: str
    outcome: Outcome
    stage: Stage | None
    items: tuple[str, ...]  # that may be to blame
    blamed: str | None  # "tracer", or the references under suspicion
    reason: str
    looks: dict[str, Look] = field(default_factory=dict)

    @property
    def family(self) -> str:
        """Return the case's family."""
        return self.case.split("/")[0]


@dataclass(frozen=True, kw_only=True)
class CaseReport:
    """What became of an order's faults, and of the unchanged tracer."""

    sightings: tuple[Sighting, ...]
    healthy: tuple[Sighting, ...]


@dataclass(frozen=True, kw_only=True)
class GuardReport:
    """What the self-test said when it stopped the run; None if it did not."""

    fault: str
    stopped: str | None


@dataclass(frozen=True, kw_only=True)
class GradedReport:
    """The smallest relative error that each stage's checks found, where any did."""

    quantity: str
    precision: str
    smallest: dict[str, float]  # stage -> relative error
