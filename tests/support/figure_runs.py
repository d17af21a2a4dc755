"""Small runs of each kind as a report has them, and what is found in their figures."""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

import rbstab
from rbstab.config.schema import Config
from rbstab.report.model.document import Section
from rbstab.report.model.figure import Figure, Line, Panel
from rbstab.report.reading.sources import Run
from rbstab.store.result import Result
from support.paper_runs import paper_config

SAMPLES = 61

KINDS = {
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
"""By name: variant, whether under gravity, what the controller and the integration have besides."""


@functools.cache
def _config(kind: str) -> Config:
    variant, weighed, controller, integration = KINDS[kind]
    base = "free" if variant == "sliding" else variant
    data = paper_config(base, weighed, duration=0.3, samples=SAMPLES, **integration)
    data["controller"] |= {"variant": variant, **controller}
    return rbstab.load_config(data)


@functools.cache
def _result(kind: str) -> Result:
    result = rbstab.simulate(_config(kind))
    for variable in result.variables.values():
        variable.data.flags.writeable = False
    return result


def run_of(kind: str, number: int = 0, label: str = "") -> Run:
    """A run of a kind, as the one of that number among several."""
    return Run(
        number,
        f"run-{number + 1}",
        label or kind,
        Path(f"{kind}.h5"),
        _result(kind),
        _config(kind),
    )


def with_arrays(run: Run, **arrays: np.ndarray) -> Run:
    """The same run with other numbers in some arrays."""
    variables = dict(run.result.variables)
    for name, data in arrays.items():
        variables[name] = variables[name]._replace(data=data)
    return replace(run, result=replace(run.result, variables=variables))


def without_config(run: Run) -> Run:
    """The same run, whose config cannot be read: it has no eigenvalues, which take long."""
    return replace(run, config=None)


def cut(run: Run, samples: int) -> Run:
    """The same run, ended early."""
    return with_arrays(
        run,
        **{
            name: variable.data[:samples]
            for name, variable in run.result.variables.items()
            if variable.dimensions[:1] == ("time",)
        },
    )


def figures_in(sections: tuple[Section, ...]) -> dict[str, Figure]:
    """The figures of sections by name."""
    found = [block for section in sections for block in section.blocks if isinstance(block, Figure)]
    assert len({figure.name for figure in found}) == len(found), "names are not their own"
    return {figure.name: figure for figure in found}


def lines_of(panel: Panel) -> list[Line]:
    """The lines of a panel."""
    return [mark for mark in panel.marks if isinstance(mark, Line)]
