"""The Python interface of rayproof, for notebooks, scripts and test suites.

    asking      select_cases, load, render, oracle: scenes, and their images by the tracer and the oracle judging
    judge: compare existing images with the references in this process running     run: judge the tracer, a reference, a
    command or a Python function on the whole suite outcome     the results of these functions, immutable, with images,
    limits and failures; compare: two formulas or runs

Names are imported when they are used, so that `import rayproof` costs nothing (`python/rayproof/__init__.py`).
"""
