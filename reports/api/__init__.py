"""What `import rayproof` offers, for notebooks, scripts and test suites.

    asking      select_cases, load, render, oracle: scenes, and what renderers answer about them
    judging     judge: an answer that is there, held against the references in this process
    running     run: the whole suite on the tracer, a reference, a command or a Python function
    outcome     what these return: frozen, with the images, the limits and the failures; compare: two formulas or runs

Names are imported when they are used, so that `import rayproof` costs nothing (`python/rayproof/__init__.py`).
"""
