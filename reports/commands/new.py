"""`rayproof new`: a starter for a formula of one's own, made from its slot's contract and default."""

import ast
import inspect
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rayproof.reports.called import called
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder

if TYPE_CHECKING:
    from rayproof.tracer.formula import Formula


def new(what: Literal["formula"], slot: str, file: Path) -> int:
    """Write a starter for a formula of one's own: the slot's contract, and its default to be changed.

    Parameters
    ----------
    what
        What to write: formula.
    slot
        The slot that it is for, such as sphere; `rayproof list formulas` names them.
    file
        The file to write, such as mine.py; it must not exist.

    """
    from rayproof.tracer.catalogue import FORMULAS

    if slot not in FORMULAS.slots:
        raise UsageError(f"no slot is called {slot!r}; known: {', '.join(FORMULAS.slots)}")
    if file.suffix != ".py":
        raise UsageError(f"the file must end in .py, got {file}")
    with told_in_one_line():
        writable_folder(file.parent)
    if file.exists():
        raise UsageError(f"{file}: exists already, and is not overwritten")
    default = FORMULAS[f"{slot}/{FORMULAS.slots[slot]}"]
    name, text = starter(default)
    with told_in_one_line():
        file.write_text(text, encoding="utf-8")
    mine = f"{slot}={file}:{name}"
    say(f"wrote {file}: the contract of {slot}, and {default.name} to be changed. It works as it stands. Next:")
    for step in (f"run --formula {mine}", f"compare {default.name} {mine}", f"stability {mine}"):
        say(f"    {called()} {step}")
    return 0


def starter(default: "Formula") -> tuple[str, str]:
    """Return a function's name and the text of a file that holds it: the default of a slot as a user's own formula."""
    module = sys.modules[default.function.__module__]
    source = inspect.getsource(module)
    tree = ast.parse(source)
    lines = source.splitlines()
    taken: set[int] = set()  # numbers of lines, from 1
    name = default.function.__name__
    for node in tree.body:
        for decorator in getattr(node, "decorator_list", ()):
            taken.update(range(decorator.lineno, (decorator.end_lineno or decorator.lineno) + 1))
    words = {word.id for node in tree.body if not _imports(node) for word in _outside_decorators(node)}
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            kept = [alias for alias in node.names if (alias.asname or alias.name).split(".")[0] in words]
            taken.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
            if kept:
                taken.discard(node.lineno)
                lines[node.lineno - 1] = ast.unparse(_only(node, kept))
    about = tree.body[0]
    taken.update(range(1, (about.end_lineno or 1) + 1))
    body = "\n".join(line for number, line in enumerate(lines, 1) if number not in taken).strip()
    head = [f"A formula of one's own for the slot `{default.slot}`.", "", *_contract(default), ""]
    head += [f"It begins as {default.name}: {(ast.get_docstring(tree) or '').strip()}"]
    written = "\n".join(head).replace("\\", "\\\\").replace('"""', "'''")
    return name, f'"""{written}\n"""\n\n' + re.sub(r"\n{4,}", "\n\n\n", body) + "\n"


def _contract(default: "Formula") -> list[str]:
    """Return the contract of a slot, as its folder states it; without the lines that are other slots'."""
    folder = sys.modules[default.function.__module__.rpartition(".")[0]]
    lines = inspect.cleandoc(folder.__doc__ or "").splitlines()[2:]
    starts = [number for number, line in enumerate(lines) if re.match(r" {4}\w+\(", line)]
    mine = [number for number in starts if lines[number].startswith(f"    {default.slot}(")]
    if not mine:
        return lines
    ends = [*starts[1:], next((n for n in range(starts[-1], len(lines)) if not lines[n].strip()), len(lines))]
    end = ends[starts.index(mine[0])]
    return [*lines[: starts[0]], *lines[mine[0] : end], *lines[ends[-1] :]]


def _imports(node: ast.stmt) -> bool:
    return isinstance(node, ast.Import | ast.ImportFrom)


def _outside_decorators(node: ast.stmt) -> list[ast.Name]:
    inside = {word for one in getattr(node, "decorator_list", ()) for word in ast.walk(one)}
    return [word for word in ast.walk(node) if isinstance(word, ast.Name) and word not in inside]


def _only(node: ast.Import | ast.ImportFrom, names: list[ast.alias]) -> ast.stmt:
    if isinstance(node, ast.Import):
        return ast.Import(names=names)
    return ast.ImportFrom(module=node.module, names=names, level=node.level)
