import tempfile
from typing import Any

import pytest

from rayproof.reference import REFERENCES


@pytest.fixture
def radiance():
    reference: Any = REFERENCES["radiance"]()
    if reference.missing():
        pytest.skip(reference.missing())
    return reference


@pytest.fixture(autouse=True)
def leftovers(tmp_path, monkeypatch):
    """Give the test a temporary folder of its own, and hold it to leaving nothing there."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    yield tmp_path
    assert [*tmp_path.iterdir()] == []
