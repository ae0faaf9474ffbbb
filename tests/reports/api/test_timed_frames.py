"""What the benchmark times is judged as it is: the very kernel, frozen, on a scene of the benchmark."""

from pathlib import Path

import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.reports.api.conformance import Conformance
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.frames import Frames


@pytest.mark.parametrize("case", select(["benchmarked"]), ids=lambda case: case.name)
def test_a_timed_frame_is_right(case: Case, tmp_path: Path) -> None:
    frames = Frames(case.scene, Configuration())
    frames()

    Conformance(case=case, folder=tmp_path, stages=("radiance",)).check({"radiance": frames.pixels()})


def test_a_wrong_formula_shows_in_a_timed_frame(tmp_path: Path) -> None:
    (case,) = select(["benchmarked/sphere_and_floor"])
    frames = Frames(case.scene, Configuration.parse("float32/lambert=fault_squared"))

    with pytest.raises(AssertionError, match="fail at radiance"):
        Conformance(case=case, folder=tmp_path, stages=("radiance",)).check({"radiance": frames.pixels()})
