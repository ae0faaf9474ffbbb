"""Pictures and figures of a report: small, of what they say, and refused in one line where there is no browser."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rayproof.reports.publish import browser
from rayproof.reports.publish.browser import MOST_BYTES
from rayproof.reports.publish.page import page
from rayproof.reports.results.document import load_results
from tests.harness.pictures import DRAWN_BY, scripts_digest
from tests.reports.publish.sample import make_folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a results folder."""
    folder = tmp_path_factory.mktemp("run")
    make_folder(folder)
    return folder


@pytest.mark.browser
def test_pictures_are_small_and_figures_are_numbers(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if (why := browser.missing()) is not None:
        pytest.skip(why)

    # In a process of its own: the browser of the other tests has a driver in this one, and two do not go together.
    # Two times each are enough where nobody reads the median of them.
    code = (
        "import sys; from rayproof.reports.publish import browser; "
        "from rayproof.reports.publish.page import page; "
        "assert browser.TIMES > 2 and page.WORST > 1; browser.TIMES, page.WORST = 2, 1; "
        "from rayproof.reports.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code]
    asked = ["report", str(run), "--pictures", str(tmp_path), "--case", "sphere/sheared", "--figures"]
    asked += ["--single-file", "--all"]
    ended = subprocess.run([*command, *asked], capture_output=True, text=True, check=False)

    assert ended.returncode == 0, ended.stderr
    out = ended.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.png", "front.png", "scene.png"]
    for path in tmp_path.iterdir():
        assert path.stat().st_size <= MOST_BYTES
        assert len(np.unique(np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3), axis=0)) > 20
    assert re.search(r"the report of 9 cases +│ +\d\.\d MB +│ +\d\.\d MB", out)
    assert re.search(r"all that is in the folder +│ +\d\.\d MB +│ +- ", out)
    for name in ("first page", "a case", "another image", "3-D"):
        assert re.search(rf"{name} +│ +\d+ ms +│ +\d+ ms", out), name
    # The file that was measured still holds all cases.
    measured = (run / page.NAME).stat().st_size
    monkeypatch.setattr(page, "WORST", 1)
    assert page.write_single_file(run, load_results(run)).stat().st_size < measured - 10_000


def test_the_documents_pictures_show_the_page_as_it_is() -> None:
    assert DRAWN_BY.read_text().strip() == scripts_digest(), "run: python -m tests.harness.pictures"
