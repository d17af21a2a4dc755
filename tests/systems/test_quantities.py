"""Each quantity is one row: a new one is in runs, traces, columns and the tables of the docs."""

import json
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.differences import along
from support.paper_runs import paper_config
from support.pose import attitude
from support.systems import random_state, random_system

from rbstab.mechanics.attitude import (
    half_sine_squared,
    half_sine_squared_rate,
    rate_matrix,
    rotation,
)
from rbstab.systems.quantities import BY_NAME, PEAKS, named_elements, observed_in

ROW = """
    Quantity("tip", "x_t", "m", _VECTOR, "end of the axis, inertial",
             formula=lambda seen: seen.motion.X + seen.motion.A @ np.array([0.0, 0.1, 1.0]),
             trace=True, end=", inertial",
             peak=Peak(lambda seen: seen.motion.V
                       + seen.motion.A @ np.cross(seen.motion.Omega, np.array([0.0, 0.1, 1.0])),
                       "x_t farthest from 0, by axis")),
"""

PROGRAM = """
import importlib.util, json, runpy, sys
row, folder, data = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
import rbstab.systems
name = "rbstab.systems.quantities"
spec = importlib.util.find_spec(name)
module = sys.modules[name] = importlib.util.module_from_spec(spec)
source = open(spec.origin, encoding="utf-8").read()
place = '"time from the start"),\\n'
assert source.count(place) == 1
exec(compile(source.replace(place, place + row), spec.origin, "exec"), module.__dict__)
rbstab.systems.quantities = module

from pathlib import Path
import rbstab
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.sweep import sweep_to_folder
from rbstab_cli.main import cli
from click.testing import CliRunner

run = Path(folder) / "one.h5"
rbstab.simulate(data | {"title": "one"}).variables
(Path(folder) / "one.yaml").write_text(json.dumps(data | {"title": "one"}))
done = CliRunner().invoke(cli, ["run", folder + "/one.yaml", "--no-prove", "-o", folder])
assert done.exit_code == 0, done.output
found = {"run": {key: rbstab.open_result(run)[key].tolist() for key in ("tip", "orientation")}}
found["unit"] = rbstab.open_result(run).variables["tip"].unit
for engine in ("heyoka", "scipy"):
    base = data | {"integration": data["integration"] | {"engine": engine}}
    vary = {"initial.angular_velocity[0]": {"values": [1.0, 9.0]}}
    plan = load_plan({"base": base, "vary": vary, "keep": "traces"})
    path = Path(folder) / engine
    sweep_to_folder(plan, path, SweepOptions(threads=1))
    table, trace = rbstab.open_sweep(path), rbstab.open_traces(path).of(1)
    columns = ("final_tip", "peak_tip", "peak_tip_error")
    found[engine] = {key: table[key].tolist() for key in columns}
    found[engine] |= {key: trace[key].tolist() for key in ("tip", "orientation", "position")}
found["docs"] = {
    kind: runpy.run_path("docs/quantity_tables.py")["table"](kind)
    for kind in ("quantities", "columns", "traces")
}
print(json.dumps(found))
"""


def test_one_row_is_a_new_quantity_everywhere(tmp_path):
    pytest.importorskip("heyoka")
    data = paper_config("visco-elastic", True, duration=0.5, samples=41)
    command = [sys.executable, "-c", PROGRAM, ROW, str(tmp_path), json.dumps(data)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert printed["unit"] == "m"
    assert np.array(printed["run"]["tip"]).shape == (41, 3)
    point = np.array([0.0, 0.1, 1.0])
    for engine in ("heyoka", "scipy"):
        arrays = {name: np.array(values) for name, values in printed[engine].items()}
        expected = [
            X + attitude(Theta) @ point
            for X, Theta in zip(arrays["position"], arrays["orientation"], strict=True)
        ]
        np.testing.assert_allclose(arrays["tip"], expected, rtol=0, atol=1e-12)
        np.testing.assert_allclose(arrays["final_tip"][1], arrays["tip"][-1], rtol=0, atol=1e-12)
        sampled = np.abs(arrays["tip"]).max(axis=0)
        peak = np.abs(arrays["peak_tip"][1])
        assert (peak >= sampled - 1e-9).all()
        assert (peak <= sampled + 0.02).all()
        assert (arrays["peak_tip_error"] < 1e-6).all()
    compiled, plain = (np.array(printed[engine]["peak_tip"]) for engine in ("heyoka", "scipy"))
    np.testing.assert_allclose(compiled, plain, rtol=0, atol=1e-7)
    docs = printed["docs"]
    assert "| `tip` | time, axis | m | x_t, end of the axis, inertial |" in docs["quantities"]
    assert "| `final_tip` | run, axis | m | x_t at the end, inertial |" in docs["columns"]
    assert "| `peak_tip` | run, axis | m | x_t farthest from 0, by axis |" in docs["columns"]
    assert "`tip`" in docs["traces"]


def formula(name):
    return BY_NAME[name].formula


@pytest.mark.parametrize(
    ("name", "rate"),
    [
        ("position", "velocity"),
        ("contact_displacement", "contact_velocity"),
        *((name, None) for name in PEAKS),
    ],
)
def test_rates_are_derivatives(name, rate, rng):
    """By differences along the motion; their units are units over seconds."""
    system = random_system(rng, "embedded")
    y = random_state(rng, system)
    slope = formula(rate) if rate else PEAKS[name].rate
    rate_of_change = along(lambda y: formula(name)(system.observe(y)), y, system.rates(y))
    assert slope(system.observe(y)) == pytest.approx(rate_of_change, rel=1e-6, abs=1e-8)
    assert rate is None or BY_NAME[rate].unit == f"{BY_NAME[name].unit}/s"


def test_the_rate_of_the_tilt_is_its_derivative(rng):
    """Of sin²(φ/2), by differences, and φ is that of SciPy's rotations."""
    Theta, Omega = rng.uniform(-1.4, 1.4, 3), rng.normal(size=3)
    shift = 1e-6 * rate_matrix(Theta) @ Omega
    A, before, after = map(rotation, (Theta, Theta - shift, Theta + shift))
    assert half_sine_squared(A) == pytest.approx(
        np.sin(Rotation.from_matrix(A).magnitude() / 2) ** 2
    )
    expected = (half_sine_squared(after) - half_sine_squared(before)) / 2e-6
    assert half_sine_squared_rate(A, Omega) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_the_rate_of_v_is_what_the_audit_integrates(rng):
    system = random_system(rng, "visco-elastic")
    y = random_state(rng, system)
    rate = formula("lyapunov_rate")(system.observe(y))
    assert rate == system.audited_rates(y)[-2] < 0
    assert set(observed_in(system)) >= {"energy", "dissipation", "contact_force"}
    assert not named_elements(system)
