"""What tests of the report share: one browser, since two drivers do not go together in a process."""

from collections.abc import Iterator
from typing import Any

import pytest

from rayproof.reports.publish.browser.chromium import chromium, missing


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Return a headless Chromium, or skip with the reason that there is none."""
    if (why := missing()) is not None:
        pytest.skip(why)
    with chromium() as one:
        yield one
