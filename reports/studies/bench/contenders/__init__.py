"""Who runs in the benchmark, one file each; the contract is in `reports.studies.bench`."""
