"""The console of rich for all output, or a wide page without colours if the output is not a terminal."""

from typing import Any

from rich.console import Console
from rich.text import Text

from rayproof.reports.results.files import legible_lines

# Piped output is read by programs or in editors; with the 80 columns of rich, long names would be wrapped.
PIPED_WIDTH = 200


class Page(Console):
    """A console that prints text literally: without markup, emoji, or control sequences of terminals and CI logs."""

    def render_str(self, text: str, **how: Any) -> Text:
        """Return a text without control characters; rich calls this for every string, also in tables."""
        return super().render_str(legible_lines(text), **how)


def console(*, width: int = PIPED_WIDTH) -> Console:
    """Return a console for the terminal, or a page of `width` columns if the output is not a terminal."""
    terminal = Page(highlight=False, markup=False, emoji=False)
    return terminal if terminal.is_terminal else Page(highlight=False, markup=False, emoji=False, width=width)
