"""Pictures of a report for a README: its front page, a case, its scene in 3-D, and a page of plots."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rayproof.reports.publish.browser.chromium import address, chromium
from rayproof.reports.publish.page.case_data import has_view
from rayproof.reports.results.atomic import replacing
from rayproof.reports.results.headline import worst_first
from rayproof.reports.results.records import CaseRecord, RunRecord

SIZE = {"width": 1280, "height": 940}  # CSS px
NARROW = {"width": 1080, "height": 940}  # of the scene, which needs no room beside it
PALETTES = (256, 128, 64, 32)
MOST_BYTES = 150_000
SETTLE = 600  # ms for images that are painted in the frame after they are there


def take_pictures(folder: Path, results: RunRecord, out: Path, *, case: str | None = None) -> list[Path]:
    """Write PNG files of the published report in `folder` into `out` and return their paths.

    `case` is the one to show; the worst with a view otherwise.

    Raises:
        LookupError: there is no browser, or no such case.

    """
    chosen = _case(folder, results, case)
    pages: list[tuple[str, dict[str, str], Callable[[Any], Any]]] = [("front", {}, _front)]
    if chosen is not None:
        shown = {"case": chosen["name"], "stage": chosen.get("stage") or "radiance"}
        pages.append(("case", shown, lambda page: page.wait_for_selector(".pane .frame > canvas")))
        if has_view(folder, chosen):
            pages.append(("scene", shown, _scene))
    if plotted := [name for name in ("history", "stability", "tradeoff") if _has(folder, results, name)]:
        pages.append((plotted[0], {"page": plotted[0]}, _plots))
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
        found = next((case for case in cases if case["name"] == name), None)
        if found is None:
            raise LookupError(f"{folder} has no case called {name}")
        return found
    measured = [case for case in cases if case.get("checks")]
    return next((case for case in measured if has_view(folder, case)), next(iter(measured), None))


def _has(folder: Path, results: RunRecord, name: str) -> bool:
    return name in results if name == "history" else any((folder / place).exists() for place in (name, f"{name}.json"))


def _front(page: Any) -> None:
    page.wait_for_selector(".cases tbody")


def _scene(page: Any) -> Any:
    page.locator(".open3d").click()
    page.wait_for_selector("iframe[data-drawn]")
    figure = page.locator("figure.scene")
    figure.scroll_into_view_if_needed()
    return figure


def _plots(page: Any) -> None:
    page.wait_for_selector(".plot[data-drawn], .series, .kills")


def _small(shot: bytes, path: Path) -> Path:
    """Write a picture and return its path: as it is where that is small, else with as many colours as make it small.

    A palette makes facets out of what is smooth, so it comes last.
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
