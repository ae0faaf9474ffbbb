"""Conformance cases as test items of any pytest suite: a renderer's own, or a researcher's with one formula.

`plugin` is what pytest loads (entry point `pytest11`) and imports nothing heavy; `conformance` judges.
"""
