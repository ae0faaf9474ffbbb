"""The report for a browser: its data and pages; its scripts are in html/."""
