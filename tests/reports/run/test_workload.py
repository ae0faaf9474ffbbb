"""As many cases are on their way as keep all processors busy."""

from typing import Any

from rayproof.reports.run.case_pipeline import AT_LEAST, PIXELS, has_room
from rayproof.reports.run.workload import FirstCalls
from rayproof.reports.subjects import PROGRAM, SERVED, Subject


def test_small_cases_start_until_their_pixels_are_many():
    small = 80 * 64
    running = []
    while has_room(running):
        running.append(small)

    assert PIXELS <= sum(running) < PIXELS + small


def test_a_few_large_ones_start_all_the_same():
    assert has_room([PIXELS] * (AT_LEAST - 1))
    assert not has_room([PIXELS] * AT_LEAST)


def record(error: str | None, name: str = "exec", *, lost: bool = False) -> dict[str, Any]:
    """Return the record of a case in which a program ended so."""
    renders = [{"renderer": name, "error": error}, {"renderer": "analytic", "error": None}]
    return {"renders": renders} | ({"lost": [name]} if lost else {})


def after(*errors: str | None, planned: int = 9) -> str | None:
    calls = FirstCalls(Subject(name=PROGRAM, transport=PROGRAM, title="exec:mine"), planned)
    for error in errors:
        calls.finished(record(error))
    return calls.hopeless


def test_first_calls_that_fail_alike_are_hopeless_whatever_their_folder_is_called():
    said = [f"exit code 1: no file /tmp/rayproof-{word}/a-b/model.bin" for word in ("x", "y", "z")]

    assert after(*said) == f"the first 3 calls fail alike: {said[-1]}"
    assert after(*said[:2]) is None


def test_one_image_other_words_or_few_cases_are_a_reason_to_go_on():
    assert after("exit code 1", None, "exit code 1", "exit code 1") is None
    assert after("exit code 1", "it was ended by SIGSEGV", "exit code 1") is None
    assert after("exit code 1", "exit code 1", "exit code 1", planned=3) is None


def test_a_program_that_is_lost_three_times_without_an_answer_between_is_hopeless():
    def hopeless(*lost: bool, again: bool = False) -> str | None:
        calls = FirstCalls(Subject(name=SERVED, transport=SERVED, title="serve:mine"), 9)
        calls.finished(record(None, SERVED))
        for number, died in enumerate(lost):
            (calls.asked_again if again else calls.finished)(
                record(f"exit {number}" if died else None, SERVED, lost=died)
            )
        return calls.hopeless

    assert hopeless(True, True, False, True, True) is None
    assert hopeless(True, True, True) == (
        "the program died or exceeded a limit 3 times in a row, without an answer: exit 2"
    )
    assert hopeless(True, True, True, again=True) is not None
