"""The columns of the varied values in the file of a sweep."""

import numpy as np

from rbstab.config.numbers import unit_at
from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.store.array_names import safe_name
from rbstab.store.table import GRID_AXIS, GRID_LENGTH, Column
from rbstab.store.variables import Variable
from rbstab.sweep.plan.axes import VARIANT, VariedKey
from rbstab.sweep.plan.plan import Plan


def varied_layout(plan: Plan) -> dict[str, Column]:
    """Return the columns of a plan's varied keys, by their netCDF names."""
    return {safe_name(varied.key): _column(plan, varied) for varied in plan.varied_keys}


def varied_arrays(plan: Plan, start: int, stop: int) -> dict[str, Array]:
    """Return the data of the varied keys for members start to stop; variants as indices."""
    arrays = {}
    for key, values in plan.values(start, stop).items():
        if key == key_of(VARIANT):
            codes = {variant: code for code, variant in enumerate(plan.variants)}
            values = np.array([codes[name] for name in values.tolist()], dtype="i1")  # noqa: PLW2901
        arrays[safe_name(key)] = values
    return arrays


def grid_extras(plan: Plan) -> dict[str, Variable]:
    """Return the axes along which members are counted, slowest first, and their lengths."""
    names, lengths = plan.dimensions.keys(), plan.dimensions.values()
    dimensions = ("grid_axis_number",)
    long_name = "axes along which members are counted, the last one fastest"
    return {
        GRID_AXIS: Variable(dimensions, np.array(list(names), dtype=object), "", long_name),
        GRID_LENGTH: Variable(dimensions, np.array(list(lengths)), "1", "their lengths"),
    }


def _column(plan: Plan, varied: VariedKey) -> Column:
    if varied.path == VARIANT:
        return Column((), "i1", "1", varied.key, plan.variants)
    if varied.scale:
        return Column((), "f8", "1", f"factor on {varied.key}")
    units = {unit_at(base, varied.key) for base in plan.bases.values()} - {""}
    return Column((), "f8", units.pop() if len(units) == 1 else "", varied.key)
