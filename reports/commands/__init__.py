"""The commands, one file each, thin: read the arguments, ask the layer that knows, show the answer.

To add one: a function here and a line in `reports.cli.COMMANDS`. It returns the exit code, raises `UsageError` for
what the user got wrong, and imports what is heavy inside the function.
"""
