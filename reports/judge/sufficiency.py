"""Whether enough of a case's image could be judged: what the case fixed in advance."""

import numpy as np

from cases.case import Case
from cases.stages import Stage
from reports.judge.bench import Bench
from reports.judge.parties import Candidate


def too_little(case: Case, candidate: Candidate, bench: Bench) -> list[str]:
    """Return a sentence if fewer pixels could be judged than the case fixed in advance, else nothing."""
    last = Stage.RADIANCE if case.scene.lights else Stage.NORMAL
    edge = bench.classes.edge(last)
    interior = int(np.count_nonzero(bench.conditioning.hit & ~edge))
    share = np.count_nonzero(edge) / edge.size
    if interior < case.least_interior:
        return [f"{candidate.name}: {interior} interior pixels, the case asks for {case.least_interior}"]
    if share > case.most_edge:
        return [f"{candidate.name}: {share:.4f} of the pixels are edge, the case allows {case.most_edge}"]
    return []
