from typing import Any

import pytest

from rayproof.reference import REFERENCES


@pytest.fixture
def tachyon():
    reference: Any = REFERENCES["tachyon"]
    if missing := reference.missing():
        pytest.skip(missing)
    return reference()
