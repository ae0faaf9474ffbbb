"""The work-precision diagrams that `rayproof tradeoff` left in a results folder, for the page to show."""

import re
from pathlib import Path

# What `rayproof tradeoff` writes; anything else in the folder is a stranger's.
DIAGRAM = re.compile(r"[A-Za-z0-9_.-]+\.svg")


def diagrams(folder: Path) -> list[str]:
    """Return the names of the diagrams below `folder`/tradeoff, overall ones first; none without their page."""
    place = folder / "tradeoff"
    if not (place / "index.html").is_file():
        return []
    names = sorted(path.name for path in place.glob("*.svg") if DIAGRAM.fullmatch(path.name))
    return sorted(names, key=lambda name: not name.endswith("-overall.svg"))
