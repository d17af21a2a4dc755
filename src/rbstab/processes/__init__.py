"""Worker processes and the number of processors, for sweeps and reports."""
