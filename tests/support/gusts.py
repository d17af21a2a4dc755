"""A mast on a ball joint in gusts: plans of sweeps that state a bound on disturbances."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rbstab.config.load import load_config
from rbstab.sweep.plan.load import load_plan

MAST = Path(__file__).parents[2] / "configs" / "examples" / "gusty_joint.yaml"

GUST = {
    "kind": "input",
    "quantity": "couple",
    "direction": [0.0, 0.0, 1.0],
    "amplitude": 20.0,
    "signal": {"kind": "sine", "frequency": 0.5},
}
"""About the axis of the mast, where it is weakest."""


def mast(*gusts, **sections):
    """Return the data of the mast with inputs; by default with one gust."""
    data = load_config(MAST).plain() | {"elements": {f"gust{k}": g for k, g in enumerate(gusts)}}
    data["elements"] = data["elements"] or {"gust0": GUST}
    data["bound"] = {"couple": 20.0, "tilt": 0.5}
    data["integration"] = {"duration": 3.0, "samples": 31, "engine": "heyoka"}
    return data | sections


def plan_of(vary, *gusts, sections=None, **keys):
    """Return a plan of masts."""
    return load_plan({"base": mast(*gusts, **(sections or {})), "vary": vary, **keys})


def tilts_of(Theta):
    """Return the tilts of attitudes, shape (n, 3), by SciPy's rotations."""
    return Rotation.from_euler("XYZ", np.asarray(Theta)).magnitude()
