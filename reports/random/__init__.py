"""Verdicts on scenes drawn at random: run in batches, each verdict certified, wrong ones counted."""
