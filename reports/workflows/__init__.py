"""Templates of workflows for CI services: each installs rayproof, runs it and keeps the report.

The placeholders are `@INSTALL@` for the source that pip installs, `@BUILD@` for the command that builds the renderer,
`@RUN@` for the command that runs rayproof, and `@OUT@` for the results folder. Their values need no further quoting for
a shell.
"""
