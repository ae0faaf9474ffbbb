"""The libraries in the report are the ones that were looked at, and nothing in them asks the network."""

import hashlib
import importlib.metadata
import re
from importlib.resources import files

import pytest

from tests.harness.vendoring import VENDOR, checksums, vtk_viewer

NOTES = (VENDOR / "VENDOR.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", sorted(path.name for path in VENDOR.glob("*.js")))
def test_a_library_has_the_listed_checksum_and_its_licence_beside_it(name: str) -> None:
    licence = VENDOR / f"{name.split('.')[0].removesuffix('-basic')}-LICENSE"

    assert checksums(NOTES)[name] == hashlib.sha256((VENDOR / name).read_bytes()).hexdigest()
    assert re.search(r"MIT License|BSD 3-Clause", licence.read_text(), re.IGNORECASE)


def test_the_viewer_is_the_installed_one_with_the_cuts() -> None:
    version = importlib.metadata.version("trame-vtk")
    if f"| {version} |" not in NOTES:
        pytest.skip(f"trame-vtk {version} is installed, another version is vendored")
    page = files("trame_vtk").joinpath("tools", "static_viewer.html").read_text(encoding="utf-8")

    assert vtk_viewer(page) == (VENDOR / "vtk-viewer.js").read_text(encoding="utf-8")
