"""Hooks of mkdocs for the site of these pages: they add the terms and replace links that leave the folder."""

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files  # pyright: ignore[reportMissingImports]

TERMS = Path(__file__).parents[1] / "reports" / "terms.md"
LEAVING = re.compile(r"\[([^\]]+)\]\(\.\./([^)#]+)[^)]*\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the terms, which `rayproof list terms` prints too."""
    files.append(File.generated(config, "terms.md", abs_src_path=str(TERMS)))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Link to the terms, and replace other links out of the folder with the path in the repository."""
    markdown = markdown.replace("](../reports/terms.md", "](terms.md")
    return LEAVING.sub(r"\1 (`\2` in the repository)", markdown)
