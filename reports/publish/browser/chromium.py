"""Debian's Chromium without a window, by Playwright: both are there for development only."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

NAMES = ("chromium", "chromium-browser", "google-chrome")


def missing() -> str | None:
    """Return in a sentence what keeps one from looking, or None."""
    if find_spec("playwright") is None:
        return "Playwright is not installed: pip install playwright"
    return None if _found() else "Chromium is not installed; on Debian: apt-get install chromium"


@contextmanager
def chromium() -> Iterator[Any]:
    """Give a headless Chromium.

    Raises:
        LookupError: it, or Playwright, is not installed.

    """
    if (why := missing()) is not None:
        raise LookupError(why)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=_found())
        try:
            yield browser
        finally:
            browser.close()


def _found() -> str | None:
    return next(filter(None, map(shutil.which, NAMES)), None)


def address(page: Path, /, **parts: str) -> str:
    """Return the address of a place of the report."""
    return f"{page.resolve().as_uri()}#{urlencode(parts)}"
