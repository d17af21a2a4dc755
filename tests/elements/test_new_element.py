"""Protects the promise that a new element is one file, its line in the registry, and an example.

A copy of the program gets the connector in `data/maxwell.py.txt`, which has gains of all shapes and
two own states, and the kind of element in `data/band.py.txt`, whose law is exponential. Every
command must then work with the connector, and what rests with the band is proved.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]

EXAMPLE = """\
title: Two Maxwell arms
body: {mass: 41, inertia: [10.0, 9.0, 2.0], contact_point: [0.15, 0.10, -0.42]}
gravity: [0, 0, -9.81]
controller:
  variant: maxwell
  anchor: equilibrium
  K_t: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [400, 400, 320]
  L_r: [60, 60, 42]
  K_c: [12300, 12300, 9840]
  k_m: 5000
  c_m: 300
initial: {angular_velocity: [4, 2, -1], dashpot_length: [0.01, -0.02]}
integration: {duration: 2, samples: 51}
"""

BAND = """\
schema_version: 2
title: A pendulum on a rubber band
body: {mass: 2, inertia: [0.02, 0.02, 0.01], contact_point: [0, 0, 0.2]}
gravity: [0, 0, -9.81]
controller:
  variant: permanent
  K_t: [4, 4, 4]
  L_t: [0.5, 0.5, 0.5]
  K_r: [3, 3, 3]
  L_r: [0.1, 0.1, 0.1]
elements:
  band:
    kind: band
    point: [0.02, 0, -0.1]
    anchor: [0.3, 0.1, -0.2]
    length: 0.3
    stiffness: 40
    scale: 0.1
    damping: 1
initial: {angular_velocity: [1, 0, 0]}
integration: {duration: 2, samples: 51}
"""

PLAN = """\
title: Arms of any stiffness
base: maxwell.yaml
vary:
  controller.k_m: {geomspace: [500, 50000, 3]}
  initial.dashpot_length[1]: {values: [0, 0.05]}
keep: traces
"""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A working folder beside a copy of the program that has the new connector."""
    copy = tmp_path_factory.mktemp("copy")
    for source in ("src/rbstab", "cli/rbstab_cli"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / source, copy / Path(source).name, ignore=ignored)
    elements = copy / "rbstab" / "elements"
    shutil.copy(Path(__file__).parent / "data" / "maxwell.py.txt", elements / "maxwell.py")
    registry = (elements / "registry.py").read_text()
    registered = registry.replace(
        "CONNECTORS: dict[str, type[Element]] = {\n",
        'CONNECTORS: dict[str, type[Element]] = {\n    "maxwell": MaxwellConnector,\n',
    ).replace(
        "from rbstab.elements.element",
        "from rbstab.elements.maxwell import MaxwellConnector\nfrom rbstab.elements.element",
        1,
    )
    assert registered.count("MaxwellConnector") == 2
    shutil.copy(Path(__file__).parent / "data" / "band.py.txt", elements / "band.py")
    registered = registered.replace(
        "KINDS: dict[str, dict[str | None, type[Element]]] = {\n",
        'KINDS: dict[str, dict[str | None, type[Element]]] = {\n    "band": {None: RubberBand},\n',
    ).replace(
        "from rbstab.elements.element",
        "from rbstab.elements.band import RubberBand\nfrom rbstab.elements.element",
        1,
    )
    assert registered.count("RubberBand") == 2
    (elements / "registry.py").write_text(registered)
    (copy / "maxwell.yaml").write_text(EXAMPLE)
    (copy / "plan.yaml").write_text(PLAN)
    (copy / "band.yaml").write_text(BAND)
    return copy


@pytest.fixture(scope="module")
def rbstab(folder):
    """Calls the command line of the copy, and returns what it prints."""

    def call(*arguments, exit_code=0):
        done = subprocess.run(
            [sys.executable, "-m", "rbstab_cli", *map(str, arguments)],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == exit_code, done.stderr
        return done.stdout if exit_code == 0 else done.stderr

    return call


def test_a_config_is_checked_by_what_the_element_declares(folder, rbstab):
    rbstab("check", "maxwell.yaml")
    wrong = EXAMPLE.replace("k_m: 5000", "k_m: -1").replace("[0.01, -0.02]", "[0.01]")
    (folder / "wrong.yaml").write_text(wrong)
    said = rbstab("check", "wrong.yaml", exit_code=2)
    assert "controller.k_m: is -1 (expected a number greater than 0)" in said
    assert "initial.dashpot_length: has 1 entry (expected 2)" in said
    definitions = json.loads(rbstab("schema"))["$defs"]
    described = definitions["MaxwellController"]["properties"]["c_m"]["description"]
    assert described == "viscosity of the arms, N s/m"
    assert "dashpot_length" in definitions["MaxwellInitial"]["properties"]


@pytest.fixture(scope="module")
def run(folder, rbstab):
    """The file of a run by SciPy."""
    (row,) = json.loads(rbstab("run", "--no-prove", "maxwell.yaml", "--json"))
    assert (row["status"], row["verdict"]) == ("completed", "consistent")
    return folder / "results" / "maxwell.h5"


def test_the_file_of_a_run_has_the_own_states_in_their_size(run):
    with h5py.File(run) as file:
        states = file["dashpot_length"]
        assert states.shape == (51, 2)
        assert states.attrs["units"] == "m"
        assert states.dims[1][0].name == "/dashpot_length_component"
        assert states[0].tolist() == [0.01, -0.02]
        assert file["part"].asstr()[-1] == "connector"
        # ½ E'K_c E + ½ k |s|², from the stored states, in plain numpy.
        E, D = file["contact_displacement"][()], states[()]
        stretch = E[:, :2] - D
        stored = 0.5 * (E**2 @ [12300, 12300, 9840]) + 2500 * (stretch**2).sum(axis=1)
        assert np.allclose(file["energy"][:, -1], stored, rtol=1e-12, atol=1e-12)
        v = file["lyapunov"][()]
        assert (np.diff(v) < 0).all()


def test_a_sweep_varies_its_gains_and_states(folder, rbstab):
    # One thread, for a worker process of another Python could not find the copy.
    rbstab("sweep", "--no-prove", "plan.yaml", "--threads", "1")
    rbstab("export", "results/plan", "-o", "plan.nc")
    with h5py.File(folder / "plan.nc") as file:
        assert file["controller_k_m"].attrs["units"] == "N/m"
        assert file["initial_dashpot_length_1"].attrs["units"] == "m"
        assert file["final_dashpot_length"].shape == (6, 2)
        assert np.isfinite(file["final_dashpot_length"][()]).all()
        assert np.isnan(file["final_connector_state"][()]).all()
        assert (file["status"][()] == 0).all()
        # Compared with single runs by SciPy, of which one is drawn from these six.
        compared = dict(zip(file["check_column"].asstr(), file["check_difference"], strict=True))
        assert compared["final_dashpot_length"] < 1e-8
    with h5py.File(folder / "results" / "plan" / "traces" / "00000000.h5") as file:
        assert file["dashpot_length"].shape == (6, 51, 2)


def test_its_rest_states_are_proved(rbstab):
    (answer,) = json.loads(rbstab("stability", "maxwell.yaml", "--json"))
    text = json.dumps(answer)
    assert "proved to be all" in text
    assert "dashpot_length[1]" in text


def test_what_rests_with_an_energy_in_one_new_file_is_proved(rbstab):
    text = json.dumps(json.loads(rbstab("stability", "band.yaml", "--json")), ensure_ascii=False)
    assert "2 rest states in the range: 1 stable, 1 unstable; proved to be all" in text
    assert "convergence to rest state 1 is proved" in text
