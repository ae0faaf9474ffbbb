"""A formula of one's own, slot=FILE.py:function, in the commands that take formulas."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reports.run import suite
from rayproof.reports.run.engine.machine import write
from rayproof.reports.run.options import CaseOptions, RunOptions, case_options
from rayproof.reports.run.worker_tasks import render_tracer
from rayproof.reports.run.workers import workers
from rayproof.reports.subjects import TRACER
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas.own_file import forget, sources
from rayproof.tracer.render import render
from tests.reports.commands.conftest import Rayproof

MINE = """
import drjit as dr
from factor import FACTOR

def nearest_hit(ray, sphere, interval):
    f = ray.origin - sphere.center
    a, h = dr.squared_norm(ray.direction), -dr.dot(f, ray.direction)
    quarter = h * h - a * (dr.squared_norm(f) - dr.square(sphere.radius * FACTOR))
    root = dr.sqrt(dr.select(quarter >= 0, quarter, 0))
    return dr.select(quarter >= 0, interval.smallest((h - root) / a, (h + root) / a), dr.inf)
"""
FORMULA = "sphere=mine.py:nearest_hit"
NAME = f"float32/{FORMULA}"
CASE = "primitives/sphere"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in a folder with a formula and a neighbour that it imports."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "factor.py").write_text("FACTOR = 1\n")
    return tmp_path


@pytest.mark.process
def test_a_run_finds_it_and_its_workers_render_by_it(
    rayproof: Rayproof, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "factor.py").write_text("FACTOR = 0.25\n")
    requests: list[RunOptions] = []
    monkeypatch.setattr(suite, "run", lambda request, _: (requests.append(request) or 0, ()))

    assert rayproof("run", CASE, "--formula", "sphere=./mine.py:nearest_hit", "--jobs", 1).code == 0

    (request,) = requests
    assert request.configurations == (NAME,)
    case, pool = select([CASE])[0], workers(request.subject, jobs=request.jobs, timeout=request.timeout)
    reply = pool.reply(TRACER, partial(render_tracer, case, case_options(request, ()), NAME))
    pool.close()
    scene, answered = case.scene, reply.value.answers.answers[Stage.OBJECT]
    usual = render(scene, [Stage.OBJECT], Configuration())[Stage.OBJECT]
    assert np.count_nonzero(answered >= 0) < 0.5 * np.count_nonzero(usual >= 0)  # half the radius


def test_a_file_that_changes_during_a_run_is_an_error_and_its_content_is_in_every_key(folder: Path) -> None:
    about = {"selectors": (), "out": folder, "resume": True, "require": (), "jobs": 1, "timeout": 1.0, "json": None}
    request = RunOptions(**about, configurations=(NAME,))
    before, (case,) = case_options(request, ()), select([CASE])
    assert render_tracer(case, before, NAME).answers.error is None

    (folder / "mine.py").write_text(f"{MINE}\n# another\n")

    assert case_options(request, ()).own != before.own
    with pytest.raises(RuntimeError, match=r"mine.py:nearest_hit has changed since the run began"):
        render_tracer(case, before, NAME)


@pytest.mark.process
@pytest.mark.parametrize("command", ["run", "render", "probe", "stability", "tradeoff"])
def test_a_mistake_in_it_ends_with_2_and_one_line_everywhere(rayproof: Rayproof, folder: Path, command: str) -> None:
    before, option = {
        "run": ((CASE,), "--formula"),
        "render": ((CASE, "a.exr"), "--formula"),
        "probe": ((CASE, 1, 1), "--formula"),
        "stability": ((), None),
        "tradeoff": (("SPH-FAR",), None),
    }[command]
    ended = rayproof(command, *before, *([option] if option else []), "sphere=mine.py:nearest")

    assert ended.code == 2
    assert ended.error == "rayproof: mine.py has no function 'nearest'; it has nearest_hit\n"


def test_it_travels_with_what_it_imports_and_is_the_same_where_it_arrives(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rayproof.tracer.formulas.own_file._COPIES", {})
    before = Configuration.parse(NAME).own
    path, files = sources(Configuration.parse(NAME).formula("sphere"))
    arrived = tmp_path_factory.mktemp("arrived")
    write(files, arrived)
    for name in files:
        (folder / name).unlink()
    forget()

    options = CaseOptions(
        references=(),
        own=tuple(f"{place} {digest}" for place, digest in before.items()),
        copies=((path, str(arrived / "mine.py")),),
    )
    answers = render_tracer(select([CASE])[0], options, NAME).answers

    assert sorted(files) == ["factor.py", "mine.py"]
    assert answers.name == NAME
    assert Configuration.parse(NAME).own == before
    (arrived / "factor.py").write_text("FACTOR = 2\n")
    forget()
    assert Configuration.parse(NAME).own != before
