"""The search for the mistakes that explain a renderer's failures.

A mistake is a copy of the oracle with one wrong step (`reports.mistakes`). It explains a case if the judge, with that
oracle in place of the right one, leaves at most a tenth of the pixels wrong that are wrong by the right oracle, and at
most 0.2 % of the image. docs/diagnosis.md says how the search goes.
"""
