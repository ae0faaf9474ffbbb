"""How large a report is and how long it takes: to open, to switch an image, to open a scene in 3-D, in Chromium."""

from pathlib import Path
from statistics import median
from typing import Any

from rayproof.reports.publish.browser.chromium import address, chromium
from rayproof.reports.publish.page.case_data import has_view
from rayproof.reports.publish.page.front_data import SHARD, data_file
from rayproof.reports.publish.page.single_file import NAME, write_single_file
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.records import CaseRecord, RunRecord

TIMES = 5  # each; the first pays for a cold browser, the median is told
STAGES = ("normal", "irradiance", "position", "radiance", "ray")
OPENED = (".html", ".js", ".png")

# Until the stage that is asked for is on the screen: two frames after the page says so.
_SWITCH = """async (name) => {
  const start = performance.now(), tab = () => document.getElementById(`tab-${name}`);
  tab().click();
  while (tab().getAttribute("aria-selected") !== "true") await new Promise((go) => setTimeout(go, 0));
  await new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)));
  return performance.now() - start;
}"""
_FIRST = "performance.getEntriesByName('first-contentful-paint').map((entry) => entry.startTime)[0]"


def figures(folder: Path, results: RunRecord) -> list[list[str]]:
    """Return rows of what was measured, of the folder, and of the single file, which is written for it.

    Raises:
        LookupError: there is no browser.

    """
    ordered = worst_first(results["cases"])
    long = len(ordered) > SHARD
    written = [
        case for place, case in enumerate(ordered[:SHARD], 1) if (folder / data_file(place, long=long)).is_file()
    ]
    measured = [case for case in written if case.get("checks")]
    viewed = next((case for case in measured if has_view(folder, case)), None)
    pages = [folder / "index.html", *([] if long else [write_single_file(folder, results)])]
    with chromium() as browser:
        sides = [_measured(browser, page, measured[0] if measured else None, viewed) for page in pages]
    opened, whole = sizes(folder)
    rows = [
        [
            f"the report of {len(ordered)} cases",
            _megabytes(opened),
            *(_megabytes(one.stat().st_size) for one in pages[1:]),
        ],
        ["index.html", _megabytes(pages[0].stat().st_size), "-"],
        ["all that is in the folder", _megabytes(whole), "-"],
    ]
    if long:  # whose single file would be too large to be of use
        sides.append({})
        rows[0].append("-")
    for name in ("first page", "a case", "another image", "3-D"):
        rows.append([name, *("-" if side.get(name) is None else f"{side[name]:.0f} ms" for side in sides)])
    return rows


def sizes(folder: Path) -> tuple[int, int]:
    """Return how many bytes the page and what it opens take, and the whole folder; the single file is none of it."""
    files = [path for path in folder.rglob("*") if path.is_file() and path != folder / NAME]
    opened = [path for path in files if path.suffix in OPENED]
    return sum(path.stat().st_size for path in opened), sum(path.stat().st_size for path in files)


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _measured(browser: Any, page: Path, case: CaseRecord | None, viewed: CaseRecord | None) -> dict[str, float]:
    """Return medians of times in ms."""
    context = browser.new_context(viewport={"width": 1366, "height": 768})
    tab = context.new_page()
    first = []
    for _ in range(TIMES):
        tab.goto("about:blank")
        tab.goto(address(page))
        tab.wait_for_selector(".cases tbody")
        first.append(tab.evaluate(_FIRST))
    found = {"first page": median(filter(None, first))}
    if case is not None:
        found |= _of_a_case(tab, page, case)
    if viewed is not None:
        found["3-D"] = _in_3d(tab, page, viewed)
    context.close()
    return found


def _of_a_case(tab: Any, page: Path, case: CaseRecord) -> dict[str, float]:
    opened = []
    for _ in range(TIMES):
        tab.goto("about:blank")
        tab.goto(address(page, case=case["name"], stage="radiance"))
        tab.wait_for_selector(".pane .frame > canvas")
        opened.append(tab.evaluate("performance.now()"))
    present = [name for name in STAGES if tab.locator(f"#tab-{name}").count()]
    switched = [tab.evaluate(_SWITCH, name) for name in (*present, *present)]
    return {"a case": median(opened), "another image": median(switched)}


def _in_3d(tab: Any, page: Path, case: CaseRecord) -> float:
    tab.goto("about:blank")
    tab.goto(address(page, case=case["name"]))
    took = []
    for _ in range(TIMES):
        tab.locator(".open3d").click()
        tab.wait_for_selector("iframe[data-drawn]")
        took.append(float(tab.locator("iframe").get_attribute("data-drawn")))
        tab.get_by_role("button", name="close 3-D").click()
    return median(took)
