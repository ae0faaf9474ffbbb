"""The terminal: how this program was called, for hints that work where they are read, and how wide a page it has."""

import os
import shlex
import shutil
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from rayproof.reports.results.files import legible_lines

VARIABLE = "RAYPROOF_CALLED"  # set by the launcher of a checkout, and by `remember` for the processes of a run
NAME = "rayproof"


def called() -> str:
    """Return what to write before a command's arguments: ./rayproof in a checkout, or rayproof, for a shell."""
    return shlex.quote(os.environ.get(VARIABLE) or NAME)


def remember() -> None:
    """Let hints name the program by its path where it was called so and is on nobody's PATH."""
    program = sys.argv[0] if sys.argv else ""
    if VARIABLE not in os.environ and Path(program).name == NAME and shutil.which(NAME) is None:
        os.environ[VARIABLE] = program


# Piped output is read by programs or in editors; rich's 80 columns would break names in two.
PIPED_WIDTH = 200


class Page(Console):
    """A console on which texts are only texts: neither markup nor emoji nor what a terminal or a CI log would obey."""

    def render_str(self, text: str, **how: Any) -> Text:
        """Return a text made harmless; whatever is printed as a string, in a table too, comes by here."""
        return super().render_str(legible_lines(text), **how)


def console(*, width: int = PIPED_WIDTH) -> Console:
    """Return the terminal, or a page of `width` columns."""
    terminal = Page(highlight=False, markup=False, emoji=False)
    return terminal if terminal.is_terminal else Page(highlight=False, markup=False, emoji=False, width=width)
