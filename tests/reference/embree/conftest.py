from typing import Any

import pytest

from rayproof.reference import REFERENCES


@pytest.fixture
def embree():
    reference: Any = REFERENCES["embree"]()
    if reference.missing():
        pytest.skip(reference.missing())
    return reference
