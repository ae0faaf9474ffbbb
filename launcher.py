"""Set up a virtual environment beside this checkout, then become the program that was asked for.

Standard library only: it runs before anything is installed. `./rayproof` calls it with a Python that is new enough.
"""

import ctypes
import fcntl
import hashlib
import importlib.util
import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

CHECKOUT = Path(__file__).resolve().parent
APT = "on Debian 12: apt-get install python3 python3-venv libatomic1"
STAMP = "rayproof-setup.json"
# A process of all tests takes up to 2.4 GB, so that not every processor of a large machine gets one.
# Files are begun in the order of tests/conftest.py, which has the longest first.
SIDE_BY_SIDE = ["-n", "logical", "--maxprocesses", "4", "--dist", "loadfile", "--no-loadscope-reorder"]
# What a contributor runs while working: all that needs neither Chromium, a child process, another renderer nor time.
QUICK = ["-m", "not browser and not process and not references and not slow"]
IN_PROGRESS = {"state": "in progress"}
EXTRAS = ("dask",)  # each has a lock of its own, requirements-NAME.txt


class SetupError(Exception):
    """What stands in the way of a set-up, in one line that says what to do about it."""


def missing_prerequisite() -> str | None:
    """Return one line that names the first prerequisite which this machine lacks, or None."""
    if platform.system() != "Linux" or platform.machine() not in {"x86_64", "aarch64"}:
        return f"runs on Linux on x86_64 (aarch64 is untried), not on {platform.system()} on {platform.machine()}"
    for module in ("venv", "ensurepip"):
        if importlib.util.find_spec(module) is None:
            return f"this Python has no {module}; {APT}"
    for library, package in (
        ("libatomic.so.1", "libatomic1"),
        ("libz.so.1", "zlib1g"),
        ("libstdc++.so.6", "libstdc++6"),
    ):
        try:
            ctypes.CDLL(library)
        except OSError:
            return f"{library} is missing; on Debian 12: apt-get install {package}"
    return None


def digest(*files: str) -> str:
    """Return the SHA-256 of files of the checkout."""
    return hashlib.sha256(b"\0".join((CHECKOUT / name).read_bytes() for name in files)).hexdigest()


def wanted(folder: Path) -> dict[str, str]:
    """Return what a finished set-up of today's checkout looks like, less what is installed in it."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return {"state": "finished", "python": version, "folder": str(folder), "project": digest("pyproject.toml")}


def read_stamp(folder: Path) -> dict[str, str]:
    """Return what the last set-up left in the environment `folder`; nothing where there was none."""
    try:
        stamp = json.loads((folder / STAMP).read_text())
    except (OSError, ValueError):
        return {}
    return stamp if isinstance(stamp, dict) and (folder / "bin" / "python").exists() else {}


def is_ready(folder: Path, requirements: str) -> bool:
    """Return whether `folder` holds a finished set-up of this checkout with `requirements` installed."""
    stamp = read_stamp(folder)
    return stamp.items() >= wanted(folder).items() and stamp.get(requirements) == digest(requirements)


@contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Hold the environment `folder` against other set-ups; the lock goes when its process does."""
    handle = os.open(folder, os.O_RDONLY)
    os.set_inheritable(handle, True)  # a pip that outlives a killed launcher still writes, so it holds the lock too
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("another set-up is under way; waiting for it")
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def set_up(folder: Path, requirements: str) -> None:
    """Fill the environment `folder` with `requirements`, every file checked against its hash.

    Raises:
        SetupError: a step failed.

    """
    stamp, python = read_stamp(folder), str(folder / "bin" / "python")
    # What an interrupted set-up left cannot be trusted: pip takes a package half copied for an installed one.
    keep = stamp.get("state") == "finished" and all(stamp.get(k) == wanted(folder)[k] for k in ("python", "folder"))
    if not (folder / STAMP).exists() and any(folder.iterdir()):
        raise SetupError(f"{folder} was not made by ./rayproof: remove it, or name another folder in RAYPROOF_VENV")
    (folder / STAMP).write_text(json.dumps(IN_PROGRESS))
    if not keep:
        empty(folder)
        step("1/4 making the virtual environment", [sys.executable, "-m", "venv", str(folder)])
    pip = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--progress-bar", "off"]
    # Python compiles a module when it is first imported, and few of all that is installed ever are.
    pip = [*pip, "--no-compile"]
    step(f"2/4 installing {requirements}", [*pip, "--require-hashes", "-r", str(CHECKOUT / requirements)])
    # The wheel that carries LLVM makes its library links at the first start of Python after its installation.
    step("3/4 linking the packaged LLVM", [python, "-c", "pass"])
    step("4/4 installing rayproof", [*pip, "--no-deps", "--no-build-isolation", "--editable", str(CHECKOUT)])
    # Every lock holds all that requirements.txt does, in the same versions (tests/test_architecture.py), so what an
    # earlier set-up installed is still there.
    held = {"requirements.txt", requirements}
    if keep:
        held |= {path.name for path in CHECKOUT.glob("requirements*.txt") if stamp.get(path.name) == digest(path.name)}
    finished = wanted(folder) | {name: digest(name) for name in sorted(held)}
    (folder / STAMP).write_text(json.dumps(finished, indent=1))


def empty(folder: Path) -> None:
    """Remove all but the stamp, which says until the end that the set-up is in progress."""
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        elif entry.name != STAMP:
            entry.unlink()


def step(title: str, command: Sequence[str]) -> None:
    """Say `title`, run `command` and show on a terminal what it is busy with.

    Raises:
        SetupError: it failed; the message is its last error.

    """
    say(title)
    errors: list[str] = []
    last = ""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", close_fds=False
    ) as running:
        for line in running.stdout or ():
            last = line.strip() or last
            if line.startswith("ERROR"):
                errors.append(line.strip())
            elif sys.stderr.isatty() and line.startswith(("Collecting", "Installing")):
                print(f"\r\033[K  {line.strip()[:70]}", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr, flush=True)
    if running.returncode != 0:
        raise SetupError(f"{title.split(' ', 1)[1]} failed: {errors[0] if errors else last}")


def say(line: str) -> None:
    """Show one line of progress, apart from what the program itself prints."""
    print(f"rayproof: {line}", file=sys.stderr, flush=True)


def words_of_pytest(arguments: Sequence[str]) -> list[str]:
    """Return the words of pytest for those of `rayproof test`; `--quick` chooses the tests of a minute."""
    words = [word for word in arguments if word != "--quick"]
    chosen = QUICK if "--quick" in arguments else []
    return [*in_processes([*chosen, *words]), *chosen, *words]


def in_processes(arguments: Sequence[str]) -> list[str]:
    """Return what has pytest run whole folders, or what markers choose, in several processes, a file at a time.

    A few tests are done before a second process has started; and with other options pytest is left as it is.
    """
    folders = [name for before, name in zip(("", *arguments), arguments, strict=False) if "-m" not in (before, name)]
    return SIDE_BY_SIDE if all((CHECKOUT / name).is_dir() for name in folders) else []


def main(arguments: Sequence[str]) -> NoReturn:
    """Set up what `arguments` need and become the program that they ask for; `install EXTRA` ends after the set-up.

    Raises:
        SetupError: the arguments of `install` are wrong, a prerequisite is missing or a step failed.

    """
    testing, installing = arguments[:1] == ["test"], arguments[:1] == ["install"]
    if installing and (len(arguments) != 2 or arguments[1] not in EXTRAS):
        raise SetupError(f"usage: ./rayproof install {'|'.join(EXTRAS)}; got {' '.join(arguments[1:]) or 'no name'}")
    requirements = "requirements-dev.txt" if testing else "requirements.txt"
    if installing:
        requirements = f"requirements-{arguments[1]}.txt"
    folder = Path(os.environ.get("RAYPROOF_VENV") or CHECKOUT / ".venv").absolute()
    if not is_ready(folder, requirements):
        if lacking := missing_prerequisite():
            raise SetupError(lacking)
        folder.mkdir(parents=True, exist_ok=True)
        with lock(folder):
            if not is_ready(folder, requirements):
                say(f"setting up {folder} (once; about 2 GB)")
                set_up(folder, requirements)
    if installing:
        say(f"{arguments[1]} is installed in {folder}")
        sys.exit(0)
    program = [str(folder / "bin" / "python"), "-m", "pytest"] if testing else [str(folder / "bin" / "rayproof")]
    if testing:
        os.chdir(CHECKOUT)
        if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
            # Tests start hundreds of processes, each of which would compile all that it imports. Nothing is written
            # beside the sources all the same.
            os.environ.setdefault("PYTHONPYCACHEPREFIX", str(folder / "pycache"))
    os.execv(program[0], [*program, *(words_of_pytest(arguments[1:]) if testing else arguments)])


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except KeyboardInterrupt:
        say("interrupted; the next start does the set-up again")
        sys.exit(130)
    except (SetupError, OSError) as error:
        say(str(error))
        sys.exit(2)
