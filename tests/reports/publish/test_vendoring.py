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


def test_the_viewer_asks_for_nothing_and_stays_silent() -> None:
    viewer = (VENDOR / "vtk-viewer.js").read_text(encoding="utf-8")

    assert "favicon" not in viewer
    assert "image/jpeg;base64,/" not in viewer
    assert "loadDataSet" not in viewer


def test_another_page_is_refused_and_named() -> None:
    with pytest.raises(ValueError, match="no module script"):
        vtk_viewer("<html>404</html>")
    with pytest.raises(ValueError, match="found 0 times"):
        vtk_viewer('<script type="module">let a;</script>')
