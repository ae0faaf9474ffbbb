"""index.html as text: self-contained, its policy true to its contents, nothing outside the folder let in."""

import base64
import copy
import hashlib
import json
import re
from pathlib import Path

from rayproof.reports.publish import page as package
from rayproof.reports.publish import publish_all
from rayproof.reports.publish.page.case_data import write_case_data
from rayproof.reports.publish.page.page import publish, script_safe
from tests.reports.publish.sample import make_folder


def test_the_policy_names_the_script_and_the_style_by_hash(published):
    page = (published.folder / "index.html").read_text()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None

    for tag in ("script", "style"):
        (body,) = re.findall(rf"<{tag}>(.*?)</{tag}>", page, re.DOTALL)
        assert base64.b64encode(hashlib.sha256(body.encode()).digest()).decode() in policy[1]
    assert "default-src &#x27;none&#x27;" in policy[1]
    assert "unsafe" not in policy[1]


def test_no_address_and_no_raw_markup_of_a_name_is_in_the_page(published):
    page = (published.folder / "index.html").read_text()

    assert "http:" not in page
    assert "https:" not in page
    assert "<script>alert" not in page
    assert "<img src=x" not in page


def test_scripts_never_use_what_turns_text_into_markup():
    for path in Path(package.__path__[0], "html").glob("*.js"):
        assert not re.search(
            r"innerHTML|outerHTML|insertAdjacent|document\.write|eval\(|new Function", path.read_text()
        ), path


def test_json_in_a_script_element_cannot_end_it():
    assert "</" not in script_safe({"name": "</script><!--"})
    assert json.loads(script_safe({"name": "</script>"})) == {"name": "</script>"}


def test_paths_that_leave_the_folder_are_not_read(tmp_path, published):
    case = copy.deepcopy(published.results["cases"][0])
    (tmp_path / "outside.exr").write_bytes(b"secret")
    (tmp_path / "results").mkdir()
    case["renders"] = [{"renderer": "tracer-float32", "image": "../outside.exr", "seconds": 1, "error": None}]
    case["picture"] = "../outside.exr"

    written = write_case_data(tmp_path / "results", tmp_path / "results" / "0001.js", case)

    # The record alone: there is nothing that may be shown.
    assert [path.name for path in written] == ["0001.js"]


def test_a_results_file_with_the_bare_minimum_publishes(tmp_path, published):
    minimum = {key: published.results[key] for key in ("schema", "summary", "checks", "coverage")}

    written = publish(tmp_path, minimum | {"cases": [{"name": "a/b", "family": "a", "verdict": "pass"}]})

    assert [path.name for path in written] == ["index.html", "0001.js"]


def test_what_is_no_publication_stays_in_the_folder(tmp_path: Path) -> None:
    make_folder(tmp_path)
    strangers = [tmp_path / name for name in ("data/mine.js", "plots/mine.js", "thumbnails/mine.png")]
    stale = [
        tmp_path / name for name in ("data/9999.js", "data/9999.pixels.js", "plots/stability.js", "thumbnails/77.png")
    ]
    for path in [*strangers, *stale]:
        path.parent.mkdir(exist_ok=True)
        path.touch()

    publish_all(tmp_path)

    assert all(path.is_file() for path in strangers)
    assert not any(path.exists() for path in stale)
