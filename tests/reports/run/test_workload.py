"""As many cases are on their way as keep all processors busy; records are taken up of runs that asked the same."""

from dataclasses import replace
from pathlib import Path

import pytest

from reports.run.request import RunRequest
from reports.run.workload import AT_LEAST, PIXELS, demands, has_room
from reports.subjects import Subject

REQUEST = RunRequest(
    selectors=(), out=Path("out"), resume=True, require=(), jobs=1, timeout=60.0, configurations=(), json=None
)


def test_small_cases_start_until_their_pixels_are_many():
    small = 80 * 64
    running = []
    while has_room(running):
        running.append(small)

    assert PIXELS <= sum(running) < PIXELS + small


def test_a_few_large_ones_start_all_the_same():
    assert has_room([PIXELS] * (AT_LEAST - 1))
    assert not has_room([PIXELS] * AT_LEAST)


@pytest.mark.parametrize(
    "more",
    [
        {"require": ("povray",)},
        {"full": True},
        {"subject": Subject(name="embree", title="embree")},
        {"subject": Subject(name="exec", title="exec:./other")},
    ],
    ids=lambda more: next(iter(more)),
)
def test_what_asks_more_of_a_case_does_not_take_up_a_record_of_what_asked_less(more):
    asked = [demands(request, ("analytic",)) for request in (REQUEST, replace(REQUEST, **more))]

    assert len(set(asked)) == 2


def test_what_only_says_how_a_run_goes_takes_up_any_record():
    assert demands(replace(REQUEST, jobs=2, timeout=1.0, cached=False), ("analytic",)) == ("analytic",)
