"""What campaigns found, each a file of its own: refused as its reader says, or taken."""

from pathlib import Path

import pytest

from tests.harness.fuzz.campaign import Figures, read_once
from tests.harness.fuzz.targets import TARGETS

FOUND = Path(__file__).with_name("found")


@pytest.mark.parametrize("file", sorted(path.name for path in FOUND.iterdir()))
def test_what_was_found_is_mended(file: str, tmp_path: Path) -> None:
    """The file's name begins with its target's."""
    figures = Figures()

    wrong = read_once(TARGETS[file.split("_")[0]](), tmp_path, (FOUND / file).read_bytes(), figures)

    assert wrong is None
    assert figures.refused + figures.taken == 1
