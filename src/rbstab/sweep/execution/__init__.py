"""Run the missing shards of a sweep, by threads, worker processes or a Dask cluster."""
