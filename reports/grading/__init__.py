"""A course graded: submissions built and run in enclosures, judged, and given points for each specification item.

A `Rubric` says what is asked and what it is worth; docs/grading.md leads through a first class.
"""
