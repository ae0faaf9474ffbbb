"""Where a soak's runs take place: scenes, a program under test, a cache and a folder for temporary files of its own."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from rayproof import HOLDER
from rayproof.cases.scene_json import save_scene
from rayproof.reports.processes.signals import adopt_orphans, descendants
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.compact import expand
from rayproof.reports.results.records import RunRecord
from rayproof.reports.run import cache_store
from rayproof.reports.run.engine.cluster import LIFETIME
from tests.benchmarks.growth.scenes import small_scenes
from tests.harness.soak.disturbing import ENGINE_WORKER, Signal
from tests.harness.soak.engine import made_by_the_run

COMMAND = "import sys; from rayproof.reports.cli import main; sys.exit(main())"
TIMEOUT = 10.0  # s, the least deadline of every render and judgement of a disturbed run
DRAWING = 30.0  # s after which a picture process that says nothing is ended
AMPLE = 600.0  # s for a run that nobody disturbs
# A disturbed run starts its workers anew and its cases wait for deadlines; the machine may have other work.
SLACK = 3.0
PARTING = 10.0  # s after a run's end until which what it started must be gone
JUDGED = ("judgement",)  # kinds of entries without which a run has work to do
# It answers as the tracer did, from a file once it has one, and has a child in a session of its own meanwhile.
PROGRAM = """#!/bin/sh
[ "$1" = --capabilities ] && exit 1
setsid sleep 600 &
child=$!
key=$(sha256sum < "$1" | cut -c 1-64)
kept="{kept}/$key.exr"
if [ ! -f "$kept" ]; then
    "{python}" -c "{command}" render "$1" "$2" > /dev/null && cp "$2" "$kept.$$.exr" && mv "$kept.$$.exr" "$kept"
else
    sleep 0.3
    cp "$kept" "$2"
fi
kill $child
wait $child 2> /dev/null  # what is still about to end would count as left running
exit 0
"""

Verdicts = dict[str, list[str | list[list[str]]]]  # case -> its verdict, and that of each of its checks


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a run ended; `code` is None of one that did not by itself."""

    code: int | None
    seconds: float
    said: str  # on standard output
    complaint: str  # on standard error

    @property
    def traceback(self) -> bool:
        """Say whether it showed its inside."""
        return "Traceback" in self.complaint


@dataclass(frozen=True, kw_only=True)
class Running:
    """A run under way."""

    process: subprocess.Popen[bytes]
    out: Path
    since: float  # s, of `time.monotonic`


@dataclass(kw_only=True)
class Tally:
    """What a soak found; all but `kills`, `planned` and `recorded` must be 0."""

    kills: list[tuple[str, str, str]] = field(default_factory=list)  # signal, target, moment
    planned: int = 0
    recorded: int = 0
    twice: int = 0
    wrong: int = 0
    hung: int = 0
    tracebacks: int = 0
    processes_left: int = 0
    folders_left: int = 0
    sentences: list[str] = field(default_factory=list)  # what went wrong, where

    @property
    def good(self) -> bool:
        """Say whether nothing was lost, and nothing left."""
        wrong = self.twice + self.wrong + self.hung + self.tracebacks + self.processes_left + self.folders_left
        return self.planned == self.recorded and not wrong


class Site:
    """A folder for a soak; `undisturbed` has what is true of its scenes. `workers` are those of a cluster, if any."""

    def __init__(self, folder: Path, *, cases: int, jobs: int, workers: int = 0) -> None:
        adopt_orphans()  # so that whatever a run leaves becomes a child of this process, and is seen
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            # A shell starts what runs in the background so, and the runs would inherit it and be deaf to it.
            signal.signal(signal.SIGINT, signal.default_int_handler)
        self.folder, self.cases, self.jobs, self.workers = folder, cases, jobs, workers
        for name in ("scenes", "tmp", "kept", "home"):
            (folder / name).mkdir(parents=True)
        self.scenes = [f"{index:05d}.json" for index in range(cases)]
        for name, scene in zip(self.scenes, small_scenes(cases), strict=True):
            save_scene(scene, folder / "scenes" / name)
        self.program = folder / "program"
        text = PROGRAM.format(kept=folder / "kept", python=sys.executable, command=COMMAND)
        self.program.write_text(text)
        self.program.chmod(0o755)
        self.cache = folder / "cache"
        self.environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, [str(HOLDER), os.environ.get("PYTHONPATH")])),
            "TMPDIR": str(folder / "tmp"),
            cache_store.VARIABLE: str(self.cache),
        }
        self._before = {process.pid for process in descendants(os.getpid())}
        self._undisturbed: dict[bool, tuple[Verdicts, float]] = {}

    @property
    def ample(self) -> float:
        """Return how many seconds a run has that nobody disturbs."""
        return AMPLE * max(1.0, self.cases / 100)

    def undisturbed(self, *, program: bool) -> tuple[Verdicts, float]:
        """Return the verdicts that nobody disturbed, and how long they took with nothing judged before [s].

        Raises:
            RuntimeError: the run did not end well, so that there is nothing to compare with.

        """
        if program not in self._undisturbed:
            out, seconds = self.folder / f"undisturbed-{program}", 0.0
            for at in ((), None):  # the second has what any later one has: the guards, the references' renders
                self.forget()
                ended = self.finished(self.start(out, program=program, timeout=AMPLE, at=at), self.ample)
                if ended.code not in (0, 1):
                    told = " ".join((ended.complaint or ended.said).split())[-300:]
                    raise RuntimeError(f"an undisturbed run ended with {ended.code}: {told}")
                seconds = ended.seconds
            self._undisturbed[program] = (self.verdicts(out), seconds)
        return self._undisturbed[program]

    def start(
        self,
        out: Path,
        *,
        program: bool = False,
        resume: bool = False,
        timeout: float = TIMEOUT,
        at: tuple[str, ...] | None = None,
        before: tuple[str, ...] = (),
        environment: Mapping[str, str] | None = None,
    ) -> Running:
        """Start a run into `out`, on the cluster that `at` names; `before` are words in front of its command."""
        command = [*before, sys.executable, "-c", COMMAND, "run", *self.scenes, "--out", str(out)]
        command += ["--jobs", str(self.jobs), "--timeout", f"{timeout:g}"]
        command += made_by_the_run(self.workers) if at is None else at
        command += ["--resume"] if resume else []
        command += ["--subject", f"exec:{self.program} {{scene}} {{output}}"] if program else []
        with self.said(out).open("wb") as said, self.complaint(out).open("wb") as complaint:
            since = time.monotonic()
            process = subprocess.Popen(
                command,
                cwd=self.folder / "scenes",
                env={**self.environment, **(environment or {})},
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=complaint,
                start_new_session=True,
            )
        return Running(process=process, out=out, since=since)

    def said(self, out: Path) -> Path:
        """Return where a run's standard output goes."""
        return out.with_suffix(".said")

    def complaint(self, out: Path) -> Path:
        """Return where a run's standard error goes."""
        return out.with_suffix(".complaint")

    def finished(self, run: Running, limit: float) -> Ended:
        """Wait for a run until it is `limit` seconds old; end one that hangs."""
        try:
            code = run.process.wait(timeout=max(0.0, run.since + limit - time.monotonic()))
        except subprocess.TimeoutExpired:
            code = None
            run.process.kill()
            run.process.wait()
        said, complaint = (file(run.out).read_text(errors="replace") for file in (self.said, self.complaint))
        return Ended(code=code, seconds=time.monotonic() - run.since, said=said, complaint=complaint)

    def left(self) -> list[str]:
        """Return the processes that are still there some seconds after a run's end, and end them."""
        deadline = time.monotonic() + PARTING
        while (remain := self._remaining()) and time.monotonic() < deadline:
            time.sleep(0.1)
        told = []
        for process in remain:
            try:
                told.append(f"{process.name()} {process.pid}")
                process.send_signal(signal.SIGKILL)
            except psutil.NoSuchProcess:
                continue
        psutil.wait_procs(remain, timeout=PARTING)
        return told

    def _remaining(self) -> list[psutil.Process]:
        return [process for process in descendants(os.getpid()) if process.pid not in self._before]

    def folders(self, out: Path) -> list[str]:
        """Return what runs left of temporary folders and drafts, and remove it."""
        found = list((self.folder / "tmp").iterdir())
        found += [path for path in out.rglob(".*") if path.is_file()]
        for path in found:
            shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)
        return [str(path.relative_to(self.folder)) for path in found]

    def forget(self, cache: Path | None = None) -> None:
        """Take from the cache what was judged, so that a run has work to do."""
        for item in cache_store.Store(cache or self.cache).items():
            if item.about.get("kind") in JUDGED:
                item.path.unlink(missing_ok=True)

    def verdicts(self, out: Path, name: str = "results.json") -> Verdicts:
        """Return what a run's results say of each case."""
        return {case["name"]: _verdict(case) for case in self.document(out, name)["cases"]}

    def document(self, out: Path, name: str = "results.json") -> RunRecord:
        """Return a run's results."""
        results: RunRecord = json.loads((out / name).read_text(encoding="utf-8"))
        expand(results)
        return results


def _verdict(case: CaseRecord) -> list[str | list[list[str]]]:
    checks = sorted([check.configuration, check.reference, check.stage, str(check.outcome)] for check in case["checks"])
    return [case["verdict"], checks]


def patience(undisturbed: float) -> float:
    """Return the deadline [s] of a disturbed run's tasks: none of them takes as long as all did undisturbed."""
    return max(TIMEOUT, undisturbed)


def deadlines(hits: list[Signal], timeout: float) -> float:
    """Return how many seconds of deadlines signals that stop a process may cost a run."""
    first = {"draw": max(DRAWING, timeout), ENGINE_WORKER: LIFETIME}
    return sum(first.get(one.target, timeout) + timeout for one in hits if one.waits)
