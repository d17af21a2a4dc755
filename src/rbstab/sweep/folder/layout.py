"""The columns of the files of a sweep: what is varied, and what is kept of each member."""

import re

import numpy as np

from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Variable
from rbstab.store.table import Column
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.axes import Column as Varied
from rbstab.sweep.plan.plan import Plan

OUTCOME = {
    column.name: Column(
        ("axis",) * len(column.shape),
        column.dtype,
        column.unit,
        column.meaning,
        tuple(map(str, STATUSES)) if column.name == "status" else (),
    )
    for column in COLUMNS
}
"""The columns of a shard."""

UNITS = {
    "body.mass": "kg",
    "body.inertia": "kg m^2",
    "body.contact_point": "m",
    "gravity": "m/s^2",
    "controller.K_t": "N/m",
    "controller.L_t": "N s/m",
    "controller.K_r": "N m/rad",
    "controller.L_r": "N m s/rad",
    "controller.K_c": "N/m",
    "controller.L_c": "N s/m",
    "controller.K_d": "N/m",
    "controller.L_d": "N s/m",
    "controller.K_s": "N",
    "controller.surface.slope": "1/s",
    "controller.law.implicit": "s",
    "controller.stick_energy": "J",
    "initial.orientation": "rad",
    "initial.angular_velocity": "rad/s",
    "initial.position": "m",
    "initial.velocity": "m/s",
    "initial.connector_state": "m",
}
"""The units of what may vary, without those of a boundary layer, which depends on its surface."""


def safe_name(key: str) -> str:
    """The key of a config as a name that netCDF allows: `body_inertia_0` of `body.inertia[0]`."""
    return re.sub(r"[^A-Za-z0-9_]+", "_", key).strip("_")


def varied_layout(plan: Plan) -> dict[str, Column]:
    """The columns of what a plan varies, by their safe names."""
    return {safe_name(column.key): _varied(plan, column) for column in plan.columns}


def varied_arrays(plan: Plan, start: int, stop: int) -> dict[str, Array]:
    """The data of these columns; variants are their indices."""
    found = {}
    for key, values in plan.values(start, stop).items():
        if key == key_of(VARIANT):
            codes = {variant: code for code, variant in enumerate(plan.variants)}
            values = np.array([codes[name] for name in values.tolist()], dtype="i1")  # noqa: PLW2901
        found[safe_name(key)] = values
    return found


def grid_extras(plan: Plan) -> dict[str, Variable]:
    """The axes along which members are counted, slowest first, and their lengths."""
    names, lengths = plan.dimensions.keys(), plan.dimensions.values()
    along = ("grid_axis_number",)
    what = "axes along which members are counted, the last one fastest"
    return {
        "grid_axis": Variable(along, np.array(list(names), dtype=object), "", what),
        "grid_length": Variable(along, np.array(list(lengths)), "1", "their lengths"),
    }


def _varied(plan: Plan, column: Varied) -> Column:
    if column.path == VARIANT:
        return Column((), "i1", "1", column.key, plan.variants)
    if column.scale:
        return Column((), "f8", "1", f"factor on {column.key}")
    whole = key_of(tuple(part for part in column.path if isinstance(part, str)))
    return Column((), "f8", UNITS.get(whole, ""), column.key)
