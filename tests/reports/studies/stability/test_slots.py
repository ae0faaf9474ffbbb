"""Every slot is on a ladder, and those of one formula are on ladders that see the faults planted there."""

import pytest

from rayproof.cases.ladders import all_ladders
from rayproof.reports.studies.stability.climb import climb, drawn
from rayproof.reports.studies.stability.survey import applies, judged
from rayproof.tracer.formulas import FORMULAS, Formula

LADDERS = {ladder.name: ladder for ladder in all_ladders()}
SLOTS = {
    *("sample", "ndc", "pixel", "view", "projection", "inverse", "corners", "clip_depth", "clip_shell", "clip_none"),
    *("nearest", "segment", "obstructed", "horizon", "hidden"),
    *("sum_lights", "exitance", "radiance", "radiance_simplified"),
}
FAULTS = [FORMULAS[name] for name in FORMULAS if FORMULAS[name].kind == "fault" and FORMULAS[name].slot in SLOTS]


def test_every_slot_has_a_ladder_that_its_default_climbs() -> None:
    climbed = {
        slot
        for slot, variant in FORMULAS.slots.items()
        for ladder in LADDERS.values()
        if applies(ladder, FORMULAS[f"{slot}/{variant}"])
    }

    assert climbed == set(FORMULAS.slots)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_falls_from_a_ladder_of_its_slot(fault: Formula) -> None:
    mine = [ladder for ladder in LADDERS.values() if fault.slot in ladder.slots]

    verdicts = [judged(climb(drawn(ladder, "float32", quick=True), fault)).verdict for ladder in mine]

    assert "fail" in verdicts


def test_a_blocker_behind_the_light_is_told_from_one_before_it() -> None:
    ladder = LADDERS["SHD-LIGHT-END"]
    given = drawn(ladder, "float32", quick=True)
    blocked = given.truth.facts["blocked"]

    assert 0.4 < blocked.mean() < 0.6
    short = climb(given, FORMULAS["segment/fault_short"])
    assert short.total("false_hits") > 0
