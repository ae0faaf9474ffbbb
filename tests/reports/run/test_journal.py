"""What was finished is kept, exactly if it is still the same question."""

from rayproof.reports.results.document import save_results
from rayproof.reports.run.journal import Journal, settle
from tests.reports.publish.sample import results_of


def test_a_finished_case_is_found_again_only_under_its_key(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("key", {"name": "family/case"})

    with Journal(tmp_path, resume=True) as again:
        assert again.finished("key") == {"name": "family/case"}
        assert again.finished("other key") is None


def test_a_run_without_resume_starts_empty(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("key", {"name": "family/case"})

    with Journal(tmp_path, resume=False) as again:
        assert again.finished("key") is None


def test_a_line_cut_short_by_a_kill_is_done_again_and_swallows_nothing(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("one", {"name": "family/one"})
    with (tmp_path / "journal.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"key": "two", "rec')

    with Journal(tmp_path, resume=True) as again:
        again.append("three", {"name": "family/three"})

    with Journal(tmp_path, resume=True) as last:
        assert last.finished("one") is not None
        assert last.finished("two") is None
        assert last.finished("three") is not None


def test_a_case_that_ended_in_an_error_is_done_again(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("timed out", {"verdict": "error"})
        journal.append("abstained", {"verdict": "pass", "abstained": {"embree": "no answer within 120 s; stopped"}})
        journal.append("failed", {"verdict": "fail"})

    with Journal(tmp_path, resume=True) as journal:
        assert journal.finished("timed out") is None
        assert journal.finished("abstained") is None
        assert journal.finished("failed") == {"verdict": "fail"}


def _case(name: str, verdict: str = "pass") -> dict:
    return {"name": name, "family": "a", "verdict": verdict, "covers": [], "checks": [], "item": None, "key": name}


def test_a_settled_journal_names_what_results_json_holds(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("a/one", _case("a/one"))
        journal.append("a/two", _case("a/two"))
        journal.append("an older question", _case("a/one", "fail"))
    before = (tmp_path / "journal.jsonl").stat().st_size
    save_results(tmp_path, results_of([_case("a/one")]))

    settle(tmp_path, {"a/one"})

    assert (tmp_path / "journal.jsonl").stat().st_size < before
    with Journal(tmp_path, resume=True) as again:
        assert again.finished("a/one") == _case("a/one")
        assert again.finished("a/two") == _case("a/two")
        assert again.finished("an older question") == _case("a/one", "fail")


def test_without_results_json_settled_cases_are_done_again(tmp_path):
    with Journal(tmp_path, resume=False) as journal:
        journal.append("a/one", _case("a/one"))
    path = save_results(tmp_path, results_of([_case("a/one")]))
    settle(tmp_path, {"a/one"})
    path.unlink()

    with Journal(tmp_path, resume=True) as again:
        assert again.finished("a/one") is None
