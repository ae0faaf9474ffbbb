"""Comparison of two formulas, configurations or runs on the same rays: their errors and their run times.

Errors are paired pixel by pixel against stage truth (exact mathematics on the floats that the stage received). Run
times are interleaved repetition by repetition. An A/A control (the base against itself) shows which differences the
method reports where there are none.
"""
