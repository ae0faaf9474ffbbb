"""`rayproof new`: starters for a formula, an adapter of a renderer, and a workflow of a CI service."""

import ast
import inspect
import re
import shlex
import sys
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from rayproof import ROOT
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from rayproof.reports.program_name import called

if TYPE_CHECKING:
    from rayproof.tracer.formulas import Formula

STARTERS = ROOT / "reports" / "subjects" / "starters"
# Language -> the program, the files that it includes, the command that builds it, and the command that calls it.
LANGUAGES = {
    "python": ("adapter.py", (), None, "python3 {file}"),
    "c++": ("adapter.cpp", ("rayproof.hpp",), "c++ -O2 -std=c++17 -o adapter {file}", "./adapter"),
}
WORKFLOWS = ROOT / "reports" / "workflows"
# Service -> the template, and the path where the service expects the workflow.
SERVICES = {
    "github": ("github.yml", Path(".github/workflows/rayproof.yml")),
    "gitlab": ("gitlab.yml", Path(".gitlab-ci.yml")),
}
REPORT = "rayproof-report"
LINE = re.compile(r"[\x00-\x1f\x7f']")  # characters that would end the line or the quoted string of a word

app = App(name="new", help="Write a starter: a formula, an adapter of a renderer, or a workflow for CI.")


def free(*files: Path, hint: str = "") -> None:
    """Raise UsageError if a file exists, or if the folder of the first one cannot be written to."""
    with told_in_one_line():
        writable_folder(files[0].parent)
    for file in files:
        if file.exists():
            raise UsageError(f"{file}: exists already, and is not overwritten{hint}")


@app.command
def formula(slot: str, file: Path) -> int:
    """Write a Python file for your own formula, which begins as a copy of the slot's default formula, and a test of it.

    Parameters
    ----------
    slot
        The slot, such as sphere; `rayproof list formulas` names all slots.
    file
        The file to write, such as mine.py. The test, test_mine.py, is written to the same folder. Neither file may
        exist.

    """
    from rayproof.tracer.formulas import FORMULAS

    if slot not in FORMULAS.slots:
        raise UsageError(f"no slot is called {slot!r}; known: {', '.join(FORMULAS.slots)}")
    if file.suffix != ".py":
        raise UsageError(f"the file must end in .py, got {file}")
    test = file.with_name(f"test_{file.name}")
    free(file, test)
    default = FORMULAS[f"{slot}/{FORMULAS.slots[slot]}"]
    name, text = starter(default)
    with told_in_one_line():
        file.write_text(text, encoding="utf-8")
        test.write_text(starter_test(default, f"{slot}={file.name}:{name}"), encoding="utf-8")
    own = f"{slot}={file}:{name}"
    say(f"wrote {file}: the contract of {slot}, and {default.name} to be changed. It works as it stands. Next:")
    # Compare with another variant, a right one if there is one: the default formula would give the same values.
    others = sorted(FORMULAS.variants(slot)[1:], key=lambda variant: variant.kind != "right")
    compared = [f"compare {others[0].name} {own}"] if others else []
    for step in (f"run --formula {own}", *compared, f"stability {own}"):
        say(f"    {called()} {step}")
    say(f"    {shlex.quote(sys.executable)} -m pytest {test}")
    return 0


def starter_test(default: "Formula", formula: str) -> str:
    """Return the source of a test that judges a formula on the three smallest cases that exercise its slot."""
    from rayproof.cases.families import all_cases

    covering = [case for case in all_cases() if not default.covers or set(default.covers) & set(case.covers)]
    covering.sort(key=lambda case: case.scene.camera.width * case.scene.camera.height)
    names = ", ".join(f'"{case.name}"' for case in covering[:3])
    return (
        f'"""The formula {formula}, judged on cases that exercise its slot."""\n\n'
        f'import pytest\n\n\n@pytest.mark.rayproof({names}, formula="{formula}")\n'
        "def test_my_formula(conformance):\n    conformance.check()\n"
    )


def starter(default: "Formula") -> tuple[str, str]:
    """Return the name of the default formula's function, and the source of a file with it as the user's own formula."""
    name = default.function.__name__
    source = inspect.getsource(sys.modules[default.function.__module__])
    tree, lines = ast.parse(source), source.splitlines()
    bound = {word: node for node in tree.body for word in _bound(node)}
    # The module's statements that the function needs: its definition, and helpers and constants, also indirect ones.
    needed, waiting = {bound[name]}, [bound[name]]
    while waiting:
        new = {bound[word] for word in _words(waiting.pop()) if word in bound} - needed
        needed |= new
        waiting += new
    words = {word for node in needed for word in _words(node)}
    head = [f"A formula of your own for the slot `{default.slot}`.", "", *_contract(default.slot), ""]
    head += _members(default)
    written = "\n".join([*head, f"It begins as {default.name}."]).replace("\\", "\\\\").replace('"""', "'''")
    imports = [ast.unparse(kept) for node in tree.body if (kept := _only(node, words)) is not None]
    # Copy the source lines, which keep their comments.
    body = ["\n".join(lines[node.lineno - 1 : node.end_lineno]) for node in tree.body if node in needed]
    return name, "\n\n\n".join([f'"""{written}\n"""\n\n' + "\n".join(imports), *body]) + "\n"


def _contract(slot: str) -> list[str]:
    """Return the lines of a slot's contract in the docstring of `tracer.formulas`, with the heading of its group."""
    from rayproof.tracer import formulas

    blocks = inspect.cleandoc(formulas.__doc__ or "").split("\n\n")
    place, group = next((k, block) for k, block in enumerate(blocks) if f"\n    {slot}(" in f"\n{block}")
    own = next(lines for lines in re.split(r"\n(?= {4}\w)", group) if lines.startswith(f"    {slot}("))
    return [*blocks[2].splitlines(), "", *blocks[place - 1].splitlines(), "", *own.splitlines()]


def _members(default: "Formula") -> list[str]:
    """Return the fields and methods of a formula's arguments as lines; arguments of other types have none."""
    from rayproof.tracer.rays import Hit, Interval, Ray

    lines: list[str] = []
    for name in inspect.signature(default.function).parameters:
        kind = {"ray": Ray, "interval": Interval, "hit": Hit}.get(name)
        if kind is None:
            continue
        summary = (kind.__doc__ or "").partition("\n")[0]
        attributes = [f"{name}.{field.name}" for field in fields(kind) if field.repr]
        methods = [
            (word, method) for word, method in vars(kind).items() if inspect.isfunction(method) and word[0] != "_"
        ]
        lines += [f"`{name}`: {summary}", "", f"    {', '.join(attributes)}"]
        for word, method in methods:
            words = [*inspect.signature(method).parameters][1:]
            lines += [f"    {name}.{word}({', '.join(words)}): {(method.__doc__ or '').partition(chr(10))[0]}"]
        lines += [""]
    return lines


def _bound(node: ast.stmt) -> list[str]:
    """Return the names that a module's function, class or assignment binds."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    return [target.id for target in getattr(node, "targets", ()) if isinstance(target, ast.Name)]


def _words(node: ast.stmt) -> set[str]:
    return {word.id for word in ast.walk(node) if isinstance(word, ast.Name)}


def _only(node: ast.stmt, words: set[str]) -> ast.stmt | None:
    """Return an import statement reduced to the names in `words`; None for other statements or without such a name."""
    if not isinstance(node, ast.Import | ast.ImportFrom):
        return None
    names = [alias for alias in node.names if (alias.asname or alias.name).split(".")[0] in words]
    if not names:
        return None
    if isinstance(node, ast.Import):
        return ast.Import(names=names)
    return ast.ImportFrom(module=node.module, names=names, level=node.level)


@app.command
def adapter(file: Path, *, language: Literal["python", "c++"] | None = None) -> int:
    """Write a small program that implements the protocol, into which you put your renderer.

    Parameters
    ----------
    file
        The file to write, such as adapter.py or adapter.cpp; it must not exist.
    language
        The program's language. Default: C++ if the file's ending is that of C++, otherwise Python.

    """
    chosen = language or ("c++" if file.suffix in (".cpp", ".cc", ".cxx") else "python")
    program, beside, build, call = LANGUAGES[chosen]
    names = {program: file} | {name: file.parent / name for name in beside}
    free(*names.values())
    for name, target in names.items():
        text = (STARTERS / name).read_text(encoding="utf-8").replace("@FILE@", file.name)
        with told_in_one_line():
            target.write_text(text, encoding="utf-8")
    say(f"wrote {', '.join(map(str, names.values()))}: it works as it stands, for spheres. Next:")
    steps = [f"cd {file.parent}"] if str(file.parent) != "." else []
    steps += [build.format(file=file.name)] if build else []
    words = call.format(file=file.name)
    for command in (f"serve:{words}", f"exec:{words} {{scene}} {{output}}"):
        steps += [f'{called()} run primitives/sphere nearest/spheres --subject "{command}" --out report']
    for step in steps:
        say(f"    {step}")
    say("serve: starts it once for each worker, exec: for each scene.")
    say("Then put your renderer at YOUR RENDERER, declare its capabilities, and run without naming cases.")
    say("A tutorial: docs/first_renderer.md; the protocol: docs/protocol.md; the scene's format: docs/scene.md.")
    return 0


@app.command
def workflow(
    service: Literal["github", "gitlab"],
    *selectors: str,
    source: Annotated[str, Parameter(name="--from")],
    build: str,
    subject: str,
    expect: Path = Path("known.json"),
    least_coverage: float | None = None,
    out: Path | None = None,
) -> int:
    """Write a workflow that runs rayproof in continuous integration.

    The workflow builds the renderer, installs rayproof, runs it, compares the run with a file of known failures, and
    keeps the report.

    Parameters
    ----------
    service
        The service of the workflow.
    selectors
        Families, cases, patterns or scene files to run. Default: the default suite.
    source
        The source from which pip installs rayproof, which is on no package registry: the path of a wheel in your
        project, or git+https://HOST/PROJECT@COMMIT.
    build
        The shell command that builds the renderer from your checkout, such as "make"; "true" if there is nothing to
        build.
    subject
        The renderer under test, as for `rayproof run --subject`.
    expect
        The file of known failures and of the number of answered checks, which `rayproof gate accept` writes.
    least_coverage
        The smallest share [%] of the cases that must be answered. Default: 50.
    out
        The file to write. Default: the path where the service expects it.

    """
    for word in (*selectors, source, build, subject, str(expect)):
        if LINE.search(word):
            raise UsageError(f"{word!r}: a quote or a control character cannot stand in a workflow")
    if "/" not in source and not source.endswith(".whl"):
        raise UsageError(
            f"--from {source}: on a registry this is another package; name a wheel or git+https://...@COMMIT"
        )
    from rayproof.cases.families import select

    with told_in_one_line():
        if names := [word for word in selectors if not word.endswith((".json", ".jsonl", "/"))]:
            select(names)
    name, usual = SERVICES[service]
    file = out or usual
    command = ["rayproof", "run", *selectors, "--out", REPORT]
    command += ["--subject", subject, "--expect", str(expect)]
    command += ["--least-coverage", f"{least_coverage:g}"] if least_coverage is not None else []
    filled = (WORKFLOWS / name).read_text(encoding="utf-8")
    # Double quotes, since the templates put the command into single quotes, and YAML reads its line as a string.
    words = [shlex.quote(word).replace("'", '"') for word in command]
    for mark, text in (("@INSTALL@", f'"{source}"'), ("@BUILD@", build), ("@RUN@", " ".join(words)), ("@OUT@", REPORT)):
        filled = filled.replace(mark, text)
    with told_in_one_line():
        file.parent.mkdir(parents=True, exist_ok=True)
        free(file, hint="; --out names another file")
        file.write_text(filled, encoding="utf-8")
    say(f"wrote {file}; it runs: {' '.join(words)}")
    accept = f"{called()} gate accept {REPORT} --file {expect} --reason WHY"
    say(f"{expect} must lie in your project: run this command here without --expect, then {accept}")
    return 0
