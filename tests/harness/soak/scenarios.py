"""Runs on a machine that is narrow, and from a cache that was tampered with: each ends in a line, or is as undisturbed.

Full and read-only folders are small file systems of their own, mounted where only the run sees them; where this user
may not do that, it is said.
"""

import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rayproof.reports.run import cache_store
from tests.harness.soak.site import AMPLE, Ended, Site

GIBIBYTE = 2**30
FEW_FILES = 64  # descriptors
FULL = 4096  # bytes of a file, or of a file system
BACK = "-3600 seconds"
CANNOT_MOUNT = 99
RESULTS = "results folder"
NAMED = {  # the variables that name a folder
    RESULTS: (),
    "cache": ("RAYPROOF_CACHE",),
    "HOME": ("HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME"),
    "TMPDIR": ("TMPDIR",),
}
# In a mount name space of its own: the size, where, "ro" or "rw", "again" if it is to be resumed with room; the run.
NARROW = """
mount -t tmpfs -o size=$1,mode=0700 none "$2" || exit 99
[ "$3" = ro ] && { mount -o remount,ro "$2" || exit 99; }
again=$4; where=$2; shift 4
"$@"; code=$?
if [ "$again" = again ]; then
    mount -o remount,size=64m "$where" || exit 99
    "$@" --resume; again=$?
    cp "$where/results.json" "$where.json"
    exit $((again <= 1 && code == 3 ? 0 : 98))
fi
exit $code
"""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a scenario; `good` is None where this machine cannot have it."""

    name: str
    good: bool
    said: str
    measured: bool = True

    @property
    def word(self) -> str:
        """Return it in a word."""
        return ("held" if self.good else "DID NOT HOLD") if self.measured else "not measured"


Scenario = Callable[[Site], Outcome]


def _whole(site: Site, out: Path) -> str:
    """Say whether a run found what an undisturbed one did: an empty text, or what is amiss."""
    try:
        found = site.verdicts(out)
    except (OSError, ValueError) as error:
        return f"no results: {error}"
    return "" if found == site.undisturbed(program=False)[0] else "other verdicts"


def _line(ended: Ended) -> str:
    return (ended.complaint.strip().splitlines() or [""])[-1][:160]


def _plainly(ended: Ended) -> str:
    """Say what is amiss with a run that ended: an empty text if it ended by itself, and in a line if not well."""
    if ended.code is None:
        return "it hung"
    if ended.traceback or ended.complaint.count("\n") > 1:
        return f"more than a line: {_line(ended)}"
    return ""


def _left(site: Site, out: Path) -> str:
    left = [*site.left(), *site.folders(out)]
    return f"left: {', '.join(left)}" if left else ""


def _outcome(name: str, said: str, *troubles: str) -> Outcome:
    amiss = [trouble for trouble in troubles if trouble]
    return Outcome(name=name, good=not amiss, said="; ".join(amiss) or said)


def _then_resumed(site: Site, name: str, ended: Ended, out: Path) -> Outcome:
    """Return the outcome of a run that was narrow and is resumed with room."""
    again = site.finished(site.start(out, resume=True, timeout=AMPLE), AMPLE)
    said = f"exit {ended.code} {_line(ended)}".strip() + f"; resumed: exit {again.code}"
    return _outcome(name, said, _plainly(ended), _plainly(again), _whole(site, out), _left(site, out))


def _flip(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


HARMS: dict[str, Callable[[bytes], bytes]] = {
    "truncated": lambda data: data[: len(data) // 2],
    "flipped": _flip,
    "of another version": lambda data: data.replace(cache_store.MAGIC, b"rayproof entry 1\n", 1),
    "emptied": lambda data: b"",
}


def _cache_of(site: Site, name: str, *, judged: bool) -> Path:
    """Return a copy of the cache as a run leaves it, or without what was judged."""
    site.undisturbed(program=False)
    folder = site.folder / f"cache-{name.replace(' ', '-')}"
    shutil.copytree(site.cache, folder)
    if not judged:
        site.forget(folder)
    return folder


def _tampered(harm: str) -> Scenario:
    def scenario(site: Site) -> Outcome:
        name = f"every entry of the cache {harm}"
        cache = _cache_of(site, harm, judged=True)
        paths = sorted(cache.glob("??/*.entry"))
        if harm == "swapped":
            contents = [path.read_bytes() for path in paths]
            for path, content in zip(paths, contents[1:] + contents[:1], strict=True):
                path.write_bytes(content)
        else:
            for path in paths:
                path.write_bytes(HARMS[harm](path.read_bytes()))
        return _from(site, name, cache, f"{len(paths)} entries, none believed")

    return scenario


def _from(site: Site, name: str, cache: Path, said: str) -> Outcome:
    out = site.folder / f"{cache.name}-out"
    run = site.start(out, timeout=AMPLE, environment={"RAYPROOF_CACHE": str(cache)})
    ended = site.finished(run, AMPLE)
    code = "" if ended.code in (0, 1) else f"exit {ended.code} {_line(ended)}"
    return _outcome(name, said, code, _plainly(ended), _whole(site, out), _left(site, out))


def three_at_once(site: Site) -> Outcome:
    """Have three runs share one cache that knows nothing of their verdicts."""
    cache = _cache_of(site, "shared", judged=False)
    before = set(cache.glob("??/*.draft"))  # of processes that were killed earlier, which are swept after an hour
    outs = [site.folder / f"shared-{number}" for number in range(3)]
    runs = [site.start(out, timeout=AMPLE, environment={"RAYPROOF_CACHE": str(cache)}) for out in outs]
    ends = [site.finished(run, AMPLE) for run in runs]
    troubles = [_plainly(ended) for ended in ends] + [_whole(site, out) for out in outs]
    drafts = [path.name for path in set(cache.glob("??/*.draft")) - before]
    return _outcome("three runs in one cache", "all as undisturbed", *troubles, *drafts, _left(site, outs[0]))


def two_in_one_folder(site: Site) -> Outcome:
    """Start a second run into a folder that a first one writes."""
    site.undisturbed(program=False)
    site.forget()
    out = site.folder / "twice"
    first = site.start(out, timeout=AMPLE)
    while first.process.poll() is None and not (out / ".owner").exists():
        time.sleep(0.01)
    said = site.complaint(out)
    said.rename(site.folder / "first.complaint")  # the first one's stays open under another name
    second = site.finished(site.start(out, timeout=AMPLE), AMPLE)
    whole = site.finished(first, AMPLE)
    named = f"process {first.process.pid}" in second.complaint
    refused = "" if second.code == 2 and named else f"second: exit {second.code}"
    ended = "" if whole.code in (0, 1) else f"first: exit {whole.code}"
    troubles = (refused, _plainly(second), ended, _whole(site, out), _left(site, out))
    return _outcome("two runs in one folder", _line(second), *troubles)


def _limited(name: str, limit: str, words: str) -> Scenario:
    """Return a scenario under a limit that a shell can set, then resumed without."""

    def scenario(site: Site) -> Outcome:
        site.undisturbed(program=False)
        site.forget()
        out = site.folder / limit.replace(" ", "")
        before = ("sh", "-c", f'{words} && exec "$@"', "sh")
        return _then_resumed(site, name, site.finished(site.start(out, before=before), AMPLE), out)

    return scenario


def _narrow(what: str, *, full: bool) -> Scenario:
    """Return a scenario in which a folder that a run writes has no room, or may only be read."""

    def scenario(site: Site) -> Outcome:
        name = f"{what} {'full' if full else 'read-only'}"
        site.undisturbed(program=False)
        site.forget()
        out, where = (site.folder / f"{name.replace(' ', '-')}-{part}" for part in ("out", "place"))
        where = out if what == RESULTS else where
        where.mkdir()
        environment = {variable: str(where) for variable in NAMED[what]}
        again = full and what == RESULTS
        before = (
            "unshare", "--mount", *(() if os.geteuid() == 0 else ("--user", "--map-root-user")),
            "sh", "-c", NARROW, "sh", "16k" if full else "64m", str(where), "rw" if full else "ro",
            "again" if again else "once",
        )  # fmt: skip
        run = site.start(out, before=before, environment=environment, timeout=AMPLE)
        ended = site.finished(run, AMPLE)
        if ended.code in (CANNOT_MOUNT, 127) or "unshare:" in ended.complaint:
            return Outcome(name=name, good=True, said="this user may mount nothing", measured=False)
        if again:
            found = site.verdicts(site.folder, f"{out.name}.json") if ended.code == 0 else None
            amiss = "" if found == site.undisturbed(program=False)[0] else f"exit {ended.code}, or other verdicts"
        elif ended.code in (0, 1):
            amiss = _whole(site, out)
        else:
            amiss = "" if ended.code in (2, 3) else f"exit {ended.code}"
        return _outcome(name, f"exit {ended.code} {_line(ended)}".strip(), amiss, _plainly(ended), _left(site, out))

    return scenario


def clock_set_back(site: Site) -> Outcome:
    """Resume a run by a clock that is an hour behind, which only the run sees."""
    name = "clock set back an hour"
    tool = shutil.which("faketime")
    if tool is None:
        return Outcome(name=name, good=True, said="faketime is not installed", measured=False)
    site.undisturbed(program=False)
    site.forget()
    out = site.folder / "clock"
    ended = site.finished(site.start(out, timeout=AMPLE), AMPLE)
    site.forget()
    again = site.finished(site.start(out, resume=True, before=(tool, "-f", BACK), timeout=AMPLE), AMPLE)
    return _outcome(name, f"exit {again.code}", _plainly(ended), _plainly(again), _whole(site, out), _left(site, out))


SCENARIOS: tuple[Scenario, ...] = (
    *(_tampered(harm) for harm in (*HARMS, "swapped")),
    three_at_once,
    two_in_one_folder,
    _limited(f"{FEW_FILES} descriptors", "descriptors", f"ulimit -n {FEW_FILES}"),
    _limited("1 GiB of address space", "memory", f"ulimit -v {GIBIBYTE // 1024}"),
    _limited("no file above 4 KB", "file size", f"trap '' XFSZ; ulimit -f {FULL // 512}"),
    *(_narrow(what, full=full) for what in NAMED for full in (True, False)),
    clock_set_back,
)
