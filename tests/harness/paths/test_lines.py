"""Every line of the tracer that puts formulas together is executed by the suite, or listed with its reason."""

from pathlib import Path

import pytest

from tests.harness.paths import lines
from tests.harness.paths.__main__ import paths
from tests.harness.paths.lines import excused, left, lines_of

TEXT = '''
class Protocol:
    def asked(self):
        ...
    def told(self):
        """Return nothing."""

def told(x):
    if x:
        raise ValueError(
            "no"
        )
    return [one for one in x]

TABLE = [k for k in range(3)]
'''


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "some.py"
    path.write_text(TEXT)
    return path


@pytest.mark.process
def test_the_suite_executes_the_tracer(capsys: pytest.CaptureFixture[str]) -> None:
    assert (paths(lines=True), capsys.readouterr().out.count("\n")) == (0, 1)


@pytest.mark.process
def test_a_line_that_nobody_executes_is_told_unless_it_refuses_or_declares(file: Path) -> None:
    assert lines_of(file) == {3, 4, 5, 8, 9, 10, 11, 13}
    assert left("some.py", file, {8, 9}) == {13: "return [one for one in x]"}


def test_a_reason_for_what_is_not_there_is_a_mistake(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "FUNCTIONS", {"some.py:told": "a test says so"})
    assert left("some.py", file, set()) == {}

    monkeypatch.setattr(lines, "LINES", {"some.py:return nothing": "a test says so"})
    with pytest.raises(LookupError, match=r"some\.py:return nothing"):
        excused("some.py", file)
