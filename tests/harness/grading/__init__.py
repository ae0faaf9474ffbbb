"""A class of renderers with known mistakes, graded: how many mistakes cost their item, and how many items lose more."""
