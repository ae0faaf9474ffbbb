"""The closed forms that cases carry are the published numbers, and each tolerance is far below what it guards."""

import pytest

from rayproof.cases.case import ITEMS, Flux, PixelValue
from rayproof.cases.families import all_cases, select


def test_every_item_of_the_specification_is_covered_at_least_twice():
    count = {item: sum(item in case.covers for case in all_cases()) for item in ITEMS}

    assert {item: cases for item, cases in count.items() if cases < 2} == {}
    assert len(all_cases()) >= 70


def test_the_source_gives_the_illuminance_that_cie_171_prints():
    (case,) = select(["cie_isotropic_source/as_published"])
    printed = {(48, 32): 111.111, (56, 32): 106.637, (72, 8): 60.481}  # lx at (0, 0), (0.5, 0), (1.5, 1.5) m

    found = {(e.column, e.row): e.value for e in case.expectations if isinstance(e, PixelValue) and e.channel == 0}

    assert {place: found[place] for place in printed} == pytest.approx(printed, abs=5e-4)


def test_the_room_receives_what_the_source_emits():
    cases = select(["flux_conservation"])

    flux = {
        case.name.split("/")[1]: expectation.value
        for case in cases
        for expectation in case.expectations
        if isinstance(expectation, Flux) and expectation.channel == 0
    }

    assert flux["floor"] == pytest.approx(2210.657, abs=5e-4)
    assert flux["west"] == pytest.approx(1394.672, abs=5e-4)
    assert sum(flux.values()) == pytest.approx(10_000, rel=1e-12)


def test_no_tolerance_is_wider_than_a_thousandth():
    for case in all_cases():
        for expectation in case.expectations:
            assert getattr(expectation, "relative", 0.0) < 1e-3, case.name
            assert getattr(expectation, "margin", 0.0) < 1e-3, case.name


def test_the_central_radiance_is_one_number_at_every_distance_of_the_camera():
    values = [tuple(e.value for e in case.expectations if isinstance(e, PixelValue)) for case in select(["invariance"])]

    assert len(values) > 1
    assert len(set(values)) == 1
