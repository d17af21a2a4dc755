"""Hostile files with arrays of wrong types and shapes."""

from typing import Any

import h5py
import numpy as np
from faults.hostile.registry import config_name, hostile_content, replaced

TYPES: dict[str, Any] = {
    "compound": [("a", "f8"), ("b", "i4")],
    "enumeration": h5py.enum_dtype({"a": 0, "b": 1}),
    "opaque": np.dtype("V8"),
    "reference": h5py.ref_dtype,
    "region": h5py.regionref_dtype,
    "complex": "c16",
    "truth": "?",
    "lists": h5py.vlen_dtype(np.dtype("f8")),
    "vectors": np.dtype(("f8", (1000,))),
    "half": "f2",
    "long": np.longdouble,
    "big_endian": ">f8",
    "fixed_texts": "S7",
    "texts": h5py.string_dtype(),
    "integers": "i8",
}


def _of_type(kind: str) -> None:
    def wrong_type(file, name):
        replaced(file, name, shape=file[name].shape, dtype=TYPES[kind])

    wrong_type.__name__ = f"type_{kind}"
    hostile_content(wrong_type)


for _kind in TYPES:
    _of_type(_kind)


@hostile_content
def named_type(file, name):
    del file[name]
    file[name] = np.dtype("f8")


@hostile_content
def group_in_place_of_an_array(file, name):
    del file[name]
    file.create_group(name)


@hostile_content
def null_space(file, name):
    replaced(file, name, data=h5py.Empty("f8"))


@hostile_content
def no_entries(file, name):
    replaced(file, name, shape=(0,), dtype="f8")


@hostile_content
def thirty_two_axes(file, name):
    replaced(file, name, shape=(1,) * 32, dtype="f8")


@hostile_content
def a_number_in_place_of_an_array(file, name):
    replaced(file, name, data=1.0)


@hostile_content
def wrong_length(file, name):
    replaced(file, name, data=np.zeros(file[name].shape[0] + 1))


@hostile_content
def config_is_an_array(file, name):
    text = config_name(file)
    del file[text]
    file.create_dataset(text, data=["a: 1", "b: 2"], dtype=h5py.string_dtype())


@hostile_content
def config_is_a_number(file, name):
    text = config_name(file)
    del file[text]
    file.create_dataset(text, data=3.5)
