from typing import Any

import pytest

from rayproof.reference import REFERENCES


@pytest.fixture
def povray():
    reference: Any = REFERENCES["povray"]
    if missing := reference.missing():
        pytest.skip(missing)
    return reference()
