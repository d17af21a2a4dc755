"""Results on disk. Only this package uses HDF5; it handles names and arrays, not physics."""
