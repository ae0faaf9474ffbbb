"""What every case family must keep: deterministic, named once, complete in what it covers."""

from collections import Counter

import pytest

from rayproof.cases.case import ITEMS
from rayproof.cases.families import CASE_FAMILIES, all_cases, cases_of, select
from rayproof.cases.stages import Stage

NAMES = [case.name for case in all_cases()]


@pytest.mark.parametrize("family", list(CASE_FAMILIES))
def test_a_family_yields_the_same_cases_twice(family):
    assert list(CASE_FAMILIES[family]()) == list(CASE_FAMILIES[family]())


def test_no_two_cases_share_a_name():
    assert max(Counter(NAMES).values()) == 1


def test_no_two_cases_ask_the_same_scene():
    repeated = [scene for scene, count in Counter(case.scene for case in all_cases()).items() if count > 1]

    assert repeated == []


def test_cases_come_by_family_in_alphabetical_order():
    families = list(dict.fromkeys(case.family for case in all_cases()))

    assert families == sorted(families)


@pytest.mark.parametrize("case", all_cases(), ids=NAMES)
def test_a_case_asks_for_no_more_than_its_image_has(case):
    camera = case.scene.camera
    assert 0 < case.least_interior <= camera.width * camera.height
    assert 0 < case.most_edge <= 0.2
    assert case.covers == tuple(item for item in ITEMS if item in case.covers)
    for expectation in case.expectations:
        assert expectation.because


@pytest.mark.parametrize("case", all_cases(), ids=NAMES)
def test_an_item_of_light_is_covered_only_where_there_is_a_light(case):
    about_light = [item for item in case.covers if item.startswith(("LIT", "RAD"))]

    assert bool(about_light) <= bool(case.scene.lights)
    assert ("RAD-3" in case.covers) == (case.scene.shading == "simplified" and bool(case.scene.lights))


@pytest.mark.parametrize("case", all_cases(), ids=NAMES)
def test_expectations_name_pixels_shapes_and_lights_that_exist(case):
    camera, shapes, lights = case.scene.camera, len(case.scene.shapes), len(case.scene.lights)

    for expectation in case.expectations:
        assert 0 <= getattr(expectation, "column", 0) < camera.width
        assert 0 <= getattr(expectation, "row", 0) < camera.height
        assert 0 <= getattr(expectation, "shape", 0) < shapes
        assert 0 <= getattr(expectation, "light", 0) < max(lights, 1)
        assert getattr(expectation, "stage", Stage.RAY) is not Stage.CAMERA


def test_a_pattern_may_be_a_family_a_case_or_a_glob():
    family = select(["cameras"])

    assert family == select(["cameras/*"])
    assert select([family[0].name]) == family[:1]
    assert select(["primitives/sphere", "cameras"]) == (*family, *select(["primitives/sphere"]))


def test_a_family_on_request_is_asked_about_by_its_name_alone():
    by_name = select(["benchmarked"])

    assert [case.family for case in by_name] == ["benchmarked"] * len(by_name)
    assert select([by_name[0].name]) == by_name[:1]
    assert not set(NAMES) & {case.name for case in by_name}
    assert not set(by_name) & set(select(["*sphere*"]))


def test_a_pattern_that_names_nothing_lists_names_like_it():
    with pytest.raises(LookupError, match=r"no case matches 'camera'; did you mean cameras"):
        select(["camera"])


def test_a_family_may_neither_borrow_a_name_nor_use_one_twice(monkeypatch):
    (sphere, *_) = select(["primitives/sphere"])
    families = {"other": lambda: iter([sphere]), "primitives": lambda: iter([sphere, sphere])}
    monkeypatch.setattr("rayproof.cases.families.CASE_FAMILIES", families)

    with pytest.raises(ValueError, match="family 'other' yields case 'primitives/sphere', which names another family"):
        cases_of.__wrapped__("other")
    with pytest.raises(ValueError, match="case 'primitives/sphere' is yielded twice"):
        cases_of.__wrapped__("primitives")
