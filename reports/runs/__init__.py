"""Runs held against one another: the difference of two, and the history of many."""
