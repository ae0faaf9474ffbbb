"""Workflows of CI services, as files to copy: each installs rayproof, runs it, and keeps the report in any case.

In a file `@INSTALL@` stands for what pip is to install, `@RUN@` for the command, `@OUT@` for the results folder. All of
them are quoted for a shell already.
"""
