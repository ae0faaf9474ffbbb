"""Whether enough of a case's image could be judged: what the case fixed in advance."""

import numpy as np

from cases.case import Case
from cases.stages import Stage
from reports.judge.bench import GEOMETRY
from reports.judge.checks import Check
from reports.judge.parties import Candidate
from reports.judge.terms import Terms


def too_little(case: Case, candidate: Candidate, terms: Terms) -> list[str]:
    """Return a sentence if fewer pixels could be judged than the case fixed in advance, else nothing."""
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    # What a renderer says that it does not see before the eye is excused as an edge is, and counts as one.
    edge = terms.classes.edge(last) | terms.near
    interior = int(np.count_nonzero(terms.conditioning.hit & ~edge))
    why = "".join(f"; {note}" for note in terms.classes.notes)
    share = np.count_nonzero(edge) / edge.size
    if interior < case.least_interior:
        return [f"{candidate.name}: {interior} interior pixels, the case asks for {case.least_interior}{why}"]
    if share > case.most_edge:
        return [f"{candidate.name}: {share:.4f} of the pixels are edge, the case allows {case.most_edge}{why}"]
    if not interior and np.any(terms.conditioning.hit):
        return [f"{candidate.name}: no pixel that hits something lies clear of every edge"]
    return []


def crowded(case: Case, terms: Terms) -> bool:
    """Say whether outlines reach more pixels than the case allows: what a side is, such pixels cannot tell.

    By the scene's own conditioning alone, so that no renderer under test can bring it about.
    """
    return float(np.mean(terms.classes.outline)) > case.most_edge


def only_at_edges(check: Check) -> bool:
    """Say whether a failed geometric check has nothing against it but edge pixels with the value of neither side."""
    measured = [one for one in (check.end_to_end, check.continued) if one is not None]
    inside = all(one.worst_inside <= 1 and not one.nan and not one.inf for one in measured)
    return check.stage in GEOMETRY and bool(measured) and inside
