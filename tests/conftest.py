"""What the tests share: the packaged LLVM is chosen before anything can import Dr.Jit, and no test keeps renders."""

import os

import pytest

from rayproof.tracer.device import llvm

llvm.select()


@pytest.fixture(autouse=True, scope="session")
def _surroundings_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keep renders of references, in this process and in its workers, out of the user's own cache."""
    os.environ.setdefault("RAYPROOF_CACHE", str(tmp_path_factory.mktemp("references")))
    os.environ.setdefault("RAYPROOF_CACHE_KEY", "the tests' own key")
    # `./rayproof test` says how it was called; hints of the tests' own commands do not depend on that.
    os.environ.pop("RAYPROOF_CALLED", None)


@pytest.fixture(params=["float32", "float64"])
def precision(request: pytest.FixtureRequest) -> str:
    """Name each precision of the tracer in turn."""
    return request.param
