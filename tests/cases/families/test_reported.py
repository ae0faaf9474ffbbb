"""Reported mistakes: each function names one public report, and its scene is lit."""

import inspect
import re

import numpy as np
import pytest

import rayproof
from rayproof.cases.case import Case, Flux
from rayproof.cases.families import cases_of, reported

CASES = cases_of("reported")
ADDRESS = re.compile(r"https://github\.com/[\w.-]+/[\w.-]+/(?:issues|pull)/[0-9]+ \.")
REPORTS = {
    name: function
    for name, function in vars(reported).items()
    if inspect.isfunction(function) and inspect.signature(function).return_annotation is Case and name[0] != "_"
}


def test_each_function_names_a_report_of_its_own() -> None:
    addresses = [ADDRESS.findall(inspect.getdoc(function) or "") for function in REPORTS.values()]

    assert len(REPORTS) >= 12
    assert [len(found) for found in addresses] == [1] * len(REPORTS)
    assert len({found[0] for found in addresses}) == len(REPORTS)
    # Each case is made by one of them.
    source = inspect.getsource(reported.reported)
    assert all(f"yield {name}(" in source for name in REPORTS)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_radiance_alone_sees_most_of_it(case: Case) -> None:
    radiance = rayproof.oracle(case.scene)["radiance"]

    assert np.mean(radiance.max(axis=-1) > 0) >= 0.3


def test_the_six_faces_of_a_cube_receive_all_flux() -> None:
    faces = [case for case in CASES if case.name.startswith("reported/middle_of_a_cube/")]
    received = [[flux.value for flux in case.expectations if isinstance(flux, Flux)] for case in faces]

    assert len(faces) == 6
    np.testing.assert_allclose(np.sum(received, axis=0), faces[0].scene.lights[0].flux, rtol=1e-15)
