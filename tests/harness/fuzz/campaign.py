"""Run a campaign: break a seed, hand it to its reader, and keep what the reader must not do."""

import os
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rayproof import ROOT
from rayproof.reports.processes.scratch import PREFIX
from tests.harness.fuzz.mutations import mutated
from tests.harness.fuzz.targets import TARGETS, Target

LARGEST = 2**24  # bytes of a file: what takes long with a larger one is its size
SECONDS = 10.0  # of processor time that a reader may take for one input


@dataclass(kw_only=True)
class Figures:
    """What became of one target's inputs."""

    inputs: int = 0
    refused: int = 0
    taken: int = 0
    slowest: float = 0.0  # s of processor time
    findings: list[dict[str, str]] = field(default_factory=list)


@dataclass(kw_only=True)
class _Watch:
    """Which files were opened beside the ones that a reader may open."""

    folder: str = ""
    allowed: tuple[str, ...] = ()
    strays: list[str] = field(default_factory=list)


_watch = _Watch()


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or not _watch.folder or not isinstance(arguments[0], str | bytes):
        return
    path = os.path.abspath(os.fsdecode(arguments[0]))  # noqa: PTH100  in an audit hook nothing may be imported
    # An unnamed file is made by opening the folder for temporary ones.
    if path != tempfile.gettempdir() and not path.startswith((_watch.folder, *_watch.allowed)):
        _watch.strays.append(path)


def fuzz(name: str, *, inputs: int, seconds: float, seed: int, out: Path | None = None) -> Figures:
    """Hand up to `inputs` broken files to a target's reader, for at most `seconds`; each finding is kept in `out`.

    The same `seed` gives the same inputs, whatever other targets there are.
    """
    target, chance, figures = TARGETS[name](), random.Random(f"{seed} {name}"), Figures()
    with _limited(target.memory), tempfile.TemporaryDirectory(prefix="rayproof-fuzz-") as place:
        read_once(target, Path(place), target.seeds[0], Figures())  # what it imports is opened now
        deadline = time.monotonic() + seconds
        while figures.inputs < inputs and time.monotonic() < deadline:
            try:
                content = mutated(chance.choice(target.seeds), chance)
            except MemoryError:  # of this campaign: a change may repeat what another one repeated
                continue
            if len(content) > LARGEST:
                continue
            wrong = read_once(target, Path(place), content, figures)
            figures.inputs += 1
            if wrong is not None:
                kept = ""
                if out is not None:
                    file = out / f"{name.replace(' ', '-')}-{len(figures.findings)}{Path(target.name).suffix}"
                    out.mkdir(parents=True, exist_ok=True)
                    file.write_bytes(content)
                    kept = str(file)
                figures.findings.append({"what": wrong, "file": kept, "begins": repr(content[:200])})
    return figures


def read_once(target: Target, place: Path, content: bytes, figures: Figures) -> str | None:
    """Return what a reader did that it must not do, in a line, or None."""
    folder = place / "folder"
    folder.mkdir()
    path = folder / target.name
    path.write_bytes(content)
    begun, wrong = time.process_time(), None
    _watch.folder, _watch.strays = str(place), []
    try:
        target.read(path)
        figures.taken += 1
    except target.refusals as refusal:
        figures.refused += 1
        if "\n" in str(refusal):
            wrong = f"a refusal of more than one line: {refusal}"
    except Exception as error:
        where = error.__traceback__
        while where is not None and where.tb_next is not None:
            where = where.tb_next
        at = f"{Path(where.tb_frame.f_code.co_filename).name}:{where.tb_lineno}" if where is not None else "?"
        wrong = f"{type(error).__name__} at {at}: {' '.join(str(error).split())[:200]}"
    finally:
        _watch.folder = ""
    taken = time.process_time() - begun
    figures.slowest = max(figures.slowest, taken)
    if wrong is None and taken > SECONDS:
        wrong = f"it took {taken:.1f} s"
    if wrong is None and _watch.strays:
        wrong = f"it opened {_watch.strays[0]}"
    if wrong is None and [entry.name for entry in place.iterdir()] != ["folder"]:
        wrong = "it wrote outside of its folder"
    shutil.rmtree(folder)
    return wrong


@contextmanager
def _limited(memory: int) -> Iterator[None]:
    """Limit the memory of this process and watch what it opens, for the block."""
    if not _watch.allowed:
        sys.addaudithook(_audit)
        own = [f"{ROOT}/{name}/" for name in ("cases", "python", "reference", "reports", "tests", "tracer")]
        scratch = str(Path(tempfile.gettempdir(), PREFIX))  # of workers, such as that of Mitsuba's parser
        _watch.allowed = (sys.prefix, sys.base_prefix, *own, scratch, "/proc/", "/dev/null", "/sys/", "/usr/", "/lib")
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        before = resource.getrlimit(resource.RLIMIT_AS)
        limit = pages * os.sysconf("SC_PAGE_SIZE") + memory
        resource.setrlimit(resource.RLIMIT_AS, (limit, before[1]))
    except (ImportError, OSError, ValueError):  # not on every platform
        yield
        return
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
