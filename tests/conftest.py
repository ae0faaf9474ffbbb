"""What the tests share: the packaged LLVM is chosen before anything can import Dr.Jit."""

import pytest

from tracer import llvm

llvm.select()


@pytest.fixture(params=["float32", "float64"])
def precision(request: pytest.FixtureRequest) -> str:
    """Name each precision of the tracer in turn."""
    return request.param
