"""The kinds of workers that a run has, by name; a reference's is `reference:` and its name."""

TRACING = "tracer"
JUDGE = "judge"
RECALLING = "cache"
UNDER_TEST = "subject:"  # and the name of a reference that is under test
