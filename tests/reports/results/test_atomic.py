"""A file is written whole or not at all."""

import pytest

from rayproof.reports.results.files import remove_drafts, replacing, write_text


def test_a_writer_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    path = write_text(tmp_path / "deep" / "a.txt", "old")

    def fail() -> None:
        with replacing(path) as draft:
            draft.write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        fail()

    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]


def test_text_that_utf8_cannot_carry_does_not_stop_a_report(tmp_path):
    assert write_text(tmp_path / "a.txt", "a\ud800b").read_text() == "a?b"


def test_what_killed_writers_had_begun_is_removed_and_nothing_else(tmp_path):
    (tmp_path / "a.b").mkdir()
    for name in ("results.json", ".owner", ".hidden", ".v1.2.json", "a.b/.c.99.js", ".results.123.json", ".x.7"):
        (tmp_path / name).write_text("")

    remove_drafts(tmp_path)

    left = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*"))
    assert left == [".hidden", ".owner", "a.b", "results.json"]
