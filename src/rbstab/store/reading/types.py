"""Types of HDF5 that the program reads, and how much of them."""

from typing import Any

import h5py
import numpy as np

MAX_TEXT_BYTES = 16 << 20
"""The most bytes of all texts of an array, or of an attribute."""

PLAIN_NUMBERS = frozenset({"<f8", "<i8", "<i4", "|i1", "|u1"})
"""The types of numbers that the program writes: their bytes are those in memory."""

TEXT = h5py.string_dtype("utf-8")

TEXT_REFERENCE = np.dtype([("length", "<u4"), ("address", "<u8"), ("index", "<u4")])
"""HDF5 stores a text of any length as its length and its place in the file."""


def is_text(dtype: np.dtype[Any]) -> bool:
    """Return whether a type is that of texts of any length."""
    found = h5py.check_string_dtype(dtype)
    return found is not None and found.length is None
