"""Whatever a program does that stays alive becomes one sentence, or answers; and nothing of it outlives its worker."""

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.subjects import SERVED, Subject
from rayproof.reports.subjects import serving as module
from rayproof.reports.subjects.program import allowance, ask_capabilities, ask_program
from rayproof.reports.subjects.serving import Server
from tests.reports.subjects.conftest import SCENE

pytestmark = pytest.mark.process

PROGRAM = """
import json, os, subprocess, sys, time
def say(answer, end="\\n"):
    print(json.dumps(answer), end=end, flush=True)
def draw(output, value=0.5):
    import struct
    with open(output, "wb") as file:
        file.write(b"PF\\n6 4\\n-1.0\\n" + struct.pack("<72f", *[value] * 72))
count = 0
for line in sys.stdin:
    request = json.loads(line)
    number = request["id"]
    if "capabilities" in request:
        say({"id": number, "capabilities": {"protocol": 2, "format": "pfm", @CAPABILITIES@}})
        continue
    count += 1
    output = request["output"]
@LINES@
"""


class Asked:
    """A program with the given lines, and the worker's hold of it."""

    def __init__(self, folder: Path, *lines: str, seconds: float = 20.0, memory: int = 2**33, able: str = "") -> None:
        path = folder / "program.py"
        body = "\n".join(f"    {line}" for line in lines)
        path.write_text(PROGRAM.replace("@LINES@", body).replace("@CAPABILITIES@", able))
        command = (sys.executable, "-S", str(path))
        subject = Subject(
            name=SERVED, transport=SERVED, title="serve:test", command=command, seconds=seconds, memory=memory
        )
        self.server = Server(subject)
        self.subject = replace(subject, capabilities=ask_capabilities(subject, seconds=20, server=self.server))

    def answer(self, samples: int = 1, keep: Path | None = None) -> Answers:
        return ask_program(self.subject, SCENE, samples=samples, keep=keep, server=self.server)

    def value(self) -> float | None:
        """Return what the image has in every pixel."""
        answers = self.answer().answers
        return float(np.unique(answers[Stage.RADIANCE]).item()) if answers else None


@pytest.fixture
def asked(tmp_path: Path) -> Iterator[object]:
    made: list[Asked] = []

    def make(*lines: str, **about: object) -> Asked:
        made.append(Asked(tmp_path, *lines, **about))  # type: ignore[arg-type]
        return made[-1]

    yield make
    for one in made:
        one.server.close()
        assert not one.server.folder.exists()


RIGHT = ("draw(output, count)", "say({'id': number, 'ok': True})")


def test_it_is_started_once_and_each_request_has_a_folder_of_its_own(asked, tmp_path: Path) -> None:
    log = tmp_path / "log"
    program = asked(f"print(os.path.dirname(output), os.getcwd(), file=open({str(log)!r}, 'a'))", *RIGHT)

    assert [program.value() for _ in range(3)] == [1, 2, 3]
    folders, parents = zip(*(line.split() for line in log.read_text().splitlines()), strict=True)
    assert len({*folders}) == 3
    assert {*parents} == {str(program.server.folder)}
    assert all(Path(folder).parent == program.server.folder and not Path(folder).exists() for folder in folders)


# Lines, what is said, and what the next request gets: 1 of a program that was started again, 2 of one that runs on.
WRONG = {
    "dies": (["sys.exit('no licence')"], "it ended with exit code 1 without an answer: no licence", "started"),
    "signal": (["os.kill(os.getpid(), 11)"], "it was ended by SIGSEGV without an answer", "started"),
    "traceback": (["1 / 0"], ", in <module> | 1 / 0 | ZeroDivisionError", "started"),
    "closes its output": (["os.close(1)", "time.sleep(60)"], "closed its standard output without an answer", "started"),
    "half a line": (
        ["say({'id': number}, end='')", "sys.exit()"],
        "exit code 0 without an answer; the last line of its output has no end: '{\"id\": 1}'",
        "started",
    ),
    "answers twice": (
        ["os.write(1, (json.dumps({'id': number, 'ok': True}) + chr(10)).encode() * 2)"],
        "it answered request 1 twice",
        "started",
    ),
    "another id": (["say({'id': 7, 'ok': True})"], "request 1 was under way, and it answered 7", "started"),
    "the id before": (["say({'id': number - 1, 'ok': True})"], "it answered 0 a second time", "started"),
    "an id that is a text": (["say({'id': str(number), 'ok': True})"], 'it answered "1"', "started"),
    "no answer in it": (["say({'id': number})"], "must have one of ok, unsupported, error", "runs"),
    "two answers in it": (["say({'id': number, 'ok': True, 'error': 'x'})"], "must have one of", "runs"),
    "a wrong type": (["say({'id': number, 'ok': 'yes'})"], '`ok` of its answer must be true, got "yes"', "runs"),
    "no image": (["say({'id': number, 'ok': True})"], "the program ended well, but it wrote no image", "runs"),
    "an error": (["say({'id': number, 'error': 'no memory'})"], "the program answers with an error: no memory", "runs"),
    "writes too much": (
        ["place = open('large', 'wb')", "place.truncate(2**30)", "draw(output)", "say({'id': number, 'ok': True})"],
        f"it wrote more than {allowance(SCENE) / 2**20:g} MiB and was stopped",
        "started",
    ),
    "prints too much": (
        ["while True: print('x' * 2**20)"],
        f"it wrote more than {allowance(SCENE) / 2**20:g} MiB and was stopped",
        "started",
    ),
}


@pytest.mark.parametrize(("lines", "said", "then"), WRONG.values(), ids=WRONG.keys())
def test_what_gives_no_answer_ends_in_one_sentence_and_the_next_is_asked(
    asked, lines: list[str], said: str, then: str
) -> None:
    lines = ["if not os.path.exists('again'):", *(f"    {line}" for line in ["open('again', 'w')", *lines, "continue"])]
    program = asked(*lines, *RIGHT)

    ended = program.answer()

    assert ended.error is not None
    assert said in ended.error
    assert "\n" not in ended.error
    Path(program.server.folder, "large").unlink(missing_ok=True)
    assert program.value() == (1 if then == "started" else 2)


@pytest.mark.parametrize("half", ["", "say({'id': number}, end='')"], ids=["silent", "half a line"])
def test_one_that_hangs_is_stopped_in_time(asked, half: str) -> None:
    program = asked(*filter(None, [half]), "time.sleep(60)", seconds=0.5)
    start = time.monotonic()

    ended = program.answer()

    assert ended.stopped
    assert ended.lost
    assert "the program gave no image: it did not answer within 0.5 s and was stopped" in str(ended.error)
    assert ("has no end: '{\"id\": 1}'" in str(ended.error)) == bool(half)
    assert time.monotonic() - start < 5


def test_prints_are_ignored_counted_and_shown(asked) -> None:
    program = asked("print('loading \\x1b[31m', '{\"note\": 1}', sep='\\n')", "print()", *RIGHT)

    assert program.value() == 1
    (note,) = program.server.notes()
    assert note == "It printed 2 lines to standard output that are no answers, which are ignored: loading \ufffd[31m"
    assert program.server.notes() == ()


def test_memory_that_grows_from_scene_to_scene_is_seen_and_what_is_loaded_once_is_not(
    asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "SCENES", 6)
    leaks = asked("globals().setdefault('kept', []).append(os.urandom(2**21))", *RIGHT)
    for _ in range(7):
        leaks.answer()
    loads = asked("if count == 5: kept = os.urandom(2**26)", *RIGHT)
    for _ in range(7):
        loads.answer()

    assert 1.9 * 2**20 < leaks.server.standing().growth < 2.3 * 2**20
    assert loads.server.standing().growth == 0
