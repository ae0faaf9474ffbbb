"""What becomes of the cases whose workers die, refuse or lose their answers; Dask's client is played here."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rayproof.cases.families import select
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.run.case_pipeline import finished
from rayproof.reports.run.engine import dispatch as module
from rayproof.reports.run.engine.dispatch import Dispatch
from rayproof.reports.run.engine.machine import Batch, BatchResult, packed
from rayproof.reports.run.options import CaseOptions
from rayproof.reports.run.plan import PlannedCase

distributed = pytest.importorskip("distributed")

CASE = select(["primitives/sphere"])[0]
OPTIONS = CaseOptions(references=("analytic",))
RECORD: Any = {
    "name": "played/0", "family": "played", "verdict": "pass", "renders": [], "planned": 0, "checks": [], "ran": {},
    "covers": [],
}  # fmt: skip


def planned(number: int) -> PlannedCase:
    return PlannedCase(case=replace(CASE, name=f"played/{number}"), configurations=("float32",))


class Played:
    """Dask's client, future and scheduler in one: whoever asks which workers there are has the next task done.

    `does` gets the names of a batch's cases and its worker, and returns an answer or raises as Dask would.
    """

    status, most = "running", 0

    def __init__(self, workers: list[str], does: Callable[[list[str], str], BatchResult | str]) -> None:
        self.workers, self._does = workers, does
        self.waiting: deque[Any] = deque()
        self.scheduler = SimpleNamespace(ncores=None)

    def submit(self, function: Any, run: str, facts: Any, pickled: bytes, *, workers: Any, **_: Any) -> Any:
        names = [one.case.name for one in module.pickle.loads(pickled).cases]
        future = SimpleNamespace(key=object(), names=names, workers=workers, status="pending", calls=[])
        future.add_done_callback = future.calls.append
        self.waiting.append(future)
        self.most = max(self.most, len(self.waiting))
        return future

    def cancel(self, futures: list[Any], *, force: bool) -> None:
        for future in futures:
            self.waiting.remove(future)

    def run(self, function: Any, run: str, **_: Any) -> None:
        assert function is module.stop

    def sync(self, function: Any, *, callback_timeout: float) -> dict[str, int]:
        chosen = ((one, worker) for one in self.waiting for worker in self.workers if worker in (one.workers or worker))
        for future, worker in [*chosen][:1]:
            self.waiting.remove(future)
            try:
                value = self._does(future.names, worker)
                answers = {name: packed(name, {**RECORD, "name": name}, Path("/nowhere")) for name in future.names}
                answer = BatchResult(worker=worker, finished=answers, seconds=0.1 * len(answers))
                value = replace(answer, refused=value) if isinstance(value, str) else value
                future.result, future.status = lambda timeout, value=value: value, "finished"
            except Exception as error:
                future.status = "cancelled" if isinstance(error, CancelledError) else "error"
                future.result = lambda timeout, error=error: (_ for _ in ()).throw(error)
            for call in future.calls:
                call(future)
        return dict.fromkeys(self.workers, 1)


def put_through(client: Played, count: int, folder: Path) -> tuple[list[CaseRecord], Dispatch, list[str]]:
    """Return the records in the order in which they came, and what was told meanwhile."""
    lines: list[str] = []
    dispatch = Dispatch(client, Batch(options=OPTIONS, timeout=60.0), folder, tell=lines.append)
    records = [both[1] for both in finished(dispatch, map(planned, range(count))) if both is not None]
    dispatch.close()
    return records, dispatch, lines


@pytest.fixture(autouse=True)
def _quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "facts", lambda options: {"processor": "any"})
    monkeypatch.setattr(module, "GLANCE", 0.0)
    monkeypatch.setattr(module, "WAIT", 0.2)


def killed(worker: str) -> Exception:
    return distributed.KilledWorker("task", SimpleNamespace(address=worker), 1)


def test_a_case_that_kills_workers_is_an_error_and_no_neighbour_is(tmp_path: Path) -> None:
    beside: list[int] = []

    def does(names: list[str], worker: str) -> str:
        # Who waits beside a task that kills its worker is counted by Dask, too; here, once in three times.
        beside.append(len(client.waiting))
        if "played/30" in names or (client.waiting and len(beside) % 3 == 0):
            raise killed(worker)
        return ""

    client = Played(["tls://a:1", "tls://b:1"], does)
    records, _, _ = put_through(client, 61, tmp_path)

    assert sorted(record["name"] for record in records) == sorted(f"played/{number}" for number in range(61))
    (wrong,) = [record for record in records if record["verdict"] != "pass"]
    assert (wrong["name"], wrong["verdict"], wrong["worker"]) == ("played/30", "error", "tls://a:1")
    assert "2 workers died that had nothing else to do" in wrong["reason"]
    assert client.most <= module.WINDOW * 2


def test_what_waits_for_workers_that_have_gone_is_done_by_new_ones(tmp_path: Path) -> None:
    def does(names: list[str], worker: str) -> str:
        if worker == "tls://b:1" and client.waiting:
            client.workers = ["tls://a:1", "tls://c:1"]  # as a nanny starts one again, elsewhere
        return "differs" if worker == "tls://a:1" else ""

    client = Played(["tls://a:1", "tls://b:1", "tls://d:1"], does)
    records, _, _ = put_through(client, 30, tmp_path)

    assert len({record["name"] for record in records}) == len(records) == 30
    assert {record["worker"] for record in records} == {"tls://b:1", "tls://c:1"}


def test_a_lost_answer_is_made_again_and_an_unreadable_batch_ends_the_run(tmp_path: Path) -> None:
    errors: list[Exception] = [CancelledError(), ModuleNotFoundError("No module named 'rayproof'")]

    def does(names: list[str], worker: str) -> str:
        if "played/0" in names and len(errors) == 2:
            raise errors.pop(0)
        if "played/9" in names:
            raise errors[0]
        return ""

    records, dispatch, _ = put_through(Played(["tls://a:1"], does), 10, tmp_path)

    assert "played/0" in {record["name"] for record in records}
    assert dispatch.gone == "a worker cannot read a batch: ModuleNotFoundError: No module named 'rayproof'"


@pytest.mark.parametrize(("gone", "why"), [("workers", "no worker is left"), ("scheduler", "the scheduler has gone")])
def test_a_run_that_is_left_alone_ends(tmp_path: Path, gone: str, why: str) -> None:
    def does(names: list[str], worker: str) -> str:
        if "played/20" in names:
            client.workers = [] if gone == "workers" else client.workers
            client.status = "running" if gone == "workers" else "connecting"
        return ""

    client = Played(["tls://a:1"], does)
    records, dispatch, _ = put_through(client, 40, tmp_path)

    assert 0 < len(records) < 40
    assert dispatch.gone is not None
    assert why in dispatch.gone
