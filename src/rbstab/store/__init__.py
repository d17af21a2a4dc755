"""Results on disk: the only code that touches HDF5. It knows arrays and names, not physics."""
