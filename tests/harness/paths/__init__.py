"""The tracer's ways of rendering one scene, held against each other, and the ledger of its execution paths."""
