"""Mitsuba 3 asked both ways: stage by stage through its sensor and scene, and as images from its own integrator.

The published wheels compute in float32, so Mitsuba is evidence against blunders, not a source of digits. Facts about
it were checked in the source of version 3.9.1 and are repeated by the tests.
"""
