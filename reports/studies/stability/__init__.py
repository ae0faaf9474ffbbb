"""Ladders climbed and judged: every formula variant on every sweep of the catalogue, against certified truth."""
