"""The terminal that rayproof prints to, or a wide plain page where there is none."""

from rich.console import Console

# Piped output is read by programs or in editors; rich's 80 columns would break names in two.
PIPED_WIDTH = 200


def console(*, width: int = PIPED_WIDTH) -> Console:
    """Return the terminal, or a page of `width` columns."""
    terminal = Console(highlight=False)
    return terminal if terminal.is_terminal else Console(highlight=False, width=width)
