"""Protects the configs of this repository: every one runs, balances its energy, and is what its
name says.
"""

from pathlib import Path

import pytest

import rbstab
from rbstab.experiment.summary import summary_of

ROOT = Path(__file__).parents[2] / "configs"
CONFIGS = sorted(path for path in ROOT.rglob("*.yaml") if path.parent.name != "sweeps")
LEAVES_RANGE = ROOT / "examples" / "stability" / "fast.yaml"


# The sliding examples take seconds: they have many switches, thin layers or small steps.
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=[pytest.mark.slow] if path.parent.name == "sliding" else [])
        for path in CONFIGS
        if path != LEAVES_RANGE
    ],
    ids=[str(path.relative_to(ROOT)) for path in CONFIGS if path != LEAVES_RANGE],
)
def test_every_config_runs_and_closes_its_audit(path):
    # The elements of users among them are ours.
    result = rbstab.simulate(rbstab.load_config(path, allow_python=True))
    assert result.status == "completed", result.attributes["status_detail"]
    residual = summary_of(result).relative_residual
    # Implicit steps are of first order, also where the motion is smooth.
    assert residual < (1e-3 if "implicit" in path.stem else 1e-9)
    if result.attributes["verdict"] == "driven":
        return
    kinetic = result["energy"][:, 0]
    assert kinetic[-1] < 1e-2 * kinetic.max()
    assert result["lyapunov"][-1] < result["lyapunov"][0]
