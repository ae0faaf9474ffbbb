"""The top of the stack: runs renderers on cases, judges their answers and publishes the verdicts."""

from pathlib import Path

HOLDER = str(Path(__file__).parents[2])  # the folder that holds the package `rayproof`
