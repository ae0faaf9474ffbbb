"""What repeats or goes without saying is left out of results.json, and put back where it belongs."""

import copy
import json

from jsonschema import Draft202012Validator

from rayproof.reports.results.compact import TABLE, compact, expand
from rayproof.reports.results.document import load_results, save_results
from rayproof.reports.results.files import plain
from rayproof.reports.results.records import schema
from tests.reports.checks import recorded

MEASURED = {"worst_ratio": 0.5, "worst_error": 1e-7, "limit": 2e-7, "ulp": 1.5, "pixel": [3, 1]}
MEASURED |= {"explained": 3, "interior": 9}
EXAMINED = {"pixels": 12}
CHECK = {
    "configuration": "float32", "reference": "analytic", "stage": "ray", "verdict": "pass", "reason": "", "ratio": 0.5,
    "end_to_end": MEASURED, "continued": None, "examined": EXAMINED, "because": "gamma(16)",
}  # fmt: skip


def results_of(*checks, **facts):
    return {"cases": [{"width": 4, "height": 3, "checks": [recorded(**check) for check in checks], **facts}]}


def compacted(results):
    places = {}
    cases = [compact(case, places) for case in results["cases"]]
    return {TABLE: list(places), "cases": cases}


def there_and_back(results):
    written = json.loads(json.dumps(plain(compacted(results))))
    expand(written)
    return written


def test_the_file_fits_its_schema_and_has_every_text_once(tmp_path, published):
    save_results(tmp_path, published.results)

    text = (tmp_path / "results.json").read_text()
    because = published.results["cases"][0]["checks"][0].because
    Draft202012Validator(schema()).validate(json.loads(text))
    assert text.count(because) == 1
    assert json.loads(text)["cases"][0]["because"]["analytic"]["camera"] == 0
    assert load_results(tmp_path)["cases"][0]["checks"][0].because == because


def test_what_checks_have_in_common_stands_once_and_comes_back():
    checks = [
        CHECK | {"configuration": configuration, "reference": reference, "stage": stage, "because": because}
        for configuration, because in (("float32", "gamma(16)"), ("float64", "another"))
        for reference in ("analytic", "radiance")
        for stage in ("ray", "object")
    ]
    results = results_of(*checks)
    before = copy.deepcopy(results)

    (case,) = compacted(results)["cases"]

    usual = {
        "end_to_end": {
            "worst_ratio": 0.5,
            "worst_error": 1e-7,
            "limit": 2e-7,
            "pixel": (3, 1),
            "interior": 9,
            "explained": 3,
            "ulp": 1.5,
        }
    }
    assert case["because"] == {"analytic": {"ray": 0, "object": 0}, "radiance": {"ray": 0, "object": 0}}
    assert [group["stages"]["ray"] for group in case["checks"]] == [usual] * 2 + [usual | {"because": 1}] * 2
    assert results == before
    assert there_and_back(results) == results


def test_what_is_not_usual_is_written_and_read():
    exact = MEASURED | {"worst_ratio": 0, "worst_error": 0, "limit": 0, "ulp": 0, "pixel": [0, 0]}
    counts = EXAMINED | {"rounding": 2, "epsilon": 1, "wrong": 3}
    unusual = [
        CHECK | {"verdict": "fail", "reason": "it is off", "ratio": 2.0, "examined": counts},
        CHECK | {"stage": "object", "end_to_end": exact, "continued": exact, "ratio": 0},
        CHECK | {"stage": "normal", "end_to_end": MEASURED | {"wrong": 2, "nan": 1}, "continued": MEASURED},
        CHECK | {"stage": "position", "end_to_end": MEASURED | {"interior": 0}},
        CHECK | {"stage": "irradiance", "continued": exact | {"explained": 0, "interior": 12}},
        CHECK | {"stage": "distance", "continued": MEASURED | {"worst_ratio": "inf", "mean_wrong": "nan"}},
        CHECK | {"stage": "camera", "end_to_end": None, "examined": {"pixels": 78}},
        CHECK | {"stage": "exitance", "examined": {"pixels": 78, "unexamined": 78}},
        CHECK | {"stage": "radiance", "end_to_end": None, "ratio": 0.0, "examined": None},
    ]
    assert repr(there_and_back(results_of(*unusual))) == repr(results_of(*unusual))  # NaN is no NaN's equal


def test_a_matrix_is_written_by_its_half_only_where_nobody_differs_and_it_is_symmetric():
    agree = {"ratio": [[None, 0.5], [0.5, None]], "differing": [[None, 0], [0, None]], "alone": None}
    panels = [
        agree,
        agree | {"ratio": [[None, 0.5], [0.25, None]]},
        agree | {"differing": [[None, 3], [0, None]]},
        {"ratio": [[None]], "differing": [[None]]},
    ]

    written = [
        compacted(results_of(adjudication={"ray": panel}))["cases"][0]["adjudication"]["ray"] for panel in panels
    ]

    assert written[0] == {"ratio": [[None, 0.5], [None]], "alone": None}
    assert written[2] == panels[2]
    for panel in panels:
        assert there_and_back(results_of(adjudication={"ray": panel})) == results_of(adjudication={"ray": panel})
