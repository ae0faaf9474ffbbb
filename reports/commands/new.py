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
    from rayproof.tracer.formulas import Formula


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
    from rayproof.tracer.formulas import FORMULAS

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
    name = default.function.__name__
    source = inspect.getsource(sys.modules[default.function.__module__])
    tree, lines = ast.parse(source), source.splitlines()
    bound = {word: node for node in tree.body if not _imports(node) for word in _bound(node)}
    # What the function needs of its page: itself, its helpers and constants, and what these need.
    needed, waiting = {bound[name]}, [bound[name]]
    while waiting:
        found = {bound[word] for word in _words(waiting.pop()) if word in bound} - needed
        needed |= found
        waiting += found
    words = {word for node in needed for word in _words(node)}
    head = [f"A formula of one's own for the slot `{default.slot}`.", "", *_contract(default.slot), ""]
    written = "\n".join([*head, f"It begins as {default.name}."]).replace("\\", "\\\\").replace('"""', "'''")
    imports = [ast.unparse(kept) for node in tree.body if (kept := _only(node, words)) is not None]
    # By lines, which have the comments beside them.
    body = ["\n".join(lines[node.lineno - 1 : node.end_lineno]) for node in tree.body if node in needed]
    return name, "\n\n\n".join([f'"""{written}\n"""\n\n' + "\n".join(imports), *body]) + "\n"


def _contract(slot: str) -> list[str]:
    """Return the contract of a slot, as `tracer.formulas` states it among those of its group."""
    from rayproof.tracer import formulas

    blocks = inspect.cleandoc(formulas.__doc__ or "").split("\n\n")
    place, group = next((k, block) for k, block in enumerate(blocks) if f"\n    {slot}(" in f"\n{block}")
    own = next(lines for lines in re.split(r"\n(?= {4}\w)", group) if lines.startswith(f"    {slot}("))
    return [*blocks[2].splitlines(), "", *blocks[place - 1].splitlines(), "", *own.splitlines()]


def _imports(node: ast.stmt) -> bool:
    return isinstance(node, ast.Import | ast.ImportFrom)


def _bound(node: ast.stmt) -> list[str]:
    """Return the names that a function, class or assignment of a page binds."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    return [target.id for target in getattr(node, "targets", ()) if isinstance(target, ast.Name)]


def _words(node: ast.stmt) -> set[str]:
    return {word.id for word in ast.walk(node) if isinstance(word, ast.Name)}


def _only(node: ast.stmt, words: set[str]) -> ast.stmt | None:
    """Return an import of those names alone that are among the words; None for another statement or no such name."""
    if not isinstance(node, ast.Import | ast.ImportFrom):
        return None
    names = [alias for alias in node.names if (alias.asname or alias.name).split(".")[0] in words]
    if not names:
        return None
    if isinstance(node, ast.Import):
        return ast.Import(names=names)
    return ast.ImportFrom(module=node.module, names=names, level=node.level)
