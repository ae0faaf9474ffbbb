"""One file for each command: it reads the arguments, calls the layer that does the work, and shows the answer.

To add one: a function here and a line in `reports.cli.COMMANDS`. It returns the exit code, raises `UsageError` for
what the user got wrong, and imports what is heavy inside the function.
"""
