"""Visits to a page of the report in a real browser, which remember everything that went wrong in them."""

import shutil
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Visit:
    """A page of the report, and what went wrong in it."""

    def __init__(self, browser: Any, folder: Path, **context: Any) -> None:
        self.folder = folder
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
        self.page.goto(f"{(self.folder / 'index.html').as_uri()}#{urlencode(address)}")
        self.page.wait_for_selector("main")
        return self.page

    def names(self) -> list[str]:
        """Return the names of the cases in the list."""
        return self.page.locator(".cases tbody a").all_inner_texts()

    def end(self) -> None:
        """Leave; a complaint, or a request that left the folder, is an error."""
        self.context.close()
        assert self.complaints == []
        inside = self.folder.as_uri()
        assert [url for url in self.requests if not url.startswith((inside, "data:"))] == []
