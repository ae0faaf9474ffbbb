"""`rayproof adapt`: a starter for putting a renderer of one's own under test."""

from pathlib import Path
from typing import Literal

from rayproof import ROOT
from rayproof.reports.called import called
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

STARTERS = ROOT / "reports" / "subjects" / "starters"
# The program, what belongs beside it, how it is built, and how it is called.
LANGUAGES = {
    "python": ("adapter.py", (), None, "python3 {file}"),
    "c++": ("adapter.cpp", ("rayproof.hpp",), "c++ -O2 -std=c++17 -o adapter {file}", "./adapter"),
}


def adapt(file: Path, *, language: Literal["python", "c++"] | None = None) -> int:
    """Write a starter adapter: a small program that speaks the protocol, to put your renderer into.

    Parameters
    ----------
    file
        The file to write, such as adapter.py or adapter.cpp; it must not exist.
    language
        Its language. Default: by the file's ending, Python if that says nothing.

    """
    chosen = language or ("c++" if file.suffix in (".cpp", ".cc", ".cxx") else "python")
    program, beside, build, call = LANGUAGES[chosen]
    names = {program: file} | {name: file.parent / name for name in beside}
    with told_in_one_line():
        writable_folder(file.parent)
    for target in names.values():
        if target.exists():
            raise UsageError(f"{target}: exists already, and is not overwritten")
    for name, target in names.items():
        text = (STARTERS / name).read_text(encoding="utf-8").replace("@FILE@", file.name)
        with told_in_one_line():
            target.write_text(text, encoding="utf-8")
    say(f"wrote {', '.join(map(str, names.values()))}: it works as it stands, for spheres. Next:")
    steps = [f"cd {file.parent}"] if str(file.parent) != "." else []
    steps += [build.format(file=file.name)] if build else []
    command = f'"exec:{call.format(file=file.name)} {{scene}} {{output}}"'
    steps += [f"{called()} run primitives/sphere nearest --subject {command} --out report"]
    for step in steps:
        say(f"    {step}")
    say("then put your renderer where YOUR RENDERER stands, declare what it can, and run without naming cases.")
    say("The protocol: docs/protocol.md; the scene's format: docs/scene.md and `rayproof schema`.")
    return 0
