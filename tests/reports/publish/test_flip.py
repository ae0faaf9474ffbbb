"""FLIP in the browser: its authors' values, properties that it must have, and where it is offered."""

from typing import Any

import numpy as np
import pytest

from tests.reports.publish.golden_flip import PATH, evaluated
from tests.reports.publish.modules import REVIVE, image

# flip_evaluator computes in float32, and the square root at its end turns a rounding of 6e-8 in a feature into 2.5e-4,
# by which an exponent near 1 moves an error below 1.
ROUNDING = 3e-4
CODE = f"""([a, b, range]) => {{ {REVIVE}
    return Array.from(rayproof.flip(revive(a), revive(b), range ?? undefined), String); }}"""


@pytest.fixture(scope="module")
def golden() -> dict[str, np.ndarray]:
    """Return `ours`, `theirs`, `exposures` and the `flip` that the authors' program gave."""
    with np.load(PATH) as kept:
        return dict(kept)


@pytest.fixture(scope="module")
def flip(run: Any) -> Any:
    """Return a function: HDR-FLIP (height, width) of two images by the page's own script."""

    def flip(ours: np.ndarray, theirs: np.ndarray, exposures: Any = None) -> np.ndarray:
        asked = [image(ours), image(theirs), None if exposures is None else [float(one) for one in exposures]]
        return np.array([float(text) for text in run(CODE, asked)]).reshape(ours.shape[:2])

    return flip


def test_the_golden_values_are_those_of_the_authors_program(golden):
    pytest.importorskip(
        "flip_evaluator", reason="flip-evaluator is not installed; the golden values are its own of version 1.7"
    )
    first, last = golden["exposures"]

    found = evaluated(golden["ours"], golden["theirs"], (float(first), float(last)))

    assert np.abs(found - golden["flip"]).max() <= ROUNDING


@pytest.mark.browser
def test_flip_is_that_of_its_authors_program(flip, golden):
    found = flip(golden["ours"], golden["theirs"], golden["exposures"])

    assert golden["flip"].max() > 0.5
    assert np.abs(found - golden["flip"]).max() <= ROUNDING


@pytest.mark.browser
def test_exposures_span_from_the_brightest_pixel_to_the_median_of_what_is_not_black(run, golden):
    theirs = golden["theirs"]
    luminance = theirs.astype(np.float64) @ [0.2126, 0.7152, 0.0722]
    lit = np.sort(luminance[luminance > 0])

    first, last = run(f"(b) => {{ {REVIVE} return rayproof.exposures(revive(b)); }}", image(theirs))

    # The curve maps what it says it maps to 0.85.
    x = 2 ** (first + np.log2(lit[-1]))
    assert 0.36 * x * (2.51 * x + 0.05) / (0.36 * 2.43 * x * x + 0.354 * x + 0.14) == pytest.approx(0.85, abs=1e-9)
    assert first == pytest.approx(golden["exposures"][0], abs=1e-6)
    assert last - first == pytest.approx(np.log2(lit[-1] / lit[len(lit) // 2]))


@pytest.mark.browser
@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_never_looks_alike(flip, golden, odd):
    theirs = golden["theirs"].copy()
    theirs[10, 20, 1] = odd

    found = flip(theirs, theirs)

    assert np.isnan(found[10, 20])
    assert found[29, 0] == 0


@pytest.mark.browser
def test_flip_is_offered_of_light_and_refused_with_the_reason_elsewhere(visit):
    page = visit.open(case="lights/acne", stage="radiance")
    page.wait_for_selector(".pane .frame > canvas")

    page.get_by_label("error", exact=True).select_option("flip")

    page.wait_for_selector("figure:has-text('flip error')")
    assert "HDR-FLIP" in page.locator(".scale").inner_text()
    assert "HDR-FLIP at" in page.locator("figure:has-text('flip error') figcaption").inner_text()
    assert page.locator(".histogram .bin").count() > 0
    page.locator("#tab-normal").click()
    page.wait_for_selector("figure:has-text('FLIP is of light only')")
    option = page.locator("option[value=flip]")
    assert option.inner_text() == "FLIP: of light only"
    assert option.is_disabled()
