"""A course graded: submissions are built and run in enclosures, judged, and get points for each item.

A `Rubric` says what is asked and what it is worth; docs/grading.md leads through a first class.
"""
