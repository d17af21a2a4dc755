"""Hostile files with wrong names, dimension scales, texts and attributes."""

import h5py
import numpy as np
from faults.hostile.registry import hostile_content


@hostile_content
def scale_with_an_undecodable_name(file, name):
    scale = b"\xff\xfe\xfd"
    space = h5py.h5s.create_simple(file[name].shape[:1])
    h5py.h5d.create(file.id, scale, h5py.h5t.IEEE_F64LE, space)
    opened = h5py.Dataset(h5py.h5d.open(file.id, scale))
    h5py.h5ds.set_scale(opened.id, scale)
    axis = file[name].dims[0]
    axis.detach_scale(axis[0])
    h5py.h5ds.attach_scale(file[name].id, opened.id, 0)


@hostile_content
def array_with_an_undecodable_name(file, name):
    space = h5py.h5s.create_simple((5,))
    h5py.h5d.create(file.id, b"\xff\xfe", h5py.h5t.IEEE_F64LE, space)


@hostile_content
def no_scales(file, name):
    for axis in file[name].dims:
        axis.detach_scale(axis[0])


@hostile_content
def scale_of_another_length(file, name):
    wrong = file.create_dataset("wrong", data=np.zeros(7))
    wrong.make_scale("wrong")
    axis = file[name].dims[0]
    axis.detach_scale(axis[0])
    axis.attach_scale(wrong)


@hostile_content
def undecodable_texts(file, name):
    kind = h5py.string_dtype("utf-8", 4)
    for owner in (file, file[name]):
        for key in [key for key in owner.attrs if isinstance(owner.attrs[key], str)]:
            owner.attrs.create(key, np.bytes_(b"\xff\xfe\xfd"), dtype=kind)


@hostile_content
def attribute_with_an_undecodable_name(file, name):
    space = h5py.h5s.create(h5py.h5s.SCALAR)
    h5py.h5a.create(file.id, b"\xff\xfe", h5py.h5t.IEEE_F64LE, space)


@hostile_content
def attributes_of_wrong_types(file, name):
    for key in list(file.attrs):
        file.attrs[key] = np.zeros(3)


@hostile_content
def attributes_without_space(file, name):
    for key in list(file.attrs):
        file.attrs[key] = h5py.Empty("f8")


@hostile_content
def attribute_with_a_reference(file, name):
    file.attrs["title"] = file[name].ref


@hostile_content
def version_is_areplaced_text(file, name):
    file.attrs["schema_version"] = "1"


@hostile_content
def version_is_huge(file, name):
    file.attrs["schema_version"] = np.uint64(2**64 - 1)


@hostile_content
def version_is_not_a_number(file, name):
    file.attrs["schema_version"] = np.nan
