"""The soak itself: it hits what it says, sees what was lost or left, and says so by its exit code."""

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from rayproof.reports.run.engine.cluster import LIFETIME
from tests.harness.soak.disturbing import MEMORY, PAUSE, STOP, Signal, hit, processes
from tests.harness.soak.engine import engine
from tests.harness.soak.rounds import Round
from tests.harness.soak.site import DRAWING, TIMEOUT, Ended, Site, Tally, deadlines

CASE = {"name": "a", "verdict": "pass", "checks": []}


@pytest.mark.process
@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM", STOP, PAUSE, MEMORY])
def test_a_hit_is_what_it_is_called(name: str) -> None:
    code = "import time\nprint(flush=True)\nwhile True:\n    time.sleep(0.01)\n    x = bytearray(2**26)"
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert child.stdout is not None
    child.stdout.readline()
    process = psutil.Process(child.pid)
    try:
        assert hit(process, name, random.Random(1))
        if name == STOP:
            time.sleep(0.2)
            assert process.status() == psutil.STATUS_STOPPED
        elif name == PAUSE:
            assert process.status() != psutil.STATUS_STOPPED
        else:
            expected = 1 if name == MEMORY else -getattr(signal, name)
            assert child.wait(timeout=20) == expected
            assert not hit(process, name, random.Random(1))
    finally:
        child.kill()
        child.communicate()


def test_only_what_stops_a_process_is_waited_for() -> None:
    hits = [Signal(name=name, target="judge", moment="random") for name in ("SIGKILL", PAUSE, STOP)]

    assert deadlines(hits, TIMEOUT) == 2 * TIMEOUT
    assert deadlines([Signal(name=STOP, target="draw", moment="random")], TIMEOUT) == DRAWING + TIMEOUT
    assert deadlines([Signal(name=STOP, target="engine worker", moment="random")], TIMEOUT) == LIFETIME + TIMEOUT


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """Return a site on which nothing has run."""
    return Site(tmp_path / "site", cases=1, jobs=1)


def judged(site: Site, cases: list[dict[str, object]], ended: Ended | None = None) -> Tally:
    """Return what a round takes down of a run that recorded these cases."""
    tally = Tally()
    one = Round(site, random.Random(0), tally, program=False, number=0, most=1)
    one._out.mkdir()
    (one._out / "results.json").write_text(json.dumps({"cases": cases}))
    if ended is not None:
        one._note(ended, "SIGKILL to judge")
    one._verify({"a": ["pass", []]})
    return tally


@pytest.mark.parametrize(
    ("cases", "figures"),
    [
        ([CASE], (1, 1, 0, 0)),
        ([], (1, 0, 0, 0)),
        ([CASE, CASE], (1, 1, 1, 0)),
        ([{**CASE, "verdict": "fail"}], (1, 1, 0, 1)),
    ],
)
def test_what_is_lost_doubled_or_wrong_is_counted(site: Site, cases: list[dict[str, object]], figures: object) -> None:
    tally = judged(site, cases)

    assert (tally.planned, tally.recorded, tally.twice, tally.wrong) == figures
    assert tally.good == (cases == [CASE])


def test_what_hangs_or_shows_its_inside_is_counted(site: Site) -> None:
    tally = judged(site, [CASE], Ended(code=None, seconds=1.0, said="", complaint="Traceback\nValueError: no"))

    assert (tally.hung, tally.tracebacks, tally.good) == (1, 1, False)


@pytest.mark.process
def test_what_is_left_is_counted_and_ended(site: Site) -> None:
    orphan = subprocess.Popen(["sleep", "600"])
    (site.folder / "tmp" / "rayproof-left").mkdir()
    out = site.folder / "out"
    out.mkdir()
    (out / ".results.7.json").write_text("")

    assert site.left() == [f"sleep {orphan.pid}"]
    assert not psutil.pid_exists(orphan.pid)
    orphan.wait()
    assert sorted(site.folders(out)) == ["out/.results.7.json", "tmp/rayproof-left"]
    assert site.folders(out) == []


@pytest.mark.process
def test_a_worker_of_the_cluster_that_is_hit_has_a_successor(site: Site) -> None:
    with engine(site.folder / "engine", site.environment, workers=1) as one:
        scheduler, nanny = one.pids
        assert processes(nanny, scheduler).keys() >= {"scheduler"}
        deadline = time.monotonic() + 60
        while "engine worker" not in processes(nanny) and time.monotonic() < deadline:
            time.sleep(0.1)
        worker = processes(nanny)["engine worker"][0]
        psutil.Process(nanny).kill()
        psutil.wait_procs([psutil.Process(nanny)], timeout=10)
        one.mend()

        assert one.pids[0] == scheduler
        assert one.pids[1] != nanny
        assert psutil.wait_procs([worker], timeout=10)[1] == [], "it ends with its nanny"

    assert site.left() == []
    assert site.folders(site.folder / "out") == []
