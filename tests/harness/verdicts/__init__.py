"""Verdicts on scenes drawn at random, held against certified arithmetic.

A renderer that is accused and right is a wrong verdict, and so is one that passed and is wrong. The judge compares with
renderers that round; what is asked here is asked of enclosures whose every decision is proved.

`trials` judges one scene in a worker, `certify` says which of its verdicts are wrong (`judged_values` pixel by pixel,
`perturbed` in scenes within rounding), `campaign` counts them.
"""
