"""What tests of the reports share: commands in this process, one browser, one sample of a results folder, published.

Two drivers of a browser do not go together in a process; and most tests only read the folder.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from rayproof.reports.publish import publish_all
from rayproof.reports.publish.browser import chromium, missing
from tests.reports.commands.conftest import rayproof as rayproof
from tests.reports.publish.everything import make_everything
from tests.reports.publish.modules import loaded
from tests.reports.publish.sample import make_folder
from tests.reports.publish.visits import Visit


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Return a headless Chromium, or skip with the reason that there is none."""
    if (why := missing()) is not None:
        pytest.skip(why)
    with chromium() as one:
        yield one


class Published(NamedTuple):
    """A results folder and what its results.json holds."""

    folder: Path
    results: dict[str, Any]


@pytest.fixture(scope="session")
def published(tmp_path_factory: pytest.TempPathFactory) -> Published:
    """Return the sample folder with every publication in it."""
    folder = tmp_path_factory.mktemp("results")
    results = make_folder(folder)
    publish_all(folder)
    return Published(folder, results)


@pytest.fixture(scope="session")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a published folder that has something for every page."""
    folder = tmp_path_factory.mktemp("everything")
    make_everything(folder)
    return folder


@pytest.fixture
def visit(browser: Any, published: Published) -> Iterator[Visit]:
    """Return a visit to the sample report that must end without complaint and without leaving the folder."""
    one = Visit(browser, published.folder)
    yield one
    one.end()


@pytest.fixture(scope="module")
def run(browser: Any) -> Iterator[Any]:
    """Return a function that evaluates JavaScript with the page's modules, in a page without anything else."""
    page = loaded(browser)
    yield page.evaluate
    page.close()
