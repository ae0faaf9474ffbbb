"""What a user names becomes the subject: a reference, `exec:` or `serve:` and a command, or a Python function."""

import hashlib
import os
import shlex
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rayproof import HOLDER, ROOT
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.subjects import FUNCTION, PROGRAM, SERVED, Subject
from rayproof.reports.subjects.protocol import Capabilities

PREFIXES = tuple(f"{name}:" for name in (PROGRAM, SERVED, FUNCTION))
KNOWN = "exec:COMMAND, serve:COMMAND or python:FILE.py:FUNCTION"
OUTPUTS = ("{output}", "{output.pfm}")
START = "import sys; sys.path[0] = sys.argv[1]; from rayproof.reports.api.function import serve; serve(*sys.argv[3:])"


def chosen(
    text: str,
    *,
    seconds: float,
    memory: int,
    ask: Callable[[Subject], Capabilities],
    variables: tuple[str, ...] = (),
    before_oracle: bool = True,
) -> Subject:
    """Return the subject that `text` names; `ask` puts `--capabilities` to a program.

    `before_oracle` says that it will be judged by the oracle, which nobody can be before himself.

    Raises:
        LookupError: no reference is called so; the message lists what is known.
        ValueError: it cannot be put under test, or a program's command or answer is not as the protocol asks.
        OSError: a program's file cannot be read.

    """
    if text.startswith(PREFIXES):
        return _program(text, seconds=seconds, memory=memory, ask=ask, variables=variables)
    if variables:
        raise ValueError(f"--env is for a program under test, {KNOWN}; got {text!r}")
    from rayproof.reference import REFERENCES

    if text not in REFERENCES:
        raise LookupError(f"--subject: no renderer is called {text!r}; known: {', '.join(REFERENCES)}, {KNOWN}")
    if text == ORACLE and before_oracle:
        raise ValueError(
            f"--subject {ORACLE}: it draws the edges and limits by which everyone is judged, so that nothing could "
            "contradict it here; `rayproof run --subject double_double` holds it against 31 digits"
        )
    if (why := reason_missing(text)) is not None:
        raise ValueError(f"--subject {text}: {why}")
    return Subject(name=text, title=text)


def reason_missing(reference: str) -> str | None:
    """Return why a reference cannot run here, in a sentence, or None."""
    from rayproof.reference import REFERENCES

    missing = getattr(REFERENCES[reference], "missing", None)
    return missing() if missing is not None else None


def _program(
    text: str, *, seconds: float, memory: int, ask: Callable[[Subject], Capabilities], variables: tuple[str, ...]
) -> Subject:
    name, _, rest = text.partition(":")
    command = _function(text, rest) if name == FUNCTION else _command(text, rest, once=name == PROGRAM)
    for variable in variables:
        if variable not in os.environ:
            raise ValueError(f"--env {variable}: there is no environment variable of this name")
    subject = Subject(name=name, title=text, command=command, seconds=seconds, memory=memory, variables=variables)
    try:
        capabilities = ask(subject)
    except ValueError as error:
        what = {SERVED: "its answer to the request for capabilities", FUNCTION: "it cannot be loaded"}
        raise ValueError(f"--subject {text}: {what.get(name, 'its answer to --capabilities')}: {error}") from None
    subject = replace(subject, capabilities=capabilities)
    return replace(subject, identity=identity(subject))


def _command(text: str, rest: str, *, once: bool) -> tuple[str, ...]:
    """Return the words of a command, with absolute paths; raise ValueError where it cannot be called."""
    try:
        words = shlex.split(rest)
    except ValueError as error:
        raise ValueError(f"--subject {text}: {error}") from None
    if not words:
        raise ValueError(f"--subject {text}: there is no command after {text[: len(text) - len(rest)]!r}")
    found = shutil.which(words[0])
    if found is None:
        raise ValueError(f"--subject {text}: {words[0]!r} is no program that can be run")
    places = [output for word in words for output in OUTPUTS if output in word]
    if once and not places:
        raise ValueError(
            f"--subject {text}: none of its words is {' or '.join(OUTPUTS)}, the path of the image that it is to write"
        )
    if not once and places:
        raise ValueError(
            f"--subject {text}: leave {places[0]} out; a program that stays alive gets paths in its requests"
        )
    # Every call has a folder of its own: what is named relative to this one must be found from there.
    return str(Path(found).absolute()), *map(_absolute, words[1:])


def _function(text: str, rest: str) -> tuple[str, ...]:
    """Return the command by which a Python function stays alive; raise ValueError where there is no such file."""
    file, _, function = rest.rpartition(":")
    if not file.endswith(".py") or not function.isidentifier():
        raise ValueError(f"--subject {text}: a function is named as {FUNCTION}:FILE.py:FUNCTION")
    if not Path(file).is_file():
        raise ValueError(f"--subject {text}: there is no file {file}")
    return sys.executable, "-c", START, str(HOLDER), str(ROOT), str(Path(file).absolute()), function


def identity(program: Subject) -> tuple[str, ...]:
    """Return what a program's results depend on: its command, what it says that it can, and the files as they are here.

    Of the environment's variables that it gets only a digest, since values may be secrets.
    """
    settings = [f"{name}={os.environ.get(name)}" for name in program.variables]
    passed = hashlib.sha256(repr(settings).encode()).hexdigest()
    return (*program.command, repr(program.capabilities), passed, *map(_digest, program.command))


def _absolute(word: str) -> str:
    return str(Path(word).absolute()) if not word.startswith("-") and _lies(word) else word


def _lies(word: str) -> bool:
    """Say whether a word is the path of something; one that is too long for a path, such as a script, is of nothing."""
    try:
        return "{" not in word and Path(word).exists()
    except (OSError, ValueError):
        return False


def _digest(word: str) -> str:
    """Return the digest of the file that a word names, so that a program built anew is asked anew."""
    path = Path(word)
    if not _lies(word) or not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
