"""A command run in this process, as the tests of the commands have it."""

from tests.reports.commands.conftest import rayproof as rayproof
