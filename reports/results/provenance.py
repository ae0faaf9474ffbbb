"""`Origin`: version, commit, machine, seed and command of a result; its inputs are kept, to compute it again.

A command that fills a folder stores its inputs in FOLDER/origin/COMMAND, so that the result can be computed again from
the folder. Values of environment variables are never stored, since they may be secrets; `--env` names the variables.
"""

import hashlib
import json
import math
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path, PurePath
from typing import Any, TypedDict

from rayproof import ROOT
from rayproof.reports.program_name import arguments
from rayproof.reports.results.files import as_json, write_text

SECONDS = 10.0  # time limit of a git command
FOLDER, NAME = "origin", "origin.json"
LARGEST = 2**26  # bytes of a stored input; of larger inputs only the digest is stored


class Origin(TypedDict):
    """The origin of a result: the command, code, machine and inputs that made it."""

    rayproof: str  # version
    commit: str  # of rayproof's own checkout; "" if there is none
    clean: bool  # whether the checkout had no uncommitted changes
    processor: str
    seed: str
    command: list[str]  # words


def origin(seed: object = "") -> Origin:
    """Return the origin of results of this process."""
    commit = git("rev-parse", "HEAD", at=ROOT) if git("rev-parse", "--show-toplevel", at=ROOT) == str(ROOT) else ""
    return {
        "rayproof": version("rayproof"),
        "commit": commit,
        "clean": bool(commit) and not git("status", "--porcelain", "--untracked-files=no", at=ROOT),
        "processor": machine(),
        "seed": str(seed),
        "command": ["rayproof", *without_values(arguments())],
    }


def caption(made: Origin) -> str:
    """Return version, commit, seed and processor in one line for a figure or a table."""
    commit = (
        f"commit {made['commit'][:12]}{'' if made['clean'] else ' with changes'}" if made["commit"] else "no commit"
    )
    seed = f"seed {made['seed']}, " if made["seed"] else ""
    return f"rayproof {made['rayproof']}, {commit}, {seed}{made['processor']}"


def without_values(words: Sequence[str]) -> list[str]:
    """Return a command's words without the values of environment variables in `--env NAME=VALUE`."""
    kept = []
    for before, word in zip(["", *words], words, strict=False):
        head, equals, rest = word.partition("=")
        if before == "--env":
            word = head
        elif head == "--env" and equals:
            word = f"--env={rest.partition('=')[0]}"
        kept.append(word)
    return kept


def machine() -> str:
    """Return architecture, processor and number of processors; times of the same machine can be compared."""
    return f"{platform.machine()} {_processor()} x{os.cpu_count()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def git(*words: str, at: Path = Path()) -> str:
    """Return the output of a git command in the checkout that contains `at`; "" if the command fails."""
    try:
        done = subprocess.run(
            ["git", "-C", str(at), *words],
            capture_output=True, text=True, timeout=SECONDS, check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


# The inputs of a result, stored with it.


class KeptOrigin(Origin):
    """The content of origin.json."""

    paths: dict[str, str]  # path in the command -> path of the copy, relative to the folder of origin.json
    files: dict[str, str]  # path of a stored file, relative to this folder -> SHA-256
    left_out: dict[str, str]  # files that are too large to be stored -> SHA-256
    result: str  # SHA-256 of the reproducible content; "" for a run
    program: bool  # whether a program was under test, which is not stored


def keep(folder: Path, kind: str, seed: object = "") -> None:
    """Write FOLDER/origin/KIND: origin.json, and the formulas and scenes that this process's command names."""
    place = folder / FOLDER / kind
    shutil.rmtree(place, ignore_errors=True)
    paths: dict[str, str] = {}
    digests: dict[bool, dict[str, str]] = {True: {}, False: {}}  # by whether the file is kept
    for number, (written, path, files) in enumerate(_named(arguments())):
        paths[written] = str(number) if path.is_dir() else f"{number}/{path.name}"
        for name, source in files.items():
            kept = source.stat().st_size <= LARGEST
            if kept:
                (place / str(number) / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, place / str(number) / name)
            digests[kept][f"{number}/{name}"] = _digest(source)
    record: KeptOrigin = {
        **origin(seed),
        "paths": paths,
        "files": digests[True],
        "left_out": digests[False],
        # Reading a run's records takes a second, so its digest is computed only on demand.
        "result": "" if kind == "run" else digest_of(essence(folder, kind)),
        "program": any(name in word for word in arguments() for name in ("exec:", "serve:", "python:")),
    }
    write_text(place / NAME, as_json(record, indent=1) + "\n")


def keep_whole(part: Path, out: Path) -> None:
    """Copy the origin of a shard into the folder of the whole run, whose command is the same without --shard."""
    place = out / FOLDER / "run"
    shutil.rmtree(place, ignore_errors=True)
    if "run" not in kinds(part):
        return
    shutil.copytree(part / FOLDER / "run", place)
    record = load(out, "run")
    words = zip(["", *record["command"]], record["command"], strict=False)
    command = [word for before, word in words if before != "--shard" and word.partition("=")[0] != "--shard"]
    write_text(place / NAME, as_json({**record, "command": command}, indent=1) + "\n")


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _named(words: Sequence[str]) -> Iterator[tuple[str, Path, dict[str, Path]]]:
    """Yield each input path of a command: its text in the command, the path, and its files by relative name."""
    from rayproof.tracer.configuration import parts_of
    from rayproof.tracer.formulas import FORMULAS
    from rayproof.tracer.formulas.own_file import is_own, parsed, sources

    named: set[str] = set()
    for before, word in zip(["", *words], words, strict=False):
        value = word.partition("=")[2] if word.startswith("--") else word
        if not {before, word.partition("=")[0]}.isdisjoint(("--subject", "--tls")):
            continue  # neither the renderer under test nor a key is stored
        for part in filter(is_own, parts_of(value)):
            written = parsed(part.partition("=")[2])[0]
            if written not in named:
                named.add(written)
                folder = Path(written).parent
                try:
                    _, files = sources(FORMULAS.named(part))
                except (ValueError, LookupError):  # changed or removed during the run, which reported an error
                    files = {}
                yield written, Path(written), {name: folder / name for name in files if (folder / name).is_file()}
        path = Path(value)
        if value in named or not value.endswith(("/", ".json", ".jsonl")) or not path.exists():
            continue
        if before in OUTPUTS or word.partition("=")[0] in OUTPUTS:
            continue
        named.add(value)
        scenes = sorted(path.rglob("*.json")) if path.is_dir() else [path]
        top = path if path.is_dir() else path.parent
        files = [file for scene in scenes for file in (scene, *_meshes(scene)) if file.is_relative_to(top)]
        yield value, path, {file.relative_to(top).as_posix(): file for file in files}


def _meshes(scene: Path) -> list[Path]:
    """Return the files that a scene file names."""
    try:
        document = json.loads(scene.read_text(encoding="utf-8"))
        shapes = document.get("shapes", []) if isinstance(document, dict) else []
    except (OSError, ValueError):
        return []
    names = [shape.get("file") for shape in shapes if isinstance(shape, dict)]
    return [scene.parent / name for name in names if isinstance(name, str) and (scene.parent / name).is_file()]


# Options of the command that are removed to compute a result again: other outputs, and options of gates.
OUTPUTS = (
    "--out", "--json", "--figure", "--table", "--width", "--font-size", "--history", "--expect", "--against",
    "--least-coverage", "--keep",
)  # fmt: skip
SWITCHES = ("--resume", "--no-resume")


def again(folder: Path, kind: str, out: Path) -> tuple[list[str], dict[str, str]]:
    """Return the arguments of the command that recomputes a stored result into `out`, and original -> stored paths.

    Raises:
        OSError, ValueError: origin.json cannot be read, or an input has changed.

    """
    record, place = load(folder, kind), folder / FOLDER / kind
    if record["left_out"]:
        raise ValueError(f"too large to be kept: {', '.join(record['left_out'])}")
    for name, digest in record["files"].items():
        if _digest(place / name) != digest:
            raise ValueError(f"{place / name} is not what it was when the result was made")
    # A folder of scenes ends in /, which `Path` removes.
    paths = {old: f"{place / new}{'/' * old.endswith('/')}" for old, new in record["paths"].items()}
    words: list[str] = []
    skip = False
    for word in record["command"][1:]:
        if skip:
            skip = False
        elif word.partition("=")[0] in OUTPUTS:
            skip = "=" not in word
        elif word not in SWITCHES:
            words.append(_moved(word, paths))
    return [*words, "--out", str(out)], paths


def _moved(word: str, paths: Mapping[str, str]) -> str:
    """Return a word of a command with its path replaced: PATH, OPTION=PATH or SLOT=PATH:FUNCTION."""
    for old, new in paths.items():
        if word == old or word.endswith(f"={old}"):
            return word.removesuffix(old) + new
        if f"={old}:" in word:
            return word.replace(f"={old}:", f"={new}:")
    return word


def load(folder: Path, kind: str) -> KeptOrigin:
    """Return the stored origin of one command's result.

    Raises:
        OSError, ValueError: origin.json cannot be read.

    """
    file = folder / FOLDER / kind / NAME
    try:
        record = json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{file}: not JSON: {error}") from error
    wanted = KeptOrigin.__required_keys__
    if not isinstance(record, dict) or not wanted <= set(record):
        raise ValueError(f"{file}: lacks {', '.join(sorted(wanted - set(record)))}")
    return record  # type: ignore[return-value]


def kinds(folder: Path) -> list[str]:
    """Return the commands whose results and origins are in a folder."""
    return sorted(file.parent.name for file in (folder / FOLDER).glob(f"*/{NAME}"))


def command(record: Origin) -> str:
    """Return the command, quoted for a shell."""
    return shlex.join(record["command"])


# The reproducible content of a result: name -> text, number, and lower and upper bound of the number.
Reproducible = dict[str, tuple[str, float | None, float | None, float | None]]


def essence(folder: Path, kind: str) -> Reproducible:
    """Return the reproducible content of a command's result, which includes no times.

    Raises:
        OSError, ValueError, LookupError: the result cannot be read.

    """
    read = {"run": _run, "compare": _compare, "stability": _stability, "tradeoff": _tradeoff}
    if kind not in read:
        raise LookupError(f"{folder / FOLDER / kind}: no result is of this kind; known: {', '.join(read)}")
    return read[kind](folder)


def renamed(content: Reproducible, paths: Mapping[str, str]) -> Reproducible:
    """Return the content with the stored copies' paths in its names replaced by the original paths."""

    def name(text: str) -> str:
        for old, new in paths.items():
            text = text.replace(str(PurePath(new)), str(PurePath(old)))
        return text

    return {name(key): value for key, value in content.items()}


def digest_of(content: Reproducible) -> str:
    """Return the SHA-256 of the reproducible content."""
    return hashlib.sha256(as_json(dict(sorted(content.items()))).encode(errors="replace")).hexdigest()


def differences(before: Reproducible, after: Reproducible) -> tuple[bool, list[str]]:
    """Return whether two results are equal to the last bit, and a sentence for each difference beyond its bounds."""
    sentences = []
    for name in sorted({*before, *after}):
        old, new = before.get(name), after.get(name)
        if old is None or new is None:
            sentences.append(f"{name}: {'not there before' if old is None else 'not there now'}")
        elif old[0] != new[0]:
            sentences.append(f"{name}: {old[0] or 'nothing'} -> {new[0] or 'nothing'}")
        elif not _within(old, new[1]):
            sentences.append(f"{name}: {old[1]} -> {new[1]}")
    return digest_of(before) == digest_of(after), sentences


def _within(entry: tuple[str, float | None, float | None, float | None], value: float | None) -> bool:
    _, old, low, high = entry
    if old is None or value is None or not (math.isfinite(old) and math.isfinite(value)):
        return old == value or (old is not None and value is not None and math.isnan(old) and math.isnan(value))
    return (old if low is None else low) <= value <= (old if high is None else high)


def _run(folder: Path) -> Reproducible:
    from rayproof.reports.results.case_records import ratio_of
    from rayproof.reports.results.document import load_results

    verdicts: Reproducible = {}
    for case in load_results(folder)["cases"]:
        verdicts[case["name"]] = (case["verdict"], None, None, None)
        for check in case.get("checks", []):
            ratio = ratio_of(check)
            # An error may change as long as it stays on the same side of its limit.
            low, high = (0.0, 1.0) if ratio is not None and ratio <= 1 else (1.0, math.inf)
            name = f"{case['name']} {check.name}"
            verdicts[name] = (check.outcome, ratio, low, high)
    return verdicts


def _compare(folder: Path) -> Reproducible:
    document = _json(folder / "comparison.json")
    gains: Reproducible = {}
    for at, comparison in enumerate(document.get("comparisons", [document])):
        for family in comparison["families"]:
            name = f"{document['sweep']['values'][at]} {family['family']}" if "sweep" in document else family["family"]
            low, high = family.get("digits_interval") or (None, None)
            gains[name] = (as_json(family.get("changed")), family["digits_gained"], low, high)
            if isinstance(wrong := family.get("wrong"), dict):
                gains[f"{name} wrong pixels"] = (f"{wrong['base']} -> {wrong['candidate']}", None, None, None)
    return gains


def _stability(folder: Path) -> Reproducible:
    content: Reproducible = {}
    for ladder in _json(folder / "stability" / "ladders.json"):
        for climb in _json(folder / "stability" / f"{ladder}.json")["climbs"]:
            low, high = climb["slope_interval"] or (None, None)
            word = f"{climb['verdict']}, right up to {climb['breakpoint']}"
            content[f"{ladder} {climb['formula']} {climb['precision']}"] = (word, climb["slope"], low, high)
    return content


def _tradeoff(folder: Path) -> Reproducible:
    def bounds(point: Mapping[str, Any]) -> tuple[float, float, float]:
        return float(point["error"]), float(point["error_low"]), float(point["error_high"])

    return {
        f"{diagram['name']} {point['label']}": (f"{point['wrong']:.6g} wrong", *bounds(point))
        for diagram in _json(folder / "tradeoff" / "tradeoff.json")["diagrams"]
        for point in diagram["points"]
    }


def _json(file: Path) -> Any:
    return json.loads(file.read_text(encoding="utf-8"))


def run_again(words: Sequence[str]) -> int:
    """Run a rayproof command in a new process and return its exit code."""
    start = "import sys; from rayproof.reports.cli import main; sys.exit(main())"
    return subprocess.run([sys.executable, "-c", start, *words], check=False, stdin=subprocess.DEVNULL).returncode
