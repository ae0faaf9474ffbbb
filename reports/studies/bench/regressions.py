"""Is today slower than an earlier benchmark: by Mitsuba's minimal kernel as common yardstick, beside an A/A control.

Milliseconds of two days are not comparable, but the ratio of two programs that ran in turns is. A scene counts as
slower if the intervals of its ratio to the minimal kernel do not overlap and the change exceeds what the control, the
same code against itself, shows today.
"""

from typing import Any


def compared(old: dict[str, Any], new: dict[str, Any]) -> list[dict[str, Any]]:
    """Return each scene that both have: how the time changed, and a verdict: slower, faster, or no difference shown."""
    before = {_key(entry): entry for entry in old.get("scenes", [])}
    found = []
    for entry in new["scenes"]:
        earlier = before.get(_key(entry))
        if earlier is None or not entry.get("ratio_minimal") or not earlier.get("ratio_minimal"):
            continue
        change = earlier["ratio_minimal"] / entry["ratio_minimal"]
        (old_low, old_high), (low, high) = earlier["ratio_minimal_interval"], entry["ratio_minimal_interval"]
        noise = max(abs(bound - 1) for bound in entry["control_interval"]) if entry.get("control_interval") else 0.0
        verdict = "no difference shown"
        if high < old_low and change > 1 + noise:
            verdict = "slower"
        elif low > old_high and change < 1 / (1 + noise):
            verdict = "faster"
        found.append(
            {
                "name": entry["name"],
                "width": entry["width"],
                "height": entry["height"],
                "change": change,
                "interval": [old_low / high, old_high / low],
                "control_interval": entry.get("control_interval"),
                "verdict": verdict,
            }
        )
    return found


def _key(entry: dict[str, Any]) -> tuple[Any, ...]:
    return entry.get("name"), entry.get("width"), entry.get("height")
