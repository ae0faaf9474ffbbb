"""Reduces a failing scene to the smallest scene with the same failure.

    failure     renders a scene, judges it with the oracle, and compares its failure with another one
    attempts    the smallest scene so far, the attempts to reduce it, and the measure of its size
    search      the search, and the steps that remove pixels, shapes, lights and faces
    numbers     the steps that simplify numbers: matrices, defaults, digits
    issue       the files on the smallest scene, which can be pasted into a bug report

The search uses no library: `shrinkray` needs Python 3.12, `picire` reduces lines of text and not scenes, and Hypothesis
shrinks only values that it has generated itself.
"""
