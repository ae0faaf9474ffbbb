"""The table of docs/files.md, made of the docstrings: `python -m tests.file_map` writes it, and a test compares it."""

import ast
import re
from pathlib import Path

CHECKOUT = Path(__file__).parents[1]
PACKAGES = ("cases", "tracer", "reference", "reports")


def first_sentence(file: Path) -> str:
    """Return the first sentence of a module's docstring."""
    docstring = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    paragraph = " ".join(docstring.split("\n\n")[0].split())
    sentence = re.match(r".*?[.?](?= |$)", paragraph)
    return sentence.group() if sentence else paragraph


def folders() -> list[Path]:
    """Return the product's folders that hold Python files, each before those below it."""
    files = [file for package in PACKAGES for file in sorted((CHECKOUT / package).rglob("*.py"))]
    return sorted({file.parent for file in files}, key=lambda folder: (PACKAGES.index(package_of(folder)), str(folder)))


def package_of(folder: Path) -> str:
    """Return the package that a folder lies in."""
    return folder.relative_to(CHECKOUT).parts[0]


def row(name: str, sentence: str) -> str:
    """Return a row in Markdown."""
    return f"| {name} | {sentence.replace('|', chr(92) + '|')} |".replace("  ", " ")


def table() -> str:
    """Return a row in Markdown for each file; a folder's `__init__.py` is the heading row of its folder."""
    rows = ["| file | contents |", "|---|---|"]
    for folder in folders():
        heading = folder / "__init__.py"
        name = f"**{folder.relative_to(CHECKOUT).as_posix()}/**"
        rows.append(row(name, first_sentence(heading) if heading.exists() else ""))
        files = sorted(file for file in folder.glob("*.py") if file != heading)
        rows += [row(f"`{file.name}`", first_sentence(file)) for file in files]
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    page = CHECKOUT / "docs" / "files.md"
    before, rest = re.split(r"(?<=tests\.file_map -->\n\n)", page.read_text(encoding="utf-8"), maxsplit=1)
    page.write_text(before + table() + rest[rest.index("\n<!-- end -->") :], encoding="utf-8")
