"""A fuzz campaign: files broken on purpose, by the thousand, for everything that rayproof reads from others.

    python -m tests.harness.fuzz --inputs 1000000 --out findings --json figures.json

A reader may refuse a file in the way that its docstring says, or take it. Whatever else it does is a finding: another
exception, much time or memory, a file opened outside of its own folder.
"""
