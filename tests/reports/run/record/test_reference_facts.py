"""What a reference says of itself reaches the report as text, and silence stays silence."""

import numpy as np

from rayproof.cases.stages import Resolution, Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.run.case_record import said


def test_settings_epsilons_and_coarse_output_are_told() -> None:
    witness = Answers(
        name="a",
        precision="float32",
        independent=True,
        settings={"tolerance": "1e-5"},
        ray_epsilon=1e-3,
        shadow_epsilon=np.array([[1e-4, np.nan], [3e-4, 2e-4]]),
        resolutions={Stage.DISTANCE: Resolution(relative=0, absolute=1e-4, because="printed with 4 decimals")},
    )

    assert said(witness) == {
        "tolerance": "1e-5",
        "ray epsilon": "0.001 m",
        "shadow epsilon": "0.0001 to 0.0003 m",
        "resolution of distance": "printed with 4 decimals",
    }


def test_a_reference_without_any_says_nothing() -> None:
    witness = Answers(name="a", precision="float64", independent=True)

    assert said(witness) == {}
