"""Visits to a page of the report in a real browser, which remember everything that went wrong in them."""

from pathlib import Path
from typing import Any
from urllib.parse import urlencode

VENDOR = Path(__file__).parents[2] / "vendor"
# What a software OpenGL says of itself when the screen is photographed; no word of the page's.
DRIVER = "GL Driver Message (OpenGL, Performance"


# A case's data is loaded after the address has changed; until then the page before it is on the screen.
ARRIVED = """() => {
    const app = document.getElementById("app");
    return !app || app.dataset.shown === location.hash || window.rayproof?.quiet === location.hash;
}"""


class Visit:
    """A page of the report, and what went wrong in it."""

    def __init__(self, browser: Any, folder: Path, *, file: str = "index.html", **context: Any) -> None:
        self.folder, self.file = folder, file
        self.context = browser.new_context(**context)
        self.page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.complaints.append("dialog"), dialog.dismiss()))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def open(self, **address: Any) -> Any:
        """Go to an address of the report and return the page; of a case, once its images are there."""
        self.page.goto(f"{(self.folder / self.file).as_uri()}#{urlencode(address)}")
        self.page.wait_for_selector("main")
        self.page.wait_for_function(ARRIVED)
        return self.page

    def open_3d(self) -> Any:
        """Open the first case in 3-D and return the page."""
        page = self.open(case="sphere/plain", stage="distance")
        page.get_by_role("button", name="open in 3-D").click()
        page.wait_for_selector("iframe[data-drawn]")
        return page

    def barriers(self) -> list[str]:
        """Return what axe-core finds serious or critical on the page, all that folds opened."""
        self.page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
        # By the driver, not by the page: its policy lets no script in.
        self.page.evaluate((VENDOR / "axe.min.js").read_text())
        found = self.page.evaluate("axe.run({ resultTypes: ['violations'] })")
        return [
            f"{one['id']}: {one['help']}: {[node['html'][:160] for node in one['nodes'][:3]]}"
            for one in found["violations"]
            if one["impact"] in ("serious", "critical")
        ]

    def names(self) -> list[str]:
        """Return the names of the cases in the list."""
        return self.page.locator(".cases tbody a").all_inner_texts()

    def end(self) -> None:
        """Leave; a complaint, or a request that left the folder, is an error."""
        self.context.close()
        assert [text for text in self.complaints if DRIVER not in text] == []
        inside = self.folder.as_uri()
        assert [url for url in self.requests if not url.startswith((inside, "data:", "blob:", "about:srcdoc"))] == []
