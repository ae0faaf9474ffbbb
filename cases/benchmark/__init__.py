"""The benchmark's scenes: everybody is timed on them, and on some judged (`cases.families.benchmarked`)."""
