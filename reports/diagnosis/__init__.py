"""The search for the mistakes that explain a renderer's failures.

A mistake is a copy of the oracle with one wrong step (`reports.mistakes`). It explains a case if the judge, with this
copy in place of the oracle, finds few pixels wrong: at most a tenth of the pixels that are wrong with the right oracle,
and at most 0.2 % of the image. docs/diagnosis.md describes the search.
"""
