"""Workflow files for CI services: each installs rayproof, runs it and keeps the report.

In a file `@INSTALL@` stands for what pip is to install, `@RUN@` for the command, `@OUT@` for the results folder. All of
them are quoted for a shell already.
"""
