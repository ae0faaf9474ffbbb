"""rayproof: a conformance harness for ray tracers."""
