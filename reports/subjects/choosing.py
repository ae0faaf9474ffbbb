"""Selection of the subject by the user's text: a reference, `exec:` or `serve:` and a command, or a Python function."""

import hashlib
import os
import re
import shlex
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rayproof import HOLDER, ROOT
from rayproof.cases.stages import Stage
from rayproof.reports.interchange import EXPORTERS
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.subjects import FUNCTION, PROGRAM, SERVED, TRACER, Subject
from rayproof.reports.subjects.calls import SCENE_WORD
from rayproof.reports.subjects.image_files import FORMATS
from rayproof.reports.subjects.protocol import JSON, Capabilities, capabilities_of, declaration

PREFIXES = tuple(f"{name}:" for name in (PROGRAM, SERVED, FUNCTION))
KNOWN = "exec:COMMAND, serve:COMMAND or python:FILE.py:FUNCTION"
OUTPUTS = ("{output}", *(f"{{output.{name}}}" for name in FORMATS if name != "exr"))
# Programs that run a file in one of their arguments; the subject gets the name of that file.
INTERPRETERS = re.compile(r"(python[\d.]*|node|deno|bun|ruby|perl|java|julia|Rscript|lua\w*|sh|bash|dash|zsh|wine\d*)")
LONGEST = 40  # characters of a name
START = "import sys; sys.path[0] = sys.argv[1]; from rayproof.reports.api.function import serve; serve(*sys.argv[3:])"


def chosen(
    text: str,
    *,
    seconds: float,
    memory: int,
    ask: Callable[[Subject], Capabilities],
    variables: tuple[str, ...] = (),
    before_oracle: bool = True,
    declare: Path | None = None,
) -> Subject:
    """Return the subject that `text` names; `ask` requests a program's capabilities.

    `before_oracle`: the subject is judged by the oracle, so that it cannot be the oracle itself. The file `declare`
    contains capabilities that a program does not declare itself.

    Raises:
        LookupError: there is no reference of this name; the message lists the known names.
        ValueError: the subject cannot be tested, or a program's command or answer is against the protocol.
        OSError: a program's file cannot be read.

    """
    if text.startswith(PREFIXES):
        return _program(text, declare, seconds=seconds, memory=memory, ask=ask, variables=variables)
    if variables or declare is not None:
        option = "--env" if variables else "--declare"
        raise ValueError(f"{option} is for a program under test, {KNOWN}; got {text!r}")
    from rayproof.reference import REFERENCES

    if text not in REFERENCES:
        raise LookupError(f"--subject: no renderer is called {text!r}; known: {', '.join(REFERENCES)}, {KNOWN}")
    if text == ORACLE and before_oracle:
        raise ValueError(
            f"--subject {ORACLE}: it draws the edges and limits by which everyone is judged, so that nothing could "
            "contradict it here; `rayproof run --subject certified` holds it against proved digits"
        )
    if (why := reason_missing(text)) is not None:
        raise ValueError(f"--subject {text}: {why}")
    return Subject(name=text, title=text)


def reason_missing(reference: str) -> str | None:
    """Return a sentence with the reason why a reference cannot run on this machine, or None."""
    from rayproof.reference import REFERENCES

    missing = getattr(REFERENCES[reference], "missing", None)
    return missing() if missing is not None else None


def _program(
    text: str,
    declare: Path | None,
    *,
    seconds: float,
    memory: int,
    ask: Callable[[Subject], Capabilities],
    variables: tuple[str, ...],
) -> Subject:
    transport, _, rest = text.partition(":")
    declared = {} if declare is None else declaration(declare)
    if transport == FUNCTION:
        command = _function(text, rest)
    else:
        command = _command(text, rest, once=transport == PROGRAM, writes="writes" in declared)
    for variable in variables:
        if variable not in os.environ:
            raise ValueError(f"--env {variable}: there is no environment variable of this name")
    about = {"seconds": seconds, "memory": memory, "variables": variables}
    subject = Subject(name=transport, title=text, transport=transport, command=command, **about)
    subject = replace(subject, declare="" if declare is None else str(declare))
    word = _scene_word(text, command)
    try:
        # A program that only reads another program's scene format was not written for rayproof.
        foreign = word is not None and not any("{scene}" in part for part in command)
        capabilities = Capabilities() if foreign else ask(subject)
    except ValueError as error:
        what = {SERVED: "its answer to the request for capabilities", FUNCTION: "it cannot be loaded"}
        raise ValueError(f"--subject {text}: {what.get(transport, 'its answer to --capabilities')}: {error}") from None
    try:
        capabilities = capabilities_of(declared, capabilities.protocol, capabilities, by_user=True)
        if transport == PROGRAM and capabilities.random and not any("{seed}" in word for word in command):
            raise ValueError("random: the command needs {seed}, since renders that are all the same tell no noise")
        capabilities = _as_far_as_files_say(replace(subject, capabilities=capabilities), word)
    except ValueError as error:
        raise ValueError(f"{f'--declare {declare}' if declared else f'--subject {text}'}: {error}") from None
    subject = replace(subject, capabilities=capabilities, name=_name(capabilities.name, command))
    return replace(subject, identity=identity(subject))


def _as_far_as_files_say(subject: Subject, word: str | None) -> Capabilities:
    """Return a program's capabilities, limited to those that its scene and image formats can represent."""
    able = subject.capabilities
    if word is not None:
        able = replace(able, scene_format=word)
    if able.says is not None:
        able = able.within(able.says)
    suffix = Path(subject.image_name).suffix.removeprefix(".")
    if able.stages is None and suffix != "exr":  # other image formats have three channels
        able = replace(able, stages=(Stage.RADIANCE,))
    return able


def _scene_word(text: str, command: tuple[str, ...]) -> str | None:
    """Return the format of `{scene.FORMAT}` in a command, or None.

    Raises:
        ValueError: there are several formats, or the format is unknown.

    """
    formats = [suffix.removeprefix(".") for suffix in EXPORTERS]
    words = list(dict.fromkeys(match[1] for part in command for match in SCENE_WORD.finditer(part)))
    for word in words:
        if word not in (*formats, JSON):
            placeholders = ", ".join(f"{{scene.{name}}}" for name in formats)
            raise ValueError(f"--subject {text}: {{scene.{word}}} is no format that is written; known: {placeholders}")
    if len(words) > 1:
        raise ValueError(f"--subject {text}: a scene is handed over in one format, got {', '.join(words)}")
    return None if words in ([], [JSON]) else words[0]


def _name(declared: str, command: tuple[str, ...]) -> str:
    """Return a program's name: its declared name, or the name of its file; never the name of a reference."""
    from rayproof.reference import REFERENCES

    file = Path(command[0])
    if INTERPRETERS.fullmatch(file.name):
        file = next((Path(word) for word in command[1:] if _lies(word) and Path(word).is_file()), file)
    name = re.sub(r"[^A-Za-z0-9._+-]+", "_", declared or file.stem).strip("_")[:LONGEST] or "program"
    return f"{name}_under_test" if name.lower() in (TRACER, *map(str.lower, REFERENCES)) else name


def _command(text: str, rest: str, *, once: bool, writes: bool) -> tuple[str, ...]:
    """Return the words of a command, with absolute paths.

    Raises:
        ValueError: the command cannot be called.

    """
    try:
        words = shlex.split(rest)
    except ValueError as error:
        raise ValueError(f"--subject {text}: {error}") from None
    if not words:
        raise ValueError(f"--subject {text}: there is no command after {text[: len(text) - len(rest)]!r}")
    program = shutil.which(words[0])
    if program is None:
        raise ValueError(f"--subject {text}: {words[0]!r} is no program that can be run")
    places = [output for word in words for output in OUTPUTS if output in word]
    if once and not places and not writes:
        raise ValueError(
            f"--subject {text}: none of its words is {', '.join(OUTPUTS[:-1])} or {OUTPUTS[-1]}, the path of the image "
            "that it is to write; a program that always writes the same file is described by --declare"
        )
    if not once and places:
        raise ValueError(
            f"--subject {text}: leave {places[0]} out; a program that stays alive gets paths in its requests"
        )
    # Each call runs in a folder of its own, so that relative paths would not be found.
    return str(Path(program).absolute()), *map(_absolute, words[1:])


def _function(text: str, rest: str) -> tuple[str, ...]:
    """Return the command that serves a Python function.

    Raises:
        ValueError: the text does not name a function in an existing file.

    """
    file, _, function = rest.rpartition(":")
    if not file.endswith(".py") or not function.isidentifier():
        raise ValueError(f"--subject {text}: a function is named as {FUNCTION}:FILE.py:FUNCTION")
    if not Path(file).is_file():
        raise ValueError(f"--subject {text}: there is no file {file}")
    return sys.executable, "-c", START, str(HOLDER), str(ROOT), str(Path(file).absolute()), function


def identity(program: Subject) -> tuple[str, ...]:
    """Return everything that determines a program's results: its command, its capabilities, and digests of its files.

    The values of its additional environment variables are included only as a digest, since they may be secrets.
    """
    settings = [f"{name}={os.environ.get(name)}" for name in program.variables]
    passed = hashlib.sha256(repr(settings).encode()).hexdigest()
    return (*program.command, repr(program.capabilities), passed, *map(_digest, program.command))


def _absolute(word: str) -> str:
    return str(Path(word).absolute()) if not word.startswith("-") and _lies(word) else word


def _lies(word: str) -> bool:
    """Return whether a word is an existing path; a word that is too long for a path, such as a script, is none."""
    try:
        return "{" not in word and Path(word).exists()
    except (OSError, ValueError):
        return False


def _digest(word: str) -> str:
    """Return the digest of the file that a word names, so that a rebuilt program is tested again; "" if none."""
    path = Path(word)
    if not _lies(word) or not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
