"""Small runs of each kind for tests of reports, and readers of their figures."""

import functools
from dataclasses import replace
from pathlib import Path
from typing import Any

import rbstab
from rbstab.report.model.figure import Line
from rbstab.report.reading.sources import Run
from support import results
from support.paper_runs import paper_config

SAMPLES = 61

KINDS: dict[str, tuple[str, bool, dict[str, Any], dict[str, Any]]] = {
    "permanent": ("permanent", False, {}, {}),
    "visco-elastic": ("visco-elastic", False, {}, {}),
    "embedded": ("embedded", True, {}, {}),
    "free": ("free", True, {}, {}),
    "manifold": ("permanent", True, {}, {"coordinates": "manifold"}),
    "sliding": (
        "sliding",
        False,
        {"K_s": [2000.0] * 3, "surface": {"slope": 20.0}},
        {"coordinates": "W"},
    ),
}
"""By name: the variant, whether gravity acts, and more keys of the controller and integration."""


@functools.cache
def _config(kind):
    variant, with_gravity, controller, integration = KINDS[kind]
    base = "free" if variant == "sliding" else variant
    data = paper_config(base, with_gravity, duration=0.3, samples=SAMPLES, **integration)
    data["controller"] |= {"variant": variant, **controller}
    return rbstab.load_config(data)


@functools.cache
def _result(kind):
    result = rbstab.simulate(_config(kind))
    for variable in result.variables.values():
        variable.data.flags.writeable = False
    return result


def run_of(kind, number=0, label=""):
    """Return a run of a kind, with the given number among the runs of a report."""
    return Run(
        Path(f"{kind}.h5"),
        _result(kind),
        _config(kind),
        number=number,
        name=f"run-{number + 1}",
        label=label or kind,
    )


def with_arrays(run, **arrays):
    """Return the same run with other numbers in some arrays."""
    variables = dict(run.result.variables)
    for name, data in arrays.items():
        variables[name] = variables[name]._replace(data=data)
    return replace(run, result=replace(run.result, variables=variables))


def without_config(run):
    """Return the same run with an unreadable config, which skips the slow eigenvalues."""
    return replace(run, config=None)


def cut(run, samples):
    """Return the same run, ended early after so many samples."""
    return replace(run, result=results.cut(run.result, samples))


def lines_of(panel):
    """Return the lines of a panel."""
    return [mark for mark in panel.marks if isinstance(mark, Line)]
