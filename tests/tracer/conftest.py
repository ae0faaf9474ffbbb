"""What several tests of the tracer share."""

from collections.abc import Iterator

import pytest

from rayproof.tracer.acceleration.triangle_bvh import host_forest


@pytest.fixture(params=["by area", "by median"])
def each_builder(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Build the trees of triangles as those of small meshes are, and as those of large ones."""
    host_forest.cache_clear()
    if request.param == "by median":
        monkeypatch.setattr("rayproof.tracer.acceleration.builder.MOST_BY_AREA", 0)
    yield
    host_forest.cache_clear()
