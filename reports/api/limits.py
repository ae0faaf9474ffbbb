"""How far an image may be off, as an image of its own."""

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.oracle import ORACLE


def limit_of(scene: Scene, stage: Stage, precision: str) -> np.ndarray:
    """Return how far an image may be off against the closed forms, as `CaseResult.limit` describes it."""
    from rayproof.cases.case import ITEMS_OF_OTHERS
    from rayproof.reference.analytic import Analytic
    from rayproof.reports.judge.answers import Candidate, Witness
    from rayproof.reports.judge.oracle import stages_of
    from rayproof.reports.judge.scene_truth import Terms, ground

    base = ground(scene, stages_of(scene), Analytic())
    ours = Candidate(name="ours", precision=precision, items=ITEMS_OF_OTHERS, shadow_epsilon=0.0, answers=base.truth)
    theirs = Witness(name=ORACLE, precision="float64", independent=True, shadow_epsilon=0.0, answers=base.truth)
    terms = Terms(ground=base, candidate=ours, witness=theirs)
    shape = terms.classes.outline.shape
    limit = np.array(terms.limits.end_to_end.get(stage, np.zeros(shape)), dtype=np.float64)
    limit[terms.classes.edge(stage)] = np.nan
    return limit
