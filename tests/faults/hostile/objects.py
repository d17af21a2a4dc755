"""Hostile files with many objects, or with links where arrays ought to be."""

import h5py
import numpy as np
from faults.hostile.registry import hostile_content, replaced

BILLION = 10**9


@hostile_content
def many_arrays(file, name):
    for number in range(5000):
        file.create_dataset(f"extra{number}", data=0.0)


@hostile_content
def many_groups(file, name):
    for number in range(5000):
        file.create_group(f"group{number}")


@hostile_content
def deep_groups(file, name):
    group = file
    for _ in range(500):
        group = group.create_group("g")


@hostile_content
def many_attributes(file, name):
    for number in range(3000):
        file.attrs[f"extra{number}"] = "x" * 100


@hostile_content
def large_attributes(file, name):
    for number in range(100):
        file.attrs[f"extra{number}"] = np.zeros(7500)


@hostile_content
def many_attributes_of_an_array(file, name):
    for number in range(3000):
        file[name].attrs[f"extra{number}"] = number


@hostile_content
def circle_of_hard_links(file, name):
    group = file.create_group("group")
    group["itself"] = group
    file["root"] = file["/"]


@hostile_content
def array_with_a_hundred_names(file, name):
    for number in range(100):
        file[f"{name}{number}"] = file[name]


@hostile_content
def soft_link(file, name):
    del file[name]
    file[name] = h5py.SoftLink("/time")


@hostile_content
def soft_link_to_itself(file, name):
    del file[name]
    file[name] = h5py.SoftLink(f"/{name}")


@hostile_content
def external_link(file, name):
    del file[name]
    file[name] = h5py.ExternalLink("/etc/passwd", "/root")


@hostile_content
def external_storage(file, name):
    replaced(file, name, shape=(5,), dtype="f8", external=[("/etc/passwd", 0, 40)])


@hostile_content
def virtual_array(file, name):
    layout = h5py.VirtualLayout(shape=(BILLION,), dtype="f8")
    layout[:5] = h5py.VirtualSource("/dev/zero", "x", shape=(5,))
    del file[name]
    file.create_virtual_dataset(name, layout)
