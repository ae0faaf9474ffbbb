"""Sentinels before several witnesses: who is wrong is known, and must be found out by the word of the others."""

from collections.abc import Iterator

from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.renderers import Witness
from rayproof.reports.judge.self_test.known_answer import Sentinel, rounded
from rayproof.reports.results.outcomes import Outcome

BLUNDER = 1.01


def witness_sentinels(truth: StageImages) -> Iterator[Sentinel]:
    """Yield the sentinels for the oracle's answers to the usual scene."""
    good, suspect = rounded(truth), Outcome.REFERENCE_SUSPECT
    # Told from the candidate by its last bits, so that it is no copy, and from the oracle by nothing.
    honest = third(truth)
    yield Sentinel(name="two who agree", ours=good, theirs=truth, outcome=Outcome.PASS, stage=None, others=(honest,))
    for stage in (Stage.RAY, Stage.NORMAL, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
        wrong = truth | {stage: truth[stage] * BLUNDER}
        yield Sentinel(
            name=f"{stage} of a third wrong",
            ours=good,
            theirs=truth,
            outcome=suspect,
            stage=stage,
            others=(third(wrong),),
        )
        yield Sentinel(
            name=f"{stage} of the oracle wrong", ours=good, theirs=wrong, outcome=suspect, stage=stage, others=(honest,)
        )
        mine = good | {stage: good[stage] * BLUNDER}
        yield Sentinel(
            name=f"{stage} wrong before two",
            ours=mine,
            theirs=truth,
            outcome=Outcome.FAIL,
            stage=stage,
            others=(honest,),
        )
    camera = truth[Stage.CAMERA] | {"projection": truth[Stage.CAMERA]["projection"] * BLUNDER}
    yield Sentinel(
        name="camera of a third wrong",
        ours=good,
        theirs=truth,
        outcome=suspect,
        stage=Stage.CAMERA,
        others=(third(truth | {Stage.CAMERA: camera}),),
    )
    copy = truth | {Stage.IRRADIANCE: good[Stage.IRRADIANCE]}
    yield Sentinel(
        name="copy of one stage", ours=good, theirs=truth, outcome=suspect, stage=None, others=(third(copy),)
    )


def third(answers: StageImages) -> Witness:
    """Return an independent witness beside the oracle."""
    return Witness(name="third", precision="float64", independent=True, shadow_epsilon=0.0, answers=answers)
