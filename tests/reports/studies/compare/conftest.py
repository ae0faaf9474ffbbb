"""What the tests of comparisons share: the command line."""

from tests.reports.commands.conftest import rayproof

__all__ = ["rayproof"]
