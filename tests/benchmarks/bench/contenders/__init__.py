"""The renderers in the benchmark; `tests.benchmarks.bench` has their contract and their names."""
