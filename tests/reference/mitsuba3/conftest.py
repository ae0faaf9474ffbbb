from typing import Any

import pytest

from rayproof.reference import REFERENCES
from rayproof.reference.mitsuba3 import program


@pytest.fixture(params=["mitsuba_scalar", "mitsuba_llvm"])
def mitsuba(request):
    reference: Any = REFERENCES[request.param]()
    missing = program.unavailable(reference.variant)
    if missing:
        pytest.skip(missing)
    return reference
