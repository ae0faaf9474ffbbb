"""Who counts as one voice: programs that share code repeat each other, and only different ones are independent."""

from collections.abc import Iterable

from rayproof.reference import REFERENCES

SUBJECT = "the one under test"


def voice(name: str, tested: Iterable[str]) -> str:
    """Return the program that speaks through a party: the folder that a reference lives in, or what is under test."""
    if name in tested:
        return SUBJECT
    if name not in REFERENCES:
        return name
    return REFERENCES[name].__module__.split(".")[2]
