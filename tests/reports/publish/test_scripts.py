"""The page's JavaScript module by module, in a browser: each against NumPy, scikit-image or a property it must have."""

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from skimage.metrics import structural_similarity

from rayproof.reports.judge.metrics import METRICS
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.compact import compact_case
from rayproof.reports.results.files import as_json
from rayproof.reports.results.images import read_pixels, write_pixels
from tests.reports.publish.modules import REVIVE, image
from tests.reports.publish.sample import SCENE, answers

pytestmark = pytest.mark.browser

# What the page reads of a measurement, a default or not.
READ = {
    "worst_ratio",
    "worst_error",
    "limit",
    "pixel",
    "interior",
    "wrong",
    "explained",
    "nan",
    "inf",
}


@pytest.fixture
def pair() -> tuple[np.ndarray, np.ndarray]:
    """Return two float32 images (12, 16, 3) a few roundings apart, with special values."""
    random = np.random.default_rng(5)
    theirs = random.uniform(-2, 2, (12, 16, 3)).astype(np.float32)
    ours = (theirs * (1 + 3e-7 * random.normal(size=theirs.shape))).astype(np.float32)
    ours[0, 0, 1], ours[0, 1, 0], theirs[0, 2, 2] = np.nan, np.inf, -np.inf
    ours[0, 3, 0] = theirs[0, 3, 0] = np.inf
    ours[0, 4], theirs[0, 4] = -0.0, 0.0
    return ours, theirs


def test_metrics_are_those_of_numpy(run, pair):
    ours, theirs = pair
    a, b = (one[1:].astype(np.float64) for one in pair)
    bits = [one[1:].view(np.int32).astype(np.int64) for one in pair]
    places = [np.where(one < 0, -(one & 0x7FFFFFFF), one) for one in bits]
    expected = {
        "absolute": np.abs(a - b),
        "signed": a - b,
        "relative": np.abs(a - b) / np.maximum(np.abs(a), np.abs(b)),
        "squared": (a - b) ** 2,
        "ulp": np.abs(places[0] - places[1]),
    }
    code = f"""([metric, a, b]) => {{ {REVIVE}
        return Array.from(rayproof.errors(metric, revive(a), revive(b), -1).values, String); }}"""

    for metric, values in expected.items():
        found = np.array([float(v) for v in run(code, [metric, image(ours), image(theirs)])]).reshape(12, 16)
        worst = np.take_along_axis(values, np.abs(values).argmax(axis=-1, keepdims=True), axis=-1)[..., 0]
        assert np.array_equal(found[1:], worst), metric
        assert np.isnan(found[0, 0])
        assert np.isinf(found[0, 1:3]).all()
        assert found[0, 4] == 0


def test_dissimilarity_is_that_of_scikit_image_and_its_mean_the_metric_of_the_judge(run):
    random = np.random.default_rng(6)
    theirs = random.uniform(0, 1, (40, 50, 3)).astype(np.float32)
    ours = (theirs + 0.1 * random.normal(size=theirs.shape)).astype(np.float32)
    ends = float(min(ours.min(), theirs.min())), float(max(ours.max(), theirs.max()))

    found = run(
        f"([a, b]) => {{ {REVIVE} return Array.from(rayproof.dissimilarity(revive(a), revive(b), -1)) }}",
        [image(ours), image(theirs)],
    )

    wide = ours.astype(np.float64), theirs.astype(np.float64)
    result: Any = structural_similarity(
        *wide, channel_axis=-1, data_range=ends[1] - ends[0], gaussian_weights=True, sigma=1.5,
        use_sample_covariance=False, full=True, truncate=5 / 1.5,
    )  # fmt: skip
    # Both mirror at borders; sums in another order differ by roundings.
    assert np.allclose(np.reshape(found, (40, 50)), np.maximum(0, 1 - result[1].min(axis=-1)), atol=1e-6)
    assert METRICS["ssim"](*wide, ends) == pytest.approx(1 - np.mean(found), abs=1e-6)


def test_a_histogram_counts_every_pixel_once(run):
    values = [0, 0, 1e-9, 1e-7, 3e-6, 1e-3, 5, float("inf"), float("nan")]
    code = "([v, range, log]) => rayproof.histogram({ values: v.map(Number) }, range, log)"
    texts = [str(v).replace("inf", "Infinity") for v in values]

    for log in (True, False):
        found = run(code, [texts, [1e-8, 1e-3], log])
        assert sum(found["bins"]) + found["zero"] + found["below"] + found["above"] + found["odd"] == len(values)
        assert (found["odd"], found["above"]) == (2, 1)
    assert run(code, [texts, [1e-8, 1e-3], True])["zero"] == 2


@pytest.mark.parametrize("frame", [{"width": 400, "height": 300}, {"width": 300, "height": 500}])
def test_zooming_keeps_what_is_under_the_pointer_and_fitting_comes_back(run, frame):
    code = """([frame]) => { const image = { width: 80, height: 60 }; let view = rayproof.fitted(image); const out = [];
        view = rayproof.zoomed(view, image, frame, 8, [frame.width / 2, frame.height / 2]);
        for (const factor of [2, 0.5, 3]) {
            const before = rayproof.under(view, image, frame, [120, 140]);
            view = rayproof.zoomed(view, image, frame, factor, [120, 140]);
            out.push([before, rayproof.under(view, image, frame, [120, 140])]);
        }
        const [near, far] = [1e6, 1e-6].map((factor) => rayproof.zoomed(view, image, frame, factor, [3, 5]));
        return [out, far, near, rayproof.placed(rayproof.fitted(image), image, frame).scale]; }"""

    places, small, large, fit = run(code, [frame])

    for before, after in places:
        assert after == pytest.approx(before)
    assert small == {"zoom": 1, "x": 40, "y": 30}
    assert large["zoom"] * fit == pytest.approx(120)


def test_a_case_comes_back_from_what_was_left_out(run, published):
    for case in published.results["cases"]:
        known = {name: value for name, value in case.items() if name != "checks"}

        found = run("(record) => rayproof.expanded(record)", json.loads(as_json(compact_case(case))))
        written = found.pop("checks")
        checks = [msgspec.convert(check, Check, strict=False) for check in written]
        parts = [part for check in written for part in (check["end_to_end"], check["continued"]) if part]

        assert all(part.keys() >= READ for part in parts)
        assert list(map(repr, checks)) == list(map(repr, case["checks"]))  # NaN is equal to itself so
        assert found == json.loads(as_json(known))


def test_the_shortest_text_of_a_float32_gives_it_back(run):
    bits = np.random.default_rng(7).integers(0, 2**32, 2000, dtype=np.uint32)
    values = np.concatenate(
        [bits.view(np.float32), np.array([0.0, -0.0, 1e-45, 3.4028235e38, np.inf, -np.inf], np.float32)]
    )
    values = values[~np.isnan(values)]

    texts = run(
        "(v) => v.map((t) => rayproof.exact(Number(t.replace('inf', 'Infinity'))))", [str(float(v)) for v in values]
    )

    assert np.array([float(text) for text in texts]).astype(np.float32).tobytes() == values.tobytes()
    assert max(map(len, texts)) <= 22


def test_pixels_are_unpacked_bit_for_bit_by_every_prediction(run, tmp_path: Path):
    odd = answers(rounding=1e-7)
    for stage in odd:
        odd[stage][0, :3, 0] = (np.nan, np.inf, -0.0)
    path = write_pixels(tmp_path / "a.js", "a.js", {"ours": odd, "analytic": answers()}, SCENE)
    stored = json.loads(path.read_text().splitlines()[1])
    ways = {(one["by"], one["curved"]) for stages in stored["renderers"].values() for one in stages.values()}
    assert {by for by, _ in ways} == {"nothing", "base", "factors", "ray", "pinhole", "lights"}

    code = """async (stored) => { const { base, renderers } = stored; const known = new Map();
        const get = (name, stage) => { const key = name + stage; if (!known.has(key)) known.set(key, (async () => {
            const one = renderers[name][stage];
            const foretold = await rayproof.predict(one, stage, name, base, get);
            return { channels: one.channels, values: await rayproof.floats(one, foretold) };
        })()); return known.get(key); };
        const out = {};
        for (const name of Object.keys(renderers)) { out[name] = {}; for (const stage of Object.keys(renderers[name])) {
            out[name][stage] = Array.from(new Uint32Array((await get(name, stage)).values.buffer)); } }
        return out; }"""
    found = run(code, stored)

    for name, stages in read_pixels(path).items():
        for stage, expected in stages.items():
            assert np.array_equal(np.array(found[name][stage], np.uint32), expected.view(np.uint32).reshape(-1))


def test_filters_combine_and_every_order_is_total(run):
    row = {"stresses": "", "stages": ["normal"], "cells": {"a": ["fail", 1, 2, "inf", 0]}, "family": "f", "reason": ""}
    rows = [
        row | {"name": "b", "verdict": "pass", "ratio": 0.5, "seconds": 2, "covers": ["HIT-1"], "blame": ""},
        row | {"name": "a", "verdict": "fail", "ratio": "nan", "seconds": 1, "covers": [], "blame": "ray CAM-1",
               "cells": {}},
        row | {"name": "c", "verdict": "warn", "ratio": None, "seconds": None, "covers": ["HIT-1"], "blame": ""},
    ]  # fmt: skip

    def matching(**wanted: str) -> list[str]:
        return [r["name"] for r in run("([rows, f]) => rows.filter((row) => rayproof.matches(row, f))", [rows, wanted])]

    def order(key: str) -> list[str]:
        return [r["name"] for r in run("([rows, key]) => rayproof.sorted(rows, key)", [rows, key])]

    assert matching(id="HIT-1") == ["b", "c"]
    assert matching(id="HIT-1", verdict="warn") == ["c"]
    assert matching(q="cam-1 A") == ["a"]
    assert matching(stage="ray") == []
    assert order("") == order("constructor") == ["b", "a", "c"]
    assert order("name") == ["a", "b", "c"]
    assert order("-verdict") == ["a", "c", "b"]
    assert order("-ratio") == ["a", "b", "c"]
    assert order("-time") == ["b", "a", "c"]
    assert order("-by a")[-1] == "a"


def test_settings_read_whatever_an_address_says(run):
    def settings(address: str) -> dict[str, Any]:
        return run("(hash) => { location.hash = hash; return rayproof.settings(); }", address)

    assert settings("#at=3,4&metric=ulp&exposure=1.5&low=1e-6&zoom=8") | {"mode": "", "colors": "", "map": ""} == {
        "mode": "", "metric": "ulp", "channel": -1, "exposure": 1.5, "gamma": 0, "map": "", "colors": "", "log": True,
        "low": 1e-6, "high": None, "explained": False, "pixel": [3, 4], "zoom": 8,
    }  # fmt: skip
    odd = settings("#at=-1,2&metric=__proto__&exposure=1e99&low=-1&high=x&zoom=NaN&channel=0.6")
    assert (odd["pixel"], odd["metric"], odd["exposure"]) == (None, "absolute", 20)
    assert (odd["low"], odd["high"], odd["zoom"], odd["channel"]) == (None, None, 1, 1)
