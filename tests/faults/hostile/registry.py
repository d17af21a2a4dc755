"""Kinds of hostile HDF5 files: functions that change a good file, by name."""

from collections.abc import Callable
from typing import Any

import h5py

Change = Callable[[h5py.File, str], None]
"""Changes an open file; the second argument is the name of an array of floats in it."""

CONTENTS: dict[str, Change] = {}
"""Changes made through h5py."""

BYTES: dict[str, Callable[[bytes], bytes]] = {}
"""Changes of the bytes of a file without its seal."""


def hostile_content(function: Change) -> Change:
    """Add a function to `CONTENTS`."""
    CONTENTS[function.__name__] = function
    return function


def hostile_bytes(function: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Add a function to `BYTES`."""
    BYTES[function.__name__] = function
    return function


def replaced(file: h5py.File, name: str, **properties: Any) -> h5py.Dataset:
    """Replace an array by a new one with the same unit, meaning and scales."""
    old = file[name]
    attributes = {key: old.attrs[key] for key in ("units", "long_name")}
    scales = [axis[0] for axis in old.dims if len(axis)]
    del file[name]
    new = file.create_dataset(name, **properties)
    for key, value in attributes.items():
        new.attrs[key] = value
    if new.shape is not None:
        for axis, scale in zip(new.dims, scales, strict=False):
            axis.attach_scale(scale)
    return new


def config_name(file: h5py.File) -> str:
    """Return the name of the text in a file: the config of a run, or the plan of a sweep."""
    return "config" if "config" in file else "plan"


def replaced_text(file: h5py.File, text: str) -> None:
    """Replace the text of a file."""
    name = config_name(file)
    del file[name]
    file.create_dataset(name, data=text, dtype=h5py.string_dtype())
