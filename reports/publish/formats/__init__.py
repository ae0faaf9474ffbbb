"""A run's results for other programs: JUnit, CTRF, annotations, a badge and a summary in Markdown."""
