"""A Python function by `python:FILE.py:FUNCTION`: what it raises is named with file and line, and it stays alive."""

from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest

from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.choosing import chosen
from rayproof.reports.subjects.program import ask_capabilities, ask_program
from rayproof.reports.subjects.protocol import Capabilities
from rayproof.reports.subjects.serving import Server
from tests.reports.subjects.conftest import SCENE

pytestmark = pytest.mark.process

FILE = """
    import os
    import numpy as np
    from beside import deep
    print("loading")
    count = 0
    def grey(scene, stages):
        global count
        count += 1
        print("no end", end="")
        os.system("cat > /dev/null")
        size = scene.camera.height, scene.camera.width
        return {"radiance": np.full((*size, 3), count), "distance": np.ones(size)}
    grey.deterministic = True
    def raising(scene, stages):
        return {"radiance": scene.shapes[9]}
    def deeper(scene, stages):
        return deep(scene)
    def linear(scene, stages):
        return np.linalg.inv(np.zeros((2, 2)))
    def unable(scene, stages):
        raise NotImplementedError("no cubes")
    def flat(scene, stages):
        return {"radiance": np.zeros(3)}
"""

Ask = Callable[..., tuple[Server, list[Answers]]]


@pytest.fixture
def ask(tmp_path: Path) -> Iterator[Ask]:
    """Return what asks a function of FILE so many times."""
    (tmp_path / "mine.py").write_text(dedent(FILE))
    (tmp_path / "beside.py").write_text("def deep(scene):\n    raise OverflowError('too\\nlarge')\n")
    servers: list[Server] = []

    def asked(function: str, times: int = 1) -> tuple[Server, list[Answers]]:
        def able(subject: Subject) -> Capabilities:
            servers.append(Server(subject))
            return ask_capabilities(subject, seconds=60, server=servers[-1])

        subject = chosen(f"python:{tmp_path / 'mine.py'}:{function}", ask=able, seconds=60, memory=2**34)
        return servers[-1], [ask_program(subject, SCENE, samples=1, server=servers[-1]) for _ in range(times)]

    yield asked
    for server in servers:
        server.close()


def test_it_stays_alive_and_its_prints_and_helpers_disturb_nothing(ask: Ask) -> None:
    server, answers = ask("grey", 3)

    assert [float(np.unique(one.answers[Stage.RADIANCE]).item()) for one in answers] == [1, 2, 3]
    assert set(answers[0].answers) == {Stage.RADIANCE, Stage.DISTANCE}
    assert server.notes()[0].startswith("It printed 4 lines to standard output")
    able = ask_capabilities(server.subject, seconds=60, server=server)
    assert able == Capabilities(protocol=2, name="grey", precision="float64", deterministic=True)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("raising", "IndexError: tuple index out of range (mine.py, line 16)"),
        ("deeper", "OverflowError: too large (beside.py, line 2)"),
        ("linear", "LinAlgError: Singular matrix (mine.py, line 20)"),
        ("flat", "ValueError: radiance must have shape (4, 6, 3) = (height, width, channels), got (3,)"),
    ],
)
def test_what_it_raises_is_named_with_file_and_line(ask: Ask, function: str, said: str) -> None:
    _, (answer,) = ask(function)

    assert answer.error == f"the function fails: {said}"


def test_it_may_say_that_it_cannot(ask: Ask) -> None:
    _, (answer,) = ask("unable")

    assert {*answer.unsupported.values()} == {"no cubes"}
