"""Verdicts held against certified arithmetic: who was accused and is right, who passed and is wrong.

The judge compares with renderers that round; what is asked here is asked of enclosures whose every decision is proved.
"""
