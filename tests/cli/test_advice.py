"""What is printed as a reason is what was checked, and what is advised can help.

Frequencies are those of the matrices of mass and stiffness, computed here.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.leg import leg

from rbstab_cli.main import cli

POINTS = [[x, y, -0.15] for x in (0.3, -0.3) for y in (0.2, -0.2)]
INERTIA = [0.4166666667, 0.75, 0.8666666667]
K_C, L_C = [2000, 3000, 8000], [2, 3, 8]


def machine(elements, **changes):
    return {
        "schema_version": 2,
        "title": "Machine on four mounts",
        "body": {"mass": 20, "inertia": INERTIA, "contact_point": [0, 0, -0.15]},
        "elements": {f"mount{k}": element for k, element in enumerate(elements)},
        "integration": {"duration": 1.0},
    } | changes


def mount(p):
    return {"kind": "visco-elastic", "point": p, "anchor": p, "K_c": K_C, "L_c": L_C}


MOUNTS = machine([mount(p) for p in POINTS])

LEG = leg()


KNOCK = """\
schema_version: 2
body: {mass: 2, inertia: [1, 1, 1], contact_point: [0, 0, 0]}
elements:
  mount: {kind: visco-elastic, point: [0, 0, 0], anchor: [0, 0, 0], K_c: [200, 200, 200],
    L_c: [10, 10, 10]}
  upright: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}
  knock: {kind: input, quantity: force, point: [0, 0, 0], direction: [1, 0, 0], amplitude: 100,
    signal: {kind: pulse, start: 1, duration: 0.01}}
integration: {duration: 10}
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, data in {"mounts": MOUNTS, "leg": LEG}.items():
        Path(f"{name}.yaml").write_text(json.dumps(data))
    Path("knock.yaml").write_text(KNOCK)


def printed(*arguments):
    done = CliRunner().invoke(cli, list(arguments), env={"COLUMNS": "1000"})
    assert done.exit_code == 0, done.output
    return done.stdout


def frequencies(stiffness):
    """Return the square roots of the eigenvalues of M⁻¹K of the upright machine, rad/s."""
    K = np.zeros((6, 6))
    for x, y, z in POINTS:
        rates = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
        K += rates.T @ np.diag(stiffness) @ rates
    squares = np.linalg.eigvals(K / np.array([20.0] * 3 + INERTIA)[:, np.newaxis])
    return sorted(np.sqrt(squares.real).tolist())


def test_the_frequencies_of_the_mounts_need_no_proof():
    expected = frequencies(K_C)
    assert expected == pytest.approx([19.34, 21.91, 40.00, 40.19, 61.97, 64.08], abs=0.005)
    text = ", ".join(f"{frequency:.4g}" for frequency in expected)
    assert f"natural frequencies {text} rad/s" in printed("run", "mounts.yaml", "--no-prove")
    assert f"{text} rad/s" in printed("show", "results/mounts.h5")


def test_a_driven_run_speaks_of_the_largest_v():
    output = printed("run", "knock.yaml")
    assert "v(0)/1000" not in output
    assert "At rest: v stays below 0.001 of its largest value from then on" in output
    printed("run", "leg.yaml", "--no-prove")
    both = printed("run", "leg.yaml", "knock.yaml", "--no-prove")
    assert "v(0)/1000; where elements supply power, v stays below 0.001 of its largest" in both


def test_a_driven_sweep_speaks_of_the_largest_v():
    """A knock on a body at rest: v(0) is 0, so no v stays below a share of it."""
    vary = {"elements.knock.amplitude": {"values": [1, 100]}}
    Path("knocks.yaml").write_text(json.dumps({"base": "knock.yaml", "vary": vary}))
    largest = "v stays below 0.001 of its largest value to the end"
    for output in (printed("sweep", "knocks.yaml"), printed("show", "results/knocks")):
        assert largest in output
        assert "v(0)/1000" not in output
