"""The commands, one file each: a command reads its arguments, calls the layer below, and prints the result.

To add a command, write a function here and add a line to `reports.cli.COMMANDS`. The function returns the exit code,
raises `UsageError` for a user's mistake, and imports slow modules inside its body.
"""
