"""From findings to a word and a sentence: better, worse, a trade, no difference shown."""

from collections.abc import Sequence

from reports.compare.findings import LEAST_DIGITS, Finding
from reports.compare.statistics import Interval

BETTER, WORSE, TRADE, NOTHING = "better", "worse", "a trade", "no difference shown"
MOST_NAMED = 4  # families in the sentence; the table has all


def accuracy(finding: Finding, *, alpha: float) -> int:
    """Return 1 where the candidate surely errs less, -1 where it errs more, 0 where neither is shown or both are.

    Wrong decisions come first: a formula that misses what it should hit does not make up for it in digits.
    """
    if finding.p < alpha:
        return 1 if finding.only_base > finding.only_candidate else -1
    if finding.digits is None or finding.digits_interval is None or abs(finding.digits) < LEAST_DIGITS:
        return 0
    low, high = finding.digits_interval
    return 1 if low > 0 else -1 if high < 0 else 0


def speed(interval: Interval, control: Interval) -> int:
    """Return 1 if the candidate is surely faster, -1 if slower; 0 within what the A/A control shows of nothing."""
    if interval[0] > max(1.0, control[1]):
        return -1
    return 1 if interval[1] < min(1.0, control[0]) else 0


def outcome(accuracies: Sequence[int], fast: int) -> str:
    """Return the word for all families together."""
    signs = {sign for sign in (*accuracies, fast) if sign}
    if len(signs) > 1:
        return TRADE
    return {1: BETTER, -1: WORSE}[signs.pop()] if signs else NOTHING


def sentence(
    base: str,
    candidate: str,
    findings: Sequence[Finding],
    accuracies: Sequence[int],
    *,
    time_ratio: float,
    time_interval: Interval,
    control_interval: Interval,
) -> str:
    """Return the verdict: who errs less, by how many digits, on which families, at what time ratio."""
    fast = speed(time_interval, control_interval)
    word = outcome(accuracies, fast)
    parts = []
    for wanted, how in ((1, "less"), (-1, "more")):
        chosen = [one for one, sign in zip(findings, accuracies, strict=True) if sign == wanted]
        if chosen:
            parts.append(f"{candidate} errs {how} than {base} on {_named(chosen, wanted)}")
    if not parts:
        parts = [f"no difference in error shown between {base} and {candidate} on {len(findings)} families"]
    ratio = f"{time_ratio:.3f} [{time_interval[0]:.3f}, {time_interval[1]:.3f}]"
    beside = f"A/A [{control_interval[0]:.3f}, {control_interval[1]:.3f}]"
    pace = {1: "it is faster", -1: "it is slower", 0: "no difference in run time shown"}[fast]
    opening = {BETTER: "Better", WORSE: "Worse", TRADE: "A trade", NOTHING: "No difference shown"}[word]
    return f"{opening}: {'; '.join(parts)}; {pace}, time ratio {ratio} ({beside})."


def _named(findings: Sequence[Finding], sign: int) -> str:
    """Return the families, those with the largest difference first, with digits and wrong decisions."""
    ordered = sorted(findings, key=lambda one: -sign * (one.digits or 0.0))
    said = ", ".join(_said(one) for one in ordered[:MOST_NAMED])
    return said + (f" and {len(ordered) - MOST_NAMED} more" if len(ordered) > MOST_NAMED else "")


def _said(one: Finding) -> str:
    facts = []
    if one.digits is not None and one.digits_interval is not None:
        low, high = one.digits_interval
        facts.append(f"{one.digits:+.2f} digits [{low:.2f}, {high:.2f}]")
    if one.only_base or one.only_candidate:
        facts.append(f"wrong pixels {one.only_base + one.both_wrong} -> {one.only_candidate + one.both_wrong}")
    return f"{one.family} ({', '.join(facts)})"
