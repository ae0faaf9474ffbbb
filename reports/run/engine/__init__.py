"""A run on many machines: batches of whole cases out to the workers of a Dask cluster, records and files as bytes back.

`cluster` reaches a cluster, and alone imports the engine's packages; `dispatch` hands out batches and takes up what
becomes of them, in the order that `waiting` gives; `vetting` knows which workers may have work; `batch` is what
travels; `facts` says whether a worker would find what this machine finds; `machine` is what a worker does.
"""
