"""Is today slower than an earlier benchmark: by Mitsuba's minimal kernel as common yardstick, beside an A/A control.

Milliseconds of two days are not comparable, but the ratio of two programs that ran in turns is. A scene counts as
slower if the intervals of its ratio to the minimal kernel do not overlap and the change exceeds what the control, the
same code against itself, shows today.
"""

from rayproof.reports.studies.bench.records import BenchRecord, ChangeRecord, SceneRecord


def compared(old: BenchRecord, new: BenchRecord) -> list[ChangeRecord]:
    """Return each scene that both have: how the time changed, and a verdict: slower, faster, or no difference shown."""
    before = {_key(entry): entry for entry in old.get("scenes", [])}
    found = []
    for entry in new["scenes"]:
        earlier = before.get(_key(entry))
        if earlier is None:
            continue
        then, now = earlier.get("ratio_minimal"), entry.get("ratio_minimal")
        bounds_then, bounds_now = earlier.get("ratio_minimal_interval"), entry.get("ratio_minimal_interval")
        if not then or not now or not bounds_then or not bounds_now:
            continue
        change = then / now
        (old_low, old_high), (low, high) = bounds_then, bounds_now
        control = entry.get("control_interval")
        noise = max(abs(bound - 1) for bound in control) if control else 0.0
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
                "control_interval": control,
                "verdict": verdict,
            }
        )
    return found


def _key(entry: SceneRecord) -> tuple[str | None, int | None, int | None]:
    return entry.get("name"), entry.get("width"), entry.get("height")
