"""`rayproof help TERM`: what a word means that rayproof uses."""

import re

from rayproof import ROOT
from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError

TERMS = ROOT / "reports" / "terms.md"
ENTRY = re.compile(r"^\*\*(.+?)\*\* - (.+)$", re.MULTILINE)


def explain(*term: str) -> int:
    """Say what a word means that rayproof uses, such as edge, end to end, or limit.

    Parameters
    ----------
    term
        The word. Default: list all of them.

    """
    terms = dict(ENTRY.findall(TERMS.read_text(encoding="utf-8")))
    wanted = " ".join(term).strip()
    if not wanted:
        say(", ".join(terms))
        return 0
    known = {name.casefold(): name for name in terms}
    name = known.get(wanted.casefold().replace("_", " ").replace("-", " ")) or known.get(wanted.casefold().rstrip("s"))
    if name is None:
        from difflib import get_close_matches

        near = get_close_matches(wanted.casefold(), known, n=3)
        hint = f"did you mean {', '.join(near)}?" if near else "`rayproof help` lists the words"
        raise UsageError(f"no term is called {wanted!r}; {hint}")
    say(f"{name}: {terms[name].replace('`', '')}")
    return 0
