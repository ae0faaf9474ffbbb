"""What of a run's record a diagnosis goes by."""

import base64
import zlib
from typing import Any

import numpy as np
import pytest

from rayproof.reports.diagnosis.diagnosing import _mask, _rounding, _worst
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.comparison import roundoff
from rayproof.reports.judge.limits import CALIBRATED


def case(name: str, **failing: int) -> Any:
    """Return a case's record in which each configuration fails so many checks."""
    checks = [{"configuration": one, "verdict": "fail"} for one, count in failing.items() for _ in range(count)]
    renders = [{"renderer": f"tracer-{one}", "configuration": one} for one in failing]
    return {"name": name, "checks": [*checks, {"configuration": "float64", "verdict": "pass"}], "renders": renders}


def test_who_fails_most_is_diagnosed() -> None:
    cases = [case("a/one", float64=1, float32=2), case("a/two", float64=1, float32=1)]

    assert _worst({"cases": cases}) == ("tracer-float32", "float32")  # type: ignore[typeddict-item]
    assert _worst({"cases": [case("a/one")]}) == (None, "")  # type: ignore[typeddict-item]


@pytest.mark.parametrize(("configuration", "known"), [("float32", True), ("float64", False)])
def test_undecided_pixels_are_those_of_the_configuration_that_they_are_kept_of(configuration: str, known: bool) -> None:
    flags = np.array([[0, 1, 0], [4, 0, 0]], dtype=np.uint8)
    kept = {"configuration": "float32", "height": 2, "width": 3}
    kept["data"] = base64.b64encode(zlib.compress(flags.tobytes())).decode()

    found = _mask({"masks": kept}, configuration)  # type: ignore[typeddict-item]

    assert (found is not None) is known
    if found is not None:
        assert np.array_equal(found, flags > 0)


@pytest.mark.parametrize("name", ["tracer", *CALIBRATED])
@pytest.mark.parametrize("world", [False, True])
def test_a_renderer_is_diagnosed_by_the_rounding_by_which_it_is_judged(name: str, world: bool) -> None:
    # Baked corners of references were left out: their normals were beyond the limits of the diagnosis alone.
    subject = Answers(name=name, precision="float32", world_normals=world)

    diagnosed = _rounding({"subject": name, "declared": {"world_normals": world}})  # type: ignore[typeddict-item]

    assert diagnosed.key == roundoff(subject).key
