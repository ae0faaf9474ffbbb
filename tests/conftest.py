"""What the tests share: the packaged LLVM is chosen before anything can import Dr.Jit, and no test keeps renders.

The markers in `pyproject.toml` say what a test takes beyond its own process. They are held to be true while tests run:
an audit hook hears of every child process and of every first import of another renderer, and a test that does what its
markers do not say fails. What is imported once, or started once for all tests of a process, is heard of once, so that a
marker that is missing is sure to be found where only tests without markers run.
"""

import multiprocessing.util
import os
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from rayproof.reports.results import provenance
from rayproof.tracer.kernel import compiler
from tests.command_line import command as command

compiler.choose_packaged_llvm()

HERE = Path(__file__).parent
STARTS = {"os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.system", "subprocess.Popen"}
RENDERERS = {"mitsuba", "pyradiance"}
# Who asks for one of these fixtures has its marker: what they start serves all tests, and is heard of in the first.
MARKED = {
    "browser": "browser",
    "mitsuba": "references",
    "radiance": "references",
}
# Files that take five seconds of processor time or more, the longest first. Their tests are marked `slow`, and where
# files run side by side they are begun in this order, since one that is begun last is waited for alone.
LONGEST = (
    "test_architecture.py",
    "reports/run/test_cluster_faults.py",
    "reports/run/test_scheduler.py",
    "reports/processes/test_pool.py",
    "reports/api/test_timed_frames.py",
    "reports/publish/test_accessibility.py",
    "examples/test_notebooks.py",
    "reports/studies/stability/test_targets.py",
    "harness/audit/test_diagnosing.py",
    "reports/diagnosis/test_diagnosing.py",
    "examples/test_renderers.py",
    "reports/run/test_interrupting.py",
    "reports/publish/test_case_page.py",
    "cases/test_limited_renderers.py",
    "harness/verdicts/test_certify.py",
    "harness/audit/test_liar.py",
    "reports/judge/comparison/test_decidable.py",
    "reports/studies/stability/test_worst.py",
    "reports/judge/nearby/test_declared.py",
    "reports/judge/nearby/test_moving_together.py",
    "cases/families/test_watertight.py",
    "tracer/test_culling.py",
    "reports/judge/nearby/test_lights.py",
    "reports/judge/nearby/test_asking.py",
    "reports/judge/comparison/test_declared_epsilons.py",
    "tracer/test_packets.py",
)


class _Guard:
    """What the test that runs now may do, and what it did beyond that."""

    def __init__(self) -> None:
        self.allowed: frozenset[str] | None = None  # markers of the test; None outside of all tests
        self.complaint = ""

    def hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Stop what the running test is not marked for, and remember it in case that somebody catches that."""
        if self.allowed is None:
            return
        if event in STARTS and not self.allowed:
            self.complaint = f"it starts a child process ({event} {arguments[:1]}), so it must be marked `process`"
        elif event == "import" and arguments[0] in RENDERERS and "references" not in self.allowed:
            self.complaint = f"it imports {arguments[0]}, so it must be marked `references`"
        else:
            return
        pytest.fail(self.complaint, pytrace=False)

    def held(self) -> Generator[None]:
        """Wrap a phase of the test; fail it with the complaint there is, whatever became of that."""
        try:
            return (yield)
        finally:
            if self.complaint:
                complaint, self.complaint = self.complaint, ""
                pytest.fail(complaint, pytrace=False)


GUARD = _Guard()
sys.addaudithook(GUARD.hear)
_spawn = multiprocessing.util.spawnv_passfds


def _audited_spawn(path: bytes, *rest: Any) -> int:
    """Start a process for `multiprocessing`, which raises no audit event of its own."""
    sys.audit("os.posix_spawn", path, *rest)
    return _spawn(path, *rest)


multiprocessing.util.spawnv_passfds = _audited_spawn


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marker that no test has by itself."""
    config.addinivalue_line("markers", "slow: in a file that takes five seconds of processor time or more")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark who asks for a fixture that costs and what is slow, and let a process of several begin with the longest."""
    place = {HERE / name: number for number, name in enumerate(LONGEST)}
    for item in items:
        if item.path in place:
            item.add_marker("slow")
        for fixture in sorted(MARKED.keys() & set(getattr(item, "fixturenames", ()))):
            item.add_marker(MARKED[fixture])
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: place.get(item.path, len(place)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    """Hold a test to its markers from its first fixture on."""
    GUARD.allowed = frozenset({"browser", "process", "references"} & {marker.name for marker in item.iter_markers()})
    return (yield from GUARD.held())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Generator[None]:
    """Hold it while it runs."""
    return (yield from GUARD.held())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown() -> Generator[None]:
    """Hold it until its last fixture is gone."""
    try:
        return (yield from GUARD.held())
    finally:
        GUARD.allowed = None


@pytest.fixture(autouse=True, scope="session")
def _surroundings_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keep renders of references, in this process and in its workers, out of the user's own cache."""
    os.environ.setdefault("RAYPROOF_CACHE", str(tmp_path_factory.mktemp("references")))
    # `./rayproof test` says how it was called; hints of the tests' own commands do not depend on that.
    os.environ.pop("RAYPROOF_CALLED", None)


@pytest.fixture(params=["float32", "float64"])
def precision(request: pytest.FixtureRequest) -> str:
    """Name each precision of the tracer in turn."""
    return request.param


GIT = provenance.git


@pytest.fixture(scope="session", autouse=True)
def no_commit() -> Iterator[None]:
    """Let results come from no commit: asking git starts a process. A test of commits takes `GIT` back."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provenance, "git", lambda *words, at=Path(): "")
        yield
