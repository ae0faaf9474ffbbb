"""What several tests of the tracer share."""

from collections.abc import Iterator

import pytest

from rayproof.tracer.trees.trees import host_forest


@pytest.fixture(params=["at once", "in pieces", "in halves"])
def each_builder(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Build trees as those of small meshes are, as those of large ones, and as those of very large ones."""
    host_forest.cache_clear()
    if request.param == "in pieces":
        monkeypatch.setattr("rayproof.tracer.trees.build.PIECE", 2)
    elif request.param == "in halves":
        monkeypatch.setattr("rayproof.tracer.trees.build.MOST_BY_AREA", 0)
    yield
    host_forest.cache_clear()
