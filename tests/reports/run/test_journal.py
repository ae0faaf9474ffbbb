"""What was finished is kept, exactly if it is still the same question."""

import random
import sqlite3
from contextlib import closing

import pytest

from rayproof.reports.run.workload import Journal


def _case(name: str, verdict: str = "pass") -> dict:
    return {"name": name, "family": "a", "verdict": verdict, "covers": [], "checks": [], "item": None, "key": name}


def test_a_finished_case_is_found_again_only_under_its_key(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("key", _case("family/case"))

    with Journal(tmp_path, resume=True) as again:
        assert again.finished("key") == _case("family/case")
        assert again.finished("other key") is None


def test_a_run_without_resume_starts_empty(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("key", _case("family/case"))

    with Journal(tmp_path, resume=False) as again:
        assert again.finished("key") is None


@pytest.mark.parametrize("harm", ["cut", "page", "record", "other file"])
def test_of_a_damaged_journal_what_can_be_read_is_kept_and_the_rest_is_done_again(tmp_path, harm):
    # Records that do not deflate fill pages of their own, so that the last can be lost without the first.
    with Journal(tmp_path, resume=False) as journal:
        for name in "abcdefgh":
            journal.append(name, _case(f"family/{name}") | {"reason": random.Random(name).randbytes(4096).hex()})
    path = tmp_path / "results.sqlite"
    content = bytearray(path.read_bytes())
    if harm == "cut":
        content = content[: len(content) // 2]
    elif harm == "page":
        content[-8192:-4096] = random.Random(1).randbytes(4096)
    elif harm == "record":
        with closing(sqlite3.connect(path)) as connection, connection:
            connection.execute("UPDATE cases SET record = substr(record, 1, 100) WHERE key = 'h'")
        content = bytearray(path.read_bytes())
    else:
        content = bytearray(b"not a database at all" * 100)
    path.write_bytes(content)

    with Journal(tmp_path, resume=True) as again:
        found = [name for name in "abcdefgh" if again.finished(name) is not None]
        again.append("new", _case("family/new"))

    assert "h" not in found
    assert ("a" in found) == (harm in ("page", "record"))
    with Journal(tmp_path, resume=True) as last:
        assert last.finished("new") == _case("family/new")
        assert all(last.finished(name) is not None for name in found)


def test_a_case_that_ended_in_an_error_is_done_again(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("timed out", _case("a/b", "error"))
        journal.append("abstained", _case("a/c") | {"abstained": {"radiance": "no answer within 120 s; stopped"}})
        journal.append("failed", _case("a/d", "fail"))

    with Journal(tmp_path, resume=True) as journal:
        assert journal.finished("timed out") is None
        assert journal.finished("abstained") is None
        assert journal.finished("failed") == _case("a/d", "fail")
