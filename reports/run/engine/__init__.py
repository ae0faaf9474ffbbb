"""A run on many machines by Dask: `cluster` reaches a scheduler, `dispatch` submits batches, `machine` does them."""
