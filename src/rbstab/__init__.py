"""Dynamics and Lyapunov stability of one rigid body: free, held at a point, or with a connector.

For notebooks::

    import rbstab

    result = rbstab.simulate(rbstab.example("real_body"))   # or the path of a config
    result["lyapunov"]     # an array
    result.to_pandas()     # a table, one row a sample
    result.to_xarray()     # a dataset with units
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.config.errors import ConfigError
    from rbstab.config.load import load_config
    from rbstab.experiment.answers.result import Result
    from rbstab.experiment.convergence.convergence import Enclose
    from rbstab.experiment.proof import prove
    from rbstab.experiment.simulate import simulate
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.experiment.tuning.fit import fit
    from rbstab.experiment.tuning.fitted import Fitted
    from rbstab.experiment.tuning.sensitivities import Sensitivities, sensitivities
    from rbstab.experiment.tuning.tune import Tuned, tune
    from rbstab.integrate.status import RunStatus
    from rbstab.listing.opening import open_proof, open_result, open_sweep
    from rbstab.packaged.examples import example
    from rbstab.store.dataset import Motions
    from rbstab.store.errors import StoreError
    from rbstab.store.result import write_result
    from rbstab.store.table import Table
    from rbstab.sweep.folder.stored_traces import SweepTraces, open_traces
    from rbstab.sweep.plan.load import load_plan

__all__ = [
    "ConfigError",
    "Enclose",
    "Fitted",
    "Motions",
    "Proof",
    "Result",
    "RunStatus",
    "Sensitivities",
    "StoreError",
    "SweepTraces",
    "Table",
    "Tuned",
    "example",
    "fit",
    "load_config",
    "load_plan",
    "open_proof",
    "open_result",
    "open_sweep",
    "open_traces",
    "prove",
    "sensitivities",
    "simulate",
    "tune",
    "write_result",
]

_MODULES = {
    "ConfigError": "rbstab.config.errors",
    "Enclose": "rbstab.experiment.convergence.convergence",
    "Fitted": "rbstab.experiment.tuning.fitted",
    "Motions": "rbstab.store.dataset",
    "Proof": "rbstab.experiment.stored_proof.proof",
    "Result": "rbstab.experiment.answers.result",
    "RunStatus": "rbstab.integrate.status",
    "Sensitivities": "rbstab.experiment.tuning.sensitivities",
    "StoreError": "rbstab.store.errors",
    "SweepTraces": "rbstab.sweep.folder.stored_traces",
    "Table": "rbstab.store.table",
    "Tuned": "rbstab.experiment.tuning.tune",
    "example": "rbstab.packaged.examples",
    "fit": "rbstab.experiment.tuning.fit",
    "load_config": "rbstab.config.load",
    "load_plan": "rbstab.sweep.plan.load",
    "open_proof": "rbstab.listing.opening",
    "open_result": "rbstab.listing.opening",
    "open_sweep": "rbstab.listing.opening",
    "open_traces": "rbstab.sweep.folder.stored_traces",
    "prove": "rbstab.experiment.proof",
    "sensitivities": "rbstab.experiment.tuning.sensitivities",
    "simulate": "rbstab.experiment.simulate",
    "tune": "rbstab.experiment.tuning.tune",
    "write_result": "rbstab.store.result",
}


def __getattr__(name: str) -> Any:
    # Imported on first use, so that `rbstab --help` does not wait for numpy.
    if name not in _MODULES:
        # With its name and the module, Python says which name was meant.
        message = f"module 'rbstab' has no attribute {name!r}"
        raise AttributeError(message, name=name, obj=sys.modules[__name__])
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted([*(name for name in globals() if name.startswith("__")), *__all__])
