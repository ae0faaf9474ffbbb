"""From a failing scene to the smallest one that fails alike.

    failure     a scene rendered and judged by the oracle: what fails in it, and whether it is the same as elsewhere
    attempts    the smallest scene so far, what is tried, and what smaller means
    search      the search, and the steps that take away: pixels, shapes, lights, faces
    numbers     steps that make numbers plainer: matrices, defaults, digits
    issue       what is written of the smallest scene: files that can be pasted into a bug report

No library drives the search: `shrinkray` asks for Python 3.12, `picire` sees lines of text and no scenes, and
Hypothesis shrinks only what it has drawn itself.
"""
