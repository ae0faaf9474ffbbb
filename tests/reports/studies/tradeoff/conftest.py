"""What the tests of trade-offs share: the command line."""

from tests.reports.commands.conftest import rayproof

__all__ = ["rayproof"]
