"""One round of a soak: a run is disturbed until it ends, then resumed, disturbed again or not, until it is whole."""

import itertools
import random
import shutil
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import cast

import psutil

from tests.harness.soak.disturbing import (
    ENGINE_WORKER,
    LAST,
    MEMORY,
    NANNY,
    STOP,
    TARGETS,
    Signal,
    chosen,
    hit,
    processes,
)
from tests.harness.soak.engine import Engine, engine
from tests.harness.soak.site import AMPLE, SLACK, Ended, Site, Tally, Verdicts, deadlines, patience

MOMENTS = ("random", "random", "in the middle of a reply", "before the first line", "while a file is replaced")
OF_LONG_RUNS = MOMENTS[:3]  # at which a run goes on after it
SHORT = 4  # cases of a run that is disturbed at every moment
MOST = 3  # signals a case of a run, after which it is left to end
PAUSE = (0.05, 1.2)  # s between two of them, or longer in a long run
ANSWERING = ("tracer", "judge", "reference")
EARLY = 1.5  # s after a start within which no run says anything
TURN = 0.002  # s between looks


class Round:
    """Disturb one run, and take down what came of it."""

    def __init__(self, site: Site, rng: random.Random, tally: Tally, *, program: bool, number: int, most: int) -> None:
        self._site, self._rng, self._tally, self._program = site, rng, tally, program
        self._number, self._most = number, max(1, min(most, MOST * site.cases))
        self._pause, self._engine = PAUSE, cast("Engine | None", None)
        self._out = site.folder / f"round-{number}"

    def play(self, tell: Callable[[str], None]) -> None:
        """Run, disturb, resume; verify."""
        verdicts, seconds = self._site.undisturbed(program=self._program)
        self._site.forget()
        timeout = patience(seconds)
        self._pause = (PAUSE[0], max(PAUSE[1], 2 * seconds / self._most))
        moment = self._rng.choice(MOMENTS if self._site.cases <= SHORT else OF_LONG_RUNS)
        for number, resume in ((0, False), (1, True)):
            if number and self._rng.random() < 0.5:
                break
            with self._cluster(number) as self._engine:
                at = None if self._engine is None else self._engine.words
                run = self._site.start(self._out, program=self._program, resume=resume, timeout=timeout, at=at)
                hits = self._disturb(run.process, moment if number == 0 else "random", run.since + SLACK * seconds)
                self._tally.kills += [(one.name, one.target, one.moment) for one in hits]
                ended = self._site.finished(run, SLACK * seconds * (1 + len(hits)) + deadlines(hits, timeout))
            counts = Counter(f"{one.name} to {one.target}" for one in hits)
            told = ", ".join(f"{what}, {count} times" if count > 1 else what for what, count in counts.items())
            told = told or "nothing"
            tell(f"{self._out.name}, {moment}: {told}; ended with {ended.code} after {ended.seconds:.1f} s")
            self._note(ended, told)
        # On this machine alone, wherever the rest was found.
        ended = self._site.finished(
            self._site.start(self._out, program=self._program, resume=True, timeout=AMPLE, at=()), self._site.ample
        )
        self._note(ended, "nothing, resumed")
        self._verify(verdicts)
        if self._tally.good:
            shutil.rmtree(self._out, ignore_errors=True)

    def _cluster(self, number: int) -> AbstractContextManager[Engine | None]:
        """Return the cluster of the round's run of that number: processes of the soak's in turn with the run's own."""
        if not self._site.workers or (self._number + number) % 2:
            return nullcontext()
        folder = self._site.folder / f"engine-{self._number}-{number}"
        return engine(folder, self._site.environment, self._site.workers)

    def _note(self, ended: Ended, told: str) -> None:
        def wrong(what: str) -> None:
            self._tally.sentences.append(f"{self._out.name} ({told}): {what}")

        if ended.code is None:
            self._tally.hung += 1
            wrong(f"it hung for {ended.seconds:.0f} s")
        # What was starved of memory may say where; what was killed or stopped may not.
        if ended.traceback and not any(f"{MEMORY} to {one}" in told for one in ("main", ENGINE_WORKER)):
            self._tally.tracebacks += 1
            wrong(ended.complaint.strip().splitlines()[-1])
        for name in self._site.left():
            self._tally.processes_left += 1
            wrong(f"{name} ran on")

    def _verify(self, verdicts: Verdicts) -> None:
        def wrong(what: str) -> None:
            self._tally.sentences.append(f"{self._out.name}: {what}")

        self._tally.planned += len(verdicts)
        try:
            cases = self._site.document(self._out)["cases"]
            found = self._site.verdicts(self._out)
        except (OSError, ValueError) as error:
            wrong(f"no results: {error}")
            return
        self._tally.recorded += len(found)
        self._tally.twice += len(cases) - len(found)
        for name in verdicts.keys() & found.keys():
            if verdicts[name] != found[name]:
                self._tally.wrong += 1
                wrong(f"{name} is not as undisturbed: {found[name][0]}")
        left = self._site.folders(self._out)
        self._tally.folders_left += len(left)
        for name in left:
            wrong(f"{name} was left")

    def _disturb(self, process: subprocess.Popen[bytes], moment: str, until: float) -> list[Signal]:
        """Return what was sent to a run's processes."""
        if moment == "before the first line":
            return self._early(process)
        if moment == "while a file is replaced":
            return self._amid_a_file(process, until)
        hits: list[Signal] = []
        while process.poll() is None and len(hits) < self._most and time.monotonic() < until:
            time.sleep(self._rng.uniform(*self._pause))
            one = self._amid_a_reply(process) if moment != "random" else self._at_random(process)
            if one is not None:
                hits.append(one)
                if one.name == STOP and self._site.cases <= SHORT:
                    break  # whoever waits for a deadline is not disturbed in it
            if self._engine is not None:
                self._engine.mend()
        return hits

    def _processes(self, process: subprocess.Popen[bytes]) -> dict[str, list[psutil.Process]]:
        """Return the processes of a run; workers of the engine and nannies only where a batch is under way there.

        Else none of them would ever have started.
        """
        found = processes(process.pid, *(self._engine.pids if self._engine is not None else ()))
        at_work = {*(above.pid for kind in ANSWERING for one in found.get(kind, ()) for above in _above(one))}
        return {
            kind: here
            for kind, some in found.items()
            if (here := [one for one in some if kind not in (ENGINE_WORKER, NANNY) or one.pid in at_work])
        }

    def _at_random(self, process: subprocess.Popen[bytes]) -> Signal | None:
        groups = {**self._processes(process), "main": [psutil.Process(process.pid)]} if process.poll() is None else {}
        # Each kind as often as any other, those less that nothing follows.
        rarely = 0.3 * SHORT / max(SHORT, self._site.cases)
        kinds = [kind for kind in TARGETS if groups.get(kind) and (kind not in LAST or self._rng.random() < rarely)]
        if not kinds:
            return None
        target = self._rng.choice(kinds)
        return self._send(self._rng.choice(groups[target]), target, "random")

    def _send(self, process: psutil.Process, target: str, moment: str, name: str | None = None) -> Signal | None:
        name = name or chosen(self._rng, target, patient=self._program)
        return Signal(name=name, target=target, moment=moment) if hit(process, name, self._rng) else None

    def _early(self, process: subprocess.Popen[bytes]) -> list[Signal]:
        time.sleep(self._rng.uniform(0.05, EARLY))
        moment = "random" if self._site.said(self._out).stat().st_size else "before the first line"
        name = self._rng.choice(("SIGTERM", "SIGINT", "SIGKILL"))
        one = self._send(psutil.Process(process.pid), "main", moment, name) if process.poll() is None else None
        return [one] if one is not None else []

    def _amid_a_reply(self, process: subprocess.Popen[bytes]) -> Signal | None:
        """Stop the main process until a worker waits for it to take a reply, hit the worker, go on."""
        if process.poll() is not None:
            return None
        main = psutil.Process(process.pid)
        workers = {kind: some for kind, some in self._processes(process).items() if kind in ANSWERING}
        if not workers:
            return None
        target = self._rng.choice(sorted(workers))
        worker = self._rng.choice(workers[target])
        try:
            main.suspend()
            time.sleep(self._rng.uniform(0.2, 1.0))
            name = "SIGKILL" if self._program or self._rng.random() < 0.7 else STOP
            return self._send(worker, target, "in the middle of a reply", name)
        except psutil.NoSuchProcess:
            return None
        finally:
            process.send_signal(signal.SIGCONT)

    def _amid_a_file(self, process: subprocess.Popen[bytes], until: float) -> list[Signal]:
        """Kill the main process while a draft of a file that it replaces is there."""
        while process.poll() is None and time.monotonic() < until:
            if any(itertools.chain(_drafts(self._out), self._site.cache.glob("??/*.draft"))):
                one = self._send(psutil.Process(process.pid), "main", "while a file is replaced", "SIGKILL")
                return [one] if one is not None else []
            time.sleep(TURN)
        return []


def _above(process: psutil.Process) -> list[psutil.Process]:
    try:
        return process.parents()
    except psutil.NoSuchProcess:
        return []


def _drafts(out: Path) -> list[Path]:
    return [path for path in out.glob(".*") if path.name != ".owner"] + list(out.glob("*.tmp"))
