"""Whether enough of a case's image could be judged: what the case fixed in advance."""

import numpy as np

from cases.case import Case
from cases.stages import Stage
from reports.judge.bench import GEOMETRY, Bench
from reports.judge.checks import Check
from reports.judge.parties import Candidate


def too_little(case: Case, candidate: Candidate, bench: Bench) -> list[str]:
    """Return a sentence if fewer pixels could be judged than the case fixed in advance, else nothing."""
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    edge = bench.classes.edge(last)
    interior = int(np.count_nonzero(bench.conditioning.hit & ~edge))
    why = "".join(f"; {note}" for note in bench.classes.notes)
    share = np.count_nonzero(edge) / edge.size
    if interior < case.least_interior:
        return [f"{candidate.name}: {interior} interior pixels, the case asks for {case.least_interior}{why}"]
    if share > case.most_edge:
        return [f"{candidate.name}: {share:.4f} of the pixels are edge, the case allows {case.most_edge}{why}"]
    if not interior and np.any(bench.conditioning.hit):
        return [f"{candidate.name}: no pixel that hits something lies clear of every edge"]
    return []


def crowded(case: Case, bench: Bench) -> bool:
    """Say whether outlines reach more pixels than the case allows: what a side is, such pixels cannot tell.

    By the scene's own conditioning alone, so that no renderer under test can bring it about.
    """
    return float(np.mean(bench.classes.outline)) > case.most_edge


def only_at_edges(check: Check) -> bool:
    """Say whether a failed geometric check has nothing against it but edge pixels with the value of neither side."""
    measured = [one for one in (check.end_to_end, check.continued) if one is not None]
    inside = all(one.worst_inside <= 1 and not one.nan and not one.inf for one in measured)
    return check.stage in GEOMETRY and bool(measured) and inside
