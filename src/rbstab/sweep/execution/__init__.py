"""Running the missing shards of a sweep: threads, worker processes, a Dask cluster."""
