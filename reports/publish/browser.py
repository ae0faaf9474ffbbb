"""The report in Chromium, controlled by Playwright: pictures for the documents, size, and loading times.

Chromium and Playwright are installed only for development.
"""

import io
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import urlencode

from rayproof.reports.publish.page.case_data import has_view
from rayproof.reports.publish.page.front import SHARD, data_file
from rayproof.reports.publish.page.page import NAME, WORST
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.files import replacing
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.records import RunRecord

NAMES = ("chromium", "chromium-browser", "google-chrome")


def missing() -> str | None:
    """Return a sentence on the missing program, Playwright or Chromium, or None if both are installed."""
    if find_spec("playwright") is None:
        return "Playwright is not installed: pip install playwright"
    return None if _found() else "Chromium is not installed; on Debian: apt-get install chromium"


@contextmanager
def chromium() -> Iterator[Any]:
    """Start a headless Chromium, and close it after the body.

    Raises:
        LookupError: Chromium or Playwright is not installed.

    """
    if (why := missing()) is not None:
        raise LookupError(why)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=_found())
        try:
            yield browser
        finally:
            browser.close()


def _found() -> str | None:
    return next(filter(None, map(shutil.which, NAMES)), None)


def address(page: Path, /, **parts: str) -> str:
    """Return the address of a view of the report."""
    return f"{page.resolve().as_uri()}#{urlencode(parts)}"


TIMES = 5  # repetitions of each measurement; the median is reported, since the first has a cold browser
STAGES = ("normal", "irradiance", "position", "radiance", "ray")
OPENED = (".html", ".js", ".png")

# Milliseconds from a click on a stage's tab to its image: two frames after the tab is selected.
_SWITCH = """async (name) => {
  const start = performance.now(), tab = () => document.getElementById(`tab-${name}`);
  tab().click();
  while (tab().getAttribute("aria-selected") !== "true") await new Promise((go) => setTimeout(go, 0));
  await new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)));
  return performance.now() - start;
}"""
_FIRST = "performance.getEntriesByName('first-contentful-paint').map((entry) => entry.startTime)[0]"


def figures(folder: Path, results: RunRecord) -> list[list[str]]:
    """Return rows of title, measurement of the report's folder, and measurement of the single file in it.

    Raises:
        LookupError: there is no browser.

    """
    ordered = worst_first(results["cases"])
    long = len(ordered) > SHARD
    written = [
        case for place, case in enumerate(ordered[:SHARD], 1) if (folder / data_file(place, long=long)).is_file()
    ]
    measured = [case for case in written if case.get("checks")]
    viewed = next((case for case in measured[:WORST] if has_view(folder, case)), None)  # also in the single file
    pages = [folder / "index.html", folder / NAME]
    with chromium() as browser:
        sides = [_measured(browser, page, measured[0] if measured else None, viewed) for page in pages]
    opened, whole = sizes(folder)
    rows = [
        [
            f"the report of {len(ordered)} cases",
            _megabytes(opened),
            _megabytes(pages[1].stat().st_size),
        ],
        ["index.html", _megabytes(pages[0].stat().st_size), "-"],
        ["all that is in the folder", _megabytes(whole), "-"],
    ]
    for name in ("first page", "a case", "another image", "3-D"):
        rows.append([name, *("-" if side.get(name) is None else f"{side[name]:.0f} ms" for side in sides)])
    return rows


def sizes(folder: Path) -> tuple[int, int]:
    """Return the bytes of the page with the files that it loads, and of the whole folder, without the single file."""
    files = [path for path in folder.rglob("*") if path.is_file() and path != folder / NAME]
    opened = [path for path in files if path.suffix in OPENED]
    return sum(path.stat().st_size for path in opened), sum(path.stat().st_size for path in files)


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _measured(browser: Any, page: Path, case: CaseRecord | None, viewed: CaseRecord | None) -> dict[str, float]:
    """Return the median times [ms] by title."""
    context = browser.new_context(viewport={"width": 1366, "height": 768})
    tab = context.new_page()
    first = []
    for _ in range(TIMES):
        tab.goto("about:blank")
        tab.goto(address(page))
        tab.wait_for_selector(".cases tbody")
        first.append(tab.evaluate(_FIRST))
    medians = {"first page": median(filter(None, first))}
    if case is not None:
        medians |= _of_a_case(tab, page, case)
    if viewed is not None:
        medians["3-D"] = _in_3d(tab, page, viewed)
    context.close()
    return medians


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


SIZE = {"width": 1280, "height": 940}  # CSS px
NARROW = {"width": 1080, "height": 940}  # for the picture of the scene, which needs no space at its sides
PALETTES = (256, 128, 64, 32)  # numbers of colours of a picture, tried in this order
MOST_BYTES = 150_000  # of a picture, since pictures are stored in the repository
SETTLE = 600  # ms for images that are painted one frame after they are loaded


def take_pictures(folder: Path, results: RunRecord, out: Path, *, case: str | None = None) -> list[Path]:
    """Write PNG files of the published report in `folder` into `out` and return their paths.

    `case` is the name of the case to show, by default the worst case with a 3-D view.

    Raises:
        LookupError: there is no browser, or no such case.

    """
    chosen = _case(folder, results, case)
    pages: list[tuple[str, dict[str, str], Callable[[Any], Any]]] = [
        ("front", {}, lambda page: page.wait_for_selector(".cases tbody"))
    ]
    if chosen is not None:
        shown = {"case": chosen["name"], "stage": chosen.get("stage") or "radiance"}
        pages.append(("case", shown, lambda page: page.wait_for_selector(".pane .frame > canvas")))
        if has_view(folder, chosen):
            pages.append(("scene", shown, _scene))
    if plotted := [name for name in ("history", "stability", "tradeoff") if _has(folder, results, name)]:
        drawn = ".plot[data-drawn], .series, .kills"
        pages.append((plotted[0], {"page": plotted[0]}, lambda page: page.wait_for_selector(drawn)))
    written = []
    with chromium() as browser:
        for name, parts, ready in pages:
            context = browser.new_context(viewport=NARROW if name == "scene" else SIZE, color_scheme="light")
            page = context.new_page()
            page.goto(address(folder / "index.html", **parts))
            page.wait_for_selector("main")
            part = ready(page)
            page.wait_for_timeout(SETTLE)
            shot = part.screenshot() if name == "scene" else page.screenshot()
            context.close()
            written.append(_small(shot, out / f"{name}.png"))
    return written


def _case(folder: Path, results: RunRecord, name: str | None) -> CaseRecord | None:
    cases = worst_first(results["cases"])
    if name is not None:
        chosen = next((case for case in cases if case["name"] == name), None)
        if chosen is None:
            raise LookupError(f"{folder} has no case called {name}")
        return chosen
    measured = [case for case in cases if case.get("checks")]
    return next((case for case in measured if has_view(folder, case)), next(iter(measured), None))


def _has(folder: Path, results: RunRecord, name: str) -> bool:
    return name in results if name == "history" else any((folder / place).exists() for place in (name, f"{name}.json"))


def _scene(page: Any) -> Any:
    page.locator(".open3d").click()
    page.wait_for_selector("iframe[data-drawn]")
    figure = page.locator("figure.scene")
    figure.scroll_into_view_if_needed()
    return figure


def _small(shot: bytes, path: Path) -> Path:
    """Write a picture of at most about `MOST_BYTES` and return its path.

    The number of colours is reduced only if the file would be larger, because a palette shows steps in smooth shades.
    """
    from PIL import Image

    picture = Image.open(io.BytesIO(shot)).convert("RGB")
    packed = _png(picture)
    for colors in PALETTES:
        if len(packed) > MOST_BYTES:
            packed = _png(picture.quantize(colors))
    with replacing(path) as draft:
        draft.write_bytes(packed)
    return path


def _png(picture: Any) -> bytes:
    packed = io.BytesIO()
    picture.save(packed, "PNG", optimize=True)
    return packed.getvalue()
