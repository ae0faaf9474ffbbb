"""Numbers that JSON lacks go out as strings and come back; NaN is never the smaller error."""

import json
import math

import numpy as np
import pytest

from rayproof.reports.results.files import as_json, at_worst, number, plain

ODD = {"a": [math.inf, -math.inf, math.nan, 1.5, (2,)], "b": {3: np.float64("inf")}, "c": "inf"}


@pytest.mark.parametrize("indent", [None, 2])
def test_what_json_lacks_becomes_strings(indent):
    expected = {"a": ["inf", "-inf", "nan", 1.5, [2]], "b": {"3": "inf"}, "c": "inf"}

    assert plain(ODD) == expected
    assert json.loads(as_json(ODD, indent=indent), parse_constant=pytest.fail) == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("inf", math.inf),
        ("-inf", -math.inf),
        (3, 3.0),
        pytest.param(10**400, math.inf, id="huge"),
        pytest.param(-(10**400), -math.inf, id="-huge"),
        (None, None),
        ("x", None),
        (True, None),
    ],
)
def test_number_reads_what_plain_writes(value, expected):
    assert number(value) == expected


def test_nan_is_read_as_nan_and_is_the_worst_of_errors():
    assert math.isnan(number("nan") or 0)
    assert at_worst("nan") == at_worst(math.nan) == at_worst("inf") == math.inf
    assert at_worst(0.5) == 0.5
