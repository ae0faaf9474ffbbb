"""The report that opens in a browser: its data and pages; its scripts lie in html/."""
