"""Protects a file of format 1, stored once: every later version must read it unchanged."""

import hashlib
import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from rbstab.store.result import open_result

STORED = Path(__file__).parent / "data" / "run_format_1.h5"

REFERENCE = Path(__file__).parents[1] / "data" / "paper_state.json"

DIGEST = "be62f82e826f1454585cc9a6f8e28a0982b18f3465ec88754927c3780ffde64a"


@pytest.fixture(scope="module")
def stored():
    """The result in the stored file."""
    return open_result(STORED)


def test_it_is_the_file_that_was_stored():
    assert hashlib.sha256(STORED.read_bytes()).hexdigest() == DIGEST
    assert STORED.stat().st_size < 100_000


def test_attributes(stored):
    assert stored.status == "completed"
    assert stored.attributes["title"] == "Format 1, the held body"
    assert stored.attributes["variant"] == "permanent"
    assert stored.attributes["engine"] == "scipy"
    assert stored.attributes["created"].startswith("20")
    assert stored.attributes["steps"] > 100
    with h5py.File(STORED) as file:
        assert (file.attrs["format"], file.attrs["kind"]) == (1, "the result of a run")


SYMBOLS = {
    "orientation": "Theta",
    "angular_velocity": "Omega",
    "position": "X",
    "velocity": "V",
    "contact_displacement": "E",
    "contact_velocity": "F",
    "contact_force": "Lam",
}


@pytest.mark.parametrize("name", SYMBOLS)
def test_values_are_the_reference_solution(stored, name):
    """Another program computed them: Taylor series in 80-bit numbers at tolerance 1e-18."""
    case = json.loads(REFERENCE.read_text())["cases"]["permanent/0/S0_paper"]
    times = stored["time"]
    assert len(case["states"]) == 7
    for state in case["states"]:
        (index,) = np.flatnonzero(np.isclose(times, state["t"], rtol=0, atol=1e-12))
        assert np.abs(stored[name][index] - state[SYMBOLS[name]]).max() < 1e-8, state["t"]


def test_energy_at_the_start_by_hand(stored):
    """½ m V'V with 41 kg and V = (11.84, -4.32, 3.2) m/s; ½ Ω'JΩ with Ω = (16, 32, -16) rad/s."""
    kinetic = 0.5 * 41 * (11.84**2 + 4.32**2 + 3.2**2) + 0.5 * (2560 + 8192 + 102.4)
    assert stored["part"].tolist() == [
        "kinetic",
        "gravity",
        "translational stabilizer",
        "rotational stabilizer",
    ]
    assert stored["energy"][0] == pytest.approx([kinetic, 0, 0, 0], rel=1e-14)
    assert stored["lyapunov"][0] == pytest.approx(kinetic, rel=1e-14)
    # V'L_t V and Ω'L_r Ω dissipate, with L_t = (210, 210, 140) N s/m and L_r = (60, 60, 42) N m s.
    translational = 210 * (11.84**2 + 4.32**2) + 140 * 3.2**2
    rotational = 60 * (16**2 + 32**2) + 42 * 16**2
    assert stored["dissipation"][0] == pytest.approx([0, 0, translational, rotational], rel=1e-14)
    assert stored["lyapunov_rate"][0] == pytest.approx(-translational - rotational, rel=1e-14)
    assert stored["stabilizing_force"][0] == pytest.approx([-2486.4, 907.2, -448.0], rel=1e-14)
    assert stored["stabilizing_couple"][0] == pytest.approx([-960, -1920, 672], rel=1e-14)
