"""Protects the settling time: it is that of the energy without the work of the contact force."""

import numpy as np
import pytest

from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import lyapunov_function_of
from rbstab.report.reading.sources import Run

pytestmark = pytest.mark.slow

SLOPE = "configs/examples/sliding/slope_exact_20000.yaml"
CASE = "configs/paper/case2_visco_elastic.yaml"


@pytest.mark.parametrize(
    ("path", "surface", "has_potential"),
    [(SLOPE, "{slope: 20}", False), (SLOPE, "position", True), (CASE, None, True)],
)
def test_the_work_of_the_contact_force_does_not_keep_a_motion_from_settling(
    tmp_path, path, surface, has_potential
):
    changes = [f"controller.surface={surface}"] if surface else []
    result = simulate(load_config(path, [*changes, "integration.duration=2.0"]))
    stores = [has_potential or part != "connector" for part in result["part"]]
    v = result["energy"][:, stores].sum(axis=1) - result["energy_at_rest"]
    assert lyapunov_function_of(result) == pytest.approx(v, abs=1e-9 * v[0])
    run = Run(tmp_path / "a.h5", result, None)
    late = result["time"] > run.settling_time
    assert (v[late] < 1e-3 * v[0]).all()
    assert v[~late][-1] >= 1e-3 * v[0]
    # If the connector has no potential, v itself stays far above the threshold.
    assert (result["lyapunov"][-1] > 0.1 * v[0]) != has_potential
    assert np.isfinite(run.settling_time)
