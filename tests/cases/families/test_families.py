"""What every case family must keep: deterministic, named once, complete in what it covers."""

from collections import Counter

import pytest

from rayproof.cases.case import ITEMS, Flux, PixelValue
from rayproof.cases.families import all_cases, cases_of, select
from rayproof.cases.scene import Mesh
from rayproof.cases.stages import Stage
from rayproof.tracer.shapes.meshes import degenerate

NAMES = [case.name for case in all_cases()]


def test_no_two_cases_share_a_name():
    assert max(Counter(NAMES).values()) == 1


def test_no_two_cases_ask_the_same_scene():
    repeated = [scene for scene, count in Counter(case.scene for case in all_cases()).items() if count > 1]

    assert repeated == []


def test_a_face_without_area_is_in_no_mesh_but_the_one_that_is_made_for_it():
    flat = [
        case.name
        for case in all_cases()
        for shape in case.scene.shapes
        if isinstance(shape, Mesh) and degenerate(shape).any()
    ]

    assert flat == ["meshes/degenerate"]


@pytest.mark.parametrize("case", all_cases(), ids=NAMES)
def test_a_case_asks_for_no_more_than_its_image_has(case):
    camera = case.scene.camera
    assert 0 < case.least_interior <= camera.width * camera.height
    assert 0 < case.most_explained <= 0.2
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


def test_a_family_may_neither_borrow_a_name_nor_use_one_twice(monkeypatch):
    (sphere, *_) = select(["primitives/sphere"])
    families = {"other": lambda: iter([sphere]), "primitives": lambda: iter([sphere, sphere])}
    monkeypatch.setattr("rayproof.cases.families.CASE_FAMILIES", families)

    with pytest.raises(ValueError, match="family 'other' yields case 'primitives/sphere', which names another family"):
        cases_of.__wrapped__("other")
    with pytest.raises(ValueError, match="case 'primitives/sphere' is yielded twice"):
        cases_of.__wrapped__("primitives")


# Closed forms: those that cases carry are the published numbers, and each tolerance is far below what it guards.


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


def test_the_central_radiance_is_one_number_at_every_distance_of_the_camera():
    values = [tuple(e.value for e in case.expectations if isinstance(e, PixelValue)) for case in select(["invariance"])]

    assert len(values) > 1
    assert len(set(values)) == 1
