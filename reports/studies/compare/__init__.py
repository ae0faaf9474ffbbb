"""Two formulas, configurations or runs on the same rays: which errs less, and what it costs.

Errors are paired pixel by pixel against stage truth (exact mathematics on the floats that the stage received), run
times are interleaved repetition by repetition, and an A/A control shows what the same method finds in nothing.
"""
