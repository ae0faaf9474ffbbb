"""A case in a real browser, from disk: every tab, every mode, every float as in the EXR files."""

import shlex
from typing import Any

import numpy as np
import pytest

from rayproof.cases.stages import Stage, exr_channels
from rayproof.reports.publish.page.case_data import commands_of
from rayproof.reports.results.files import legible
from rayproof.reports.results.images import read_answers
from tests.reports.publish.modules import loaded
from tests.reports.publish.sample import HOSTILE
from tests.reports.publish.visits import Visit

pytestmark = pytest.mark.browser

# What one layer of a pane shows at a pixel, whatever the zoom.
LAYER = """([pane, layer, x, y]) => Array.from(document.querySelectorAll('.pane .frame > canvas')[pane]
    .layers[layer].bitmap.getContext('2d').getImageData(x, y, 1, 1).data.slice(0, 3))"""


def opened(visit: Any, **address: Any) -> Any:
    """Open a case and return the page once images are there."""
    page = visit.open(**address)
    page.wait_for_selector(".pane .frame > canvas")
    return page


def hover(page: Any, column: int, row: int, *, width: int = 40, height: int = 30) -> None:
    """Point at a pixel of the first image."""
    canvas = page.locator(".pane .frame > canvas").first
    box = canvas.bounding_box()
    scale = min(box["width"] / width, box["height"] / height)
    left, top = (box["width"] - width * scale) / 2, (box["height"] - height * scale) / 2
    canvas.hover(position={"x": left + (column + 0.5) * scale, "y": top + (row + 0.5) * scale})
    page.wait_for_selector(f".inspector h3:has-text('column {column}, row {row}')")


def test_a_case_opens_at_the_stage_that_is_blamed_and_goes_back_to_the_filtered_list(visit):
    page = visit.open(verdict="fail")

    page.locator(".cases").get_by_role("link", name="sphere/sheared").click()
    page.wait_for_selector(".pane .frame > canvas")
    assert page.get_by_role("tab", selected=True).inner_text().split()[1] == "normal"
    assert page.locator(".pane .frame > canvas").count() >= 3
    assert "rayproof run sphere/sheared" in page.locator(".case-head .command").inner_text()
    page.keyboard.press("Escape")
    page.wait_for_selector(".cases")
    assert len(visit.names()) == 3


def test_every_stage_opens(visit):
    page = visit.open(case="sphere/plain", stage="camera")

    page.wait_for_selector(".tabs")
    for stage in Stage:
        page.locator(f"#tab-{stage}").click()
        page.wait_for_selector(f"#tab-{stage}[aria-selected=true]")
        # Mitsuba is asked everything but the matrices of the camera.
        expected = 2 if stage is Stage.CAMERA else 4
        page.wait_for_selector(f".checks tbody:has(> tr:not(.derivation):nth-child({2 * expected - 1}))")
        assert page.locator(".checks tbody tr.current").count() == 1
        assert page.locator(".checks tbody tr:not(.derivation)").count() == expected


@pytest.mark.parametrize("reference", ["analytic", "mitsuba_scalar"])
def test_the_inspector_shows_the_floats_of_the_files_bit_for_bit(visit, published, reference):
    page = opened(visit, case="lights/broken", stage="radiance", reference=reference)
    names = ("tracer-float32", "tracer-float64", "analytic", "mitsuba_scalar")
    images = {name: read_answers(published.folder / f"images/lights/broken/{name}.exr") for name in names}

    # A corner, the NaN, the infinity, the middle, the last pixel.
    for column, row in ((0, 0), (3, 2), (5, 4), (20, 15), (39, 29)):
        hover(page, column, row)
        cells = page.evaluate(
            "Array.from(document.querySelectorAll('.inspector td[data-stage]'), (cell) =>"
            " [cell.dataset.renderer, cell.dataset.stage, Number(cell.dataset.channel), cell.textContent])"
        )
        assert len(cells) == 4 * sum(len(exr_channels(stage, lights=2)) for stage in images["analytic"])
        for renderer, stage, channel, text in cells:
            if stage in images[renderer]:
                expected, found = images[renderer][stage][row, column, channel], np.float32(text)
                assert found.tobytes() == expected.tobytes() or (np.isnan(found) and np.isnan(expected))
            else:
                assert text == ""


def test_special_values_have_colours_of_their_own(visit):
    page = opened(visit, case="lights/broken", stage="radiance")

    for pane in (0, 2):
        assert page.evaluate(LAYER, [pane, 0, 3, 2]) == [255, 0, 255]
        assert page.evaluate(LAYER, [pane, 0, 5, 4]) == [0, 255, 255]
    assert page.evaluate(LAYER, [2, 0, 39, 0]) == [12, 12, 16]


def test_the_error_is_that_of_float64_numpy(visit, published):
    page = opened(visit, case="sphere/sheared", stage="normal")
    ours, theirs = (
        read_answers(published.folder / f"images/sphere/sheared/{name}.exr")[Stage.NORMAL].astype(np.float64)
        for name in ("tracer-float32", "analytic")
    )
    difference = np.abs(ours - theirs).max(axis=-1)
    row, column = np.unravel_index(int(difference.argmax()), difference.shape)

    note = page.locator("figure:has-text('absolute error') figcaption").inner_text()

    assert f"at {column}, {row} " in note
    assert f"{np.count_nonzero(difference)} of {difference.size} pixels differ" in note
    assert f"largest error of a channel {difference.max():.3g} " in note.replace("e-0", "e-")


def test_every_metric_and_scale_draws(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")
    seen = set()

    for metric in ("absolute", "signed", "relative", "squared", "ulp", "ssim"):  # FLIP is of light only
        page.get_by_label("error", exact=True).select_option(metric)
        page.wait_for_selector(f"figure:has-text('{'1 − SSIM' if metric == 'ssim' else metric} error')")
        for scale in ("linear", "log"):
            page.get_by_label("log scale").set_checked(scale == "log")
            seen.add(tuple(page.evaluate(LAYER, [2, 0, 19, 14]) + page.evaluate(LAYER, [2, 0, 15, 12])))
            assert page.locator(".histogram rect").count() > 0
    assert len(seen) >= 5


def test_the_limit_is_marked_and_the_range_can_be_chosen(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")
    assert page.locator(".histogram .limit").count() == 1
    assert page.locator(".limit-mark").count() == 1
    assert "pixels beyond 5.30e-7, the limit of the deciding pixel" in page.locator(".histogram").inner_text()
    before = page.evaluate(LAYER, [2, 0, 20, 15])

    page.get_by_label("high end of the range").fill("1")
    page.get_by_label("high end of the range").press("Enter")

    page.wait_for_selector(".scale input[aria-label^=high]")
    assert "high=1" in page.url
    assert page.evaluate(LAYER, [2, 0, 20, 15]) != before
    page.get_by_role("button", name="to limit").click()
    assert page.get_by_label("high end of the range").input_value() == "5.30e-7"
    page.get_by_role("button", name="auto").click()
    assert page.evaluate(LAYER, [2, 0, 20, 15]) == before
    page.get_by_label("error", exact=True).select_option("ulp")
    assert page.locator(".histogram .limit").count() == 0


def test_exposure_tone_colours_channel_reference_and_configuration_can_be_chosen(visit):
    page = opened(visit, case="lights/broken", stage="radiance")

    def lit() -> list[int]:
        return page.evaluate(LAYER, [0, 0, 21, 20])

    seen = [lit()]
    page.get_by_label("exposure", exact=True).fill("2")
    seen.append(lit())
    page.get_by_label("tone").select_option("2.2")
    seen.append(lit())
    page.get_by_label("colours", exact=True).select_option("cividis")
    seen.append(lit())
    page.get_by_label("channel").select_option("2")
    seen.append(lit())
    assert len(set(map(tuple, seen))) == 5
    page.get_by_label("ours", exact=True).select_option("tracer-float64")
    page.get_by_label("reference", exact=True).select_option("mitsuba_scalar")
    page.wait_for_selector(".checks tr.current:has-text('float64'):has-text('mitsuba_scalar')")
    assert "ours=tracer-float64" in page.url


def test_modes_show_one_image_over_the_other(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")
    ours, theirs = (page.evaluate(LAYER, [pane, 0, 20, 15]) for pane in (0, 1))
    assert ours != theirs

    page.get_by_role("radio", name="swipe").click()
    page.get_by_label("share of ours").fill("0.25")
    page.wait_for_timeout(50)
    parts = "() => document.querySelector('.frame > canvas').layers.map(({from = 0, to = 1}) => [from, to])"
    assert page.evaluate(parts) == [[0, 0.25], [0.25, 1]]
    assert [page.evaluate(LAYER, [0, layer, 20, 15]) for layer in (0, 1)] == [ours, theirs]

    page.get_by_role("radio", name="onion skin").click()
    page.wait_for_selector("text=onion skin")
    assert [page.evaluate(LAYER, [0, layer, 20, 15]) for layer in (0, 1)] == [theirs, ours]

    page.get_by_role("radio", name="flicker").click()
    page.wait_for_selector("button:has-text('pause')")
    page.locator("h1").click()
    page.keyboard.press(" ")
    page.wait_for_timeout(50)
    first = page.evaluate(LAYER, [0, 0, 20, 15])
    page.keyboard.press(" ")
    page.wait_for_timeout(50)
    assert {tuple(first), tuple(page.evaluate(LAYER, [0, 0, 20, 15]))} == {tuple(ours), tuple(theirs)}

    page.get_by_role("radio", name="error only").click()
    assert page.locator(".pane").count() == 1
    assert "mode=error" in page.url


def test_zoom_is_shared_and_numbers_are_drawn_into_pixels(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")
    hover(page, 20, 15)
    page.mouse.down()
    page.mouse.up()
    page.wait_for_timeout(100)
    drawn = "Array.from(document.querySelectorAll('.pane .frame > canvas'), (canvas) => canvas.toDataURL())"
    fitted = page.evaluate(drawn)

    page.keyboard.press("n")

    page.wait_for_timeout(100)
    near = page.evaluate(drawn)
    assert all(a != b for a, b in zip(fitted, near, strict=True))
    # White digits in a pane whose pixels have no white.
    white = """() => { const canvas = document.querySelector('.pane .frame > canvas');
        const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
        let count = 0;
        for (let i = 0; i < data.length; i += 4) count += Math.min(data[i], data[i + 1], data[i + 2]) > 250;
        return count; }"""
    assert page.evaluate(white) > 200
    page.wait_for_url("**zoom=**")
    page.keyboard.press("0")
    page.wait_for_timeout(100)
    assert page.evaluate(drawn) == fitted


def test_wheel_drag_and_the_page_still_scrolls(visit):
    page = opened(visit, case="sphere/plain", stage="normal")
    canvas = page.locator(".pane .frame > canvas").first
    picture = "() => document.querySelector('.pane .frame > canvas').toDataURL()"
    canvas.hover()
    before = page.evaluate(picture)
    page.mouse.wheel(0, 200)
    page.wait_for_timeout(100)
    assert page.evaluate("window.scrollY") > 0

    page.evaluate("window.scrollTo(0, 0)")
    canvas.click(position={"x": 60, "y": 60})
    page.mouse.wheel(0, -600)
    page.wait_for_timeout(100)
    zoomed = page.evaluate(picture)
    assert page.evaluate("window.scrollY") == 0
    assert zoomed != before
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 140, box["y"] + 120, steps=3)
    page.mouse.up()
    page.wait_for_timeout(100)
    assert page.evaluate(picture) != zoomed


def test_explained_pixels_are_an_overlay_and_the_inspector_names_them(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")
    assert "explained by rounding 17" in page.locator(".explained-control").inner_text()

    page.keyboard.press("b")

    page.wait_for_selector(".explained-control input:checked")
    assert page.evaluate(LAYER, [1, 1, 20, 10]) == [230, 159, 0]
    hover(page, 20, 10)
    assert "explained by rounding" in page.locator(".kinds").inner_text()


def test_explained_pixels_of_one_configuration_are_not_shown_over_anothers_images(visit):
    page = opened(visit, case="sphere/sheared", stage="normal", ours="tracer-float64", explained="1")

    assert page.evaluate("rayproof.address().ours") == "tracer-float64"
    assert page.locator(".explained-control").count() == 0
    hover(page, 20, 10)
    assert page.locator(".kinds").inner_text() == ""


def test_limits_show_their_derivation_and_closed_forms_and_unsupported_are_listed(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")

    page.get_by_role("button", name="details").first.click()

    derivation = page.locator(".derivation:visible")
    assert "gamma(9) of float32" in derivation.inner_text()
    assert "relative mse" in derivation.inner_text()
    assert "E = I h / d^3" in page.get_by_role("region", name="Closed forms").inner_text()
    assert "has no such matrices" in page.get_by_role("region", name="Unsupported").inner_text()


def test_everybody_is_shown_against_everybody_and_who_stands_alone(visit):
    page = opened(visit, case="sphere/sheared", stage="normal")

    panel = page.get_by_role("region", name="Everybody against everybody")

    assert "float32 stands alone against <three> others." in panel.inner_text()
    assert panel.locator("tr.alone").inner_text().split()[0] == "float32"
    assert panel.locator("td.over").count() == 6


def test_the_keyboard_moves_the_pixel_and_the_tabs(visit):
    page = opened(visit, case="sphere/plain", stage="normal")

    page.locator(".pane .frame > canvas").first.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown", "Shift+ArrowRight"):
        page.keyboard.press(key)
    page.wait_for_selector(".inspector h3:has-text('column 30, row 15')")
    page.get_by_role("tab", selected=True).focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("#tab-visibility[aria-selected=true]:focus")
    page.keyboard.press("]")
    page.wait_for_selector("#tab-irradiance[aria-selected=true]")
    page.keyboard.press("r")
    page.wait_for_selector(".checks tr.current:has-text('mitsuba_scalar')")
    page.keyboard.press("x")
    page.wait_for_selector("figure:has-text('signed error')")
    page.keyboard.press("k")
    page.wait_for_selector("h1:not(:has-text('sphere/plain'))")


def test_the_keys_are_listed_under_a_question_mark(visit):
    page = opened(visit, case="sphere/plain", stage="normal")

    page.keyboard.press("?")

    text = page.locator("dialog.help").inner_text()
    assert "side by side" in text
    assert "copy the command that reproduces this pixel" in text
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    assert page.locator(".case").count() == 1


def test_a_link_shows_the_same_case_stage_mode_and_pixel_again(visit):
    page = opened(visit, case="lights/broken", stage="irradiance", mode="swipe", metric="ulp", at="7,9", explained="1")

    page.wait_for_selector(".inspector h3:has-text('column 7, row 9')")
    assert page.locator("[data-mode=swipe]").get_attribute("aria-checked") == "true"
    assert page.get_by_label("error", exact=True).input_value() == "ulp"
    assert page.locator(".inspector code").inner_text() == "rayproof probe lights/broken 7 9"
    page.keyboard.press("Escape")
    hover(page, 9, 9)
    page.wait_for_url("**at=9%2C9**")


@pytest.mark.parametrize("width", [1280, 390])
def test_the_worst_pixel_is_that_of_the_check_and_ours_come_first(browser, published, width):
    visit = Visit(browser, published.folder, viewport={"width": width, "height": 844})
    page = opened(visit, case="sphere/sheared", stage="normal")

    assert page.locator(".pane figcaption strong").all_inner_texts() == ["ours", "reference", "absolute error"]
    assert page.locator(".inspector h3").inner_text().endswith("column 18, row 14")
    assert page.locator(".checks tr.current").get_by_role("button", name="18, 14").count() == 1
    assert "`" not in page.locator("main").inner_text()
    visit.end()


@pytest.mark.parametrize(
    ("reproduce", "ours", "probe"),
    [
        ("/opt/x/bin/rayproof run sphere/plain", "tracer-float64", "rayproof probe sphere/plain 3 4"),
        ("rayproof run sphere/plain", "tracer-float32/sphere=textbook",
         "rayproof probe sphere/plain 3 4 --configuration float32/sphere=textbook"),
        ("./rayproof run sphere/plain --subject 'exec:a b {scene}' --env KEY --timeout 9", "exec",
         "./rayproof probe sphere/plain 3 4 --subject 'exec:a b {scene}' --env KEY"),
        ("rayproof run '/tmp/o u/scenes/a.json' --subject radiance", "radiance",
         "rayproof probe 'o u/scenes/sphere/plain.json' 3 4 --subject radiance"),
        ("rayproof run ../out/scenes/a.json", "tracer-float32",
         "rayproof probe ../out/scenes/sphere/plain.json 3 4"),
    ],
)  # fmt: skip
def test_the_command_of_a_pixel_names_configuration_subject_and_scene(browser, reproduce, ours, probe):
    record = {"name": "sphere/plain", "reproduce": reproduce, "scene": "scenes/sphere/plain.json"}
    run, parts = commands_of(record)
    page = loaded(browser)

    assert page.evaluate("([probe, ours]) => rayproof.probeCommand({ probe }, 3, 4, ours)", [parts, ours]) == probe
    assert not any(word.startswith("/") for word in shlex.split(run))
    assert page.evaluate("rayproof.prose('by `a b` and ` c').map((one) => one.outerHTML ?? one).join('')") == (
        "by <code><span>a</span> <span>b</span></code> and ` c"
    )
    page.close()


@pytest.mark.parametrize(
    "address", [{"at": "999999,3"}, {"at": "x"}, {"metric": "<b>", "mode": "y", "channel": "77", "exposure": "nan"}]
)
def test_an_address_that_makes_no_sense_shows_the_case(visit, address):
    page = opened(visit, case="lights/broken", stage="radiance", **address)

    assert page.locator(".pane .frame > canvas").count() == 3


def test_a_subject_of_any_name_is_ours(browser, tmp_path):
    import json

    from rayproof.reports.publish import publish_all
    from tests.reports.publish.sample import make_folder
    from tests.reports.publish.visits import Visit

    make_folder(tmp_path)
    text = (tmp_path / "results.json").read_text()
    text = text.replace('"configuration":"float32"', '"configuration":"exec"').replace(
        '"renderer":"tracer-float32"', '"renderer":"exec"'
    )
    (tmp_path / "results.json").write_text(text)
    assert json.loads(text)["cases"]
    publish_all(tmp_path)
    visit = Visit(browser, tmp_path)

    page = opened(visit, case="sphere/sheared", stage="normal", ours="exec")

    assert page.get_by_label("ours", exact=True).input_value() == "exec"
    assert "exec" in page.locator(".checks tr.current").first.inner_text().split()
    visit.end()


def test_a_hostile_name_is_text_everywhere(visit):
    page = visit.open(q="evil")

    page.locator(".cases tbody a").click()
    page.wait_for_selector(".pane .frame > canvas")

    assert legible(HOSTILE) in page.locator("h1").inner_text()
    assert page.locator("img[src=x]").count() == 0
    assert page.locator("body script").count() == 2
    hover(page, 3, 3)
    assert page.locator(".inspector code").inner_text().startswith("rayproof probe 'evil/<script>")


def test_cases_without_images_say_so(visit):
    page = visit.open(case="mesh/crash")

    assert "worker ended with signal 6" in page.locator(".case-head").inner_text()
    assert "Nothing was measured" in page.locator(".case").inner_text()


def test_an_unknown_case_is_said_in_a_line(visit):
    page = visit.open(case="no/such")

    assert page.locator(".shout").inner_text() == "There is no case called no/such."
