"""The console of rich that rayproof prints to, or a wide page without colours where there is no terminal."""

from typing import Any

from rich.console import Console
from rich.text import Text

from rayproof.reports.results.files import legible_lines

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
