"""Set up a virtual environment for this checkout, then replace this process by the requested program.

It uses only the standard library, since it runs before any package is installed. `./rayproof` calls it with a Python
that is new enough.
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
# A process that runs tests takes up to 2.4 GB, so that a large machine does not start one for every processor.
# The files are started in the order of tests/conftest.py, the longest first.
SIDE_BY_SIDE = ["-n", "logical", "--maxprocesses", "4", "--dist", "loadfile", "--no-loadscope-reorder"]
# What a contributor runs while working: all that needs neither Chromium, a child process, another renderer nor time.
QUICK = ["-m", "not browser and not process and not references and not slow"]
IN_PROGRESS = {"state": "in progress"}
EXTRAS = ("dask",)  # each has its own lock file, requirements-NAME.txt


class SetupError(Exception):
    """A set-up cannot continue; the message is one line with the reason and the remedy."""


def missing_prerequisite() -> str | None:
    """Return a line with the first prerequisite that this machine lacks, or None."""
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
    """Return the SHA-256 of files of the checkout together."""
    return hashlib.sha256(b"\0".join((CHECKOUT / name).read_bytes() for name in files)).hexdigest()


def wanted(folder: Path) -> dict[str, str]:
    """Return the stamp of a finished set-up of this checkout, without the digests of the installed requirements."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return {"state": "finished", "python": version, "folder": str(folder), "project": digest("pyproject.toml")}


def read_stamp(folder: Path) -> dict[str, str]:
    """Return the stamp of the last set-up in the environment `folder`; empty if there is none."""
    try:
        stamp = json.loads((folder / STAMP).read_text())
    except (OSError, ValueError):
        return {}
    return stamp if isinstance(stamp, dict) and (folder / "bin" / "python").exists() else {}


def is_ready(folder: Path, requirements: str) -> bool:
    """Return whether `folder` contains a finished set-up of this checkout with `requirements` installed."""
    stamp = read_stamp(folder)
    return stamp.items() >= wanted(folder).items() and stamp.get(requirements) == digest(requirements)


@contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Lock the environment `folder` against other set-ups; the lock ends with the processes that inherit it."""
    handle = os.open(folder, os.O_RDONLY)
    os.set_inheritable(handle, True)  # if the launcher is killed, pip still writes, so that it must keep the lock
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
    """Install `requirements` into the environment `folder`, with every file checked against its hash.

    Raises:
        SetupError: a step failed.

    """
    stamp, python = read_stamp(folder), str(folder / "bin" / "python")
    # Discard the result of an interrupted set-up: pip would take a partly copied package for an installed one.
    keep = stamp.get("state") == "finished" and all(stamp.get(k) == wanted(folder)[k] for k in ("python", "folder"))
    if not (folder / STAMP).exists() and any(folder.iterdir()):
        raise SetupError(f"{folder} was not made by ./rayproof: remove it, or name another folder in RAYPROOF_VENV")
    (folder / STAMP).write_text(json.dumps(IN_PROGRESS))
    if not keep:
        empty(folder)
        step("1/4 making the virtual environment", [sys.executable, "-m", "venv", str(folder)])
    pip = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--progress-bar", "off"]
    # Python compiles a module at its first import, and only a few of the installed modules are ever imported.
    pip = [*pip, "--no-compile"]
    step(f"2/4 installing {requirements}", [*pip, "--require-hashes", "-r", str(CHECKOUT / requirements)])
    # The wheel of LLVM creates the links to its library at the first start of Python after its installation.
    step("3/4 linking the packaged LLVM", [python, "-c", "pass"])
    step("4/4 installing rayproof", [*pip, "--no-deps", "--no-build-isolation", "--editable", str(CHECKOUT)])
    # Every lock file contains the packages of requirements.txt in the same versions (tests/test_architecture.py), so
    # that the packages of an earlier set-up are still installed.
    held = {"requirements.txt", requirements}
    if keep:
        held |= {path.name for path in CHECKOUT.glob("requirements*.txt") if stamp.get(path.name) == digest(path.name)}
    finished = wanted(folder) | {name: digest(name) for name in sorted(held)}
    (folder / STAMP).write_text(json.dumps(finished, indent=1))


def empty(folder: Path) -> None:
    """Remove all files but the stamp, which marks the set-up as in progress until its end."""
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        elif entry.name != STAMP:
            entry.unlink()


def step(title: str, command: Sequence[str]) -> None:
    """Print `title` and run `command`; on a terminal, also show its progress.

    Raises:
        SetupError: the command failed; the message contains its first error, or its last line without any.

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
    """Print one line of progress to standard error, so that the program's own output stays separate."""
    print(f"rayproof: {line}", file=sys.stderr, flush=True)


def words_of_pytest(arguments: Sequence[str]) -> list[str]:
    """Return the words of pytest for those of `rayproof test`; `--quick` chooses the tests of a minute."""
    words = [word for word in arguments if word != "--quick"]
    chosen = QUICK if "--quick" in arguments else []
    return [*in_processes([*chosen, *words]), *chosen, *words]


def in_processes(arguments: Sequence[str]) -> list[str]:
    """Return the options of pytest that run whole folders, or the tests of a marker, in several processes.

    Return no options for single files or tests, which would finish before a second process has started, and for other
    options of pytest.
    """
    folders = [name for before, name in zip(("", *arguments), arguments, strict=False) if "-m" not in (before, name)]
    return SIDE_BY_SIDE if all((CHECKOUT / name).is_dir() for name in folders) else []


def main(arguments: Sequence[str]) -> NoReturn:
    """Set up the environment for `arguments`, then replace this process by their program, except for `install EXTRA`.

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
            # Tests start hundreds of processes, and each would compile all modules that it imports. This cache is
            # outside the folders of the sources, where the user wants no compiled files.
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
