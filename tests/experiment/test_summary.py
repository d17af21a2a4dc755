"""Protects the summary of a run: its peaks are those of the same run with many more samples."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.experiment.summary import RESOLVED, at_least, summary_of
from rbstab.store.result import Result

SPINS = ((16, 32, -16), (-20, 5, 25), (0, -8, 0))
MANY = 4001
ROOT = Path(__file__).parents[2]


@cache
def run(samples: int, spin: tuple[int, int, int]) -> Result:
    config = paper_config("visco-elastic", duration=0.5, samples=samples, rtol=1e-8)
    config["initial"]["angular_velocity"] = list(spin)
    return rbstab.simulate(rbstab.load_config(config))


def true_peaks(spin: tuple[int, int, int]) -> tuple[list[float], float, float]:
    """Return the largest samples of |E| by axis, of |E| and of |θ2|, of very many samples."""
    fine = run(MANY, spin)
    E = fine["contact_displacement"]
    by_axis = np.abs(E).max(axis=0).tolist()
    return by_axis, np.linalg.norm(E, axis=1).max(), np.abs(fine["orientation"][:, 1]).max()


@pytest.mark.parametrize("samples", [2, 3, 5, 9, 21, 101, 401])
@pytest.mark.parametrize("spin", SPINS)
def test_a_peak_is_true_or_a_lower_bound(samples, spin):
    s = summary_of(run(samples, spin))
    by_axis, distance, pitch = true_peaks(spin)
    found = [*map(abs, s.peak_contact_displacement), s.peak_distance]
    for peak, true in zip(found, [*by_axis, distance], strict=True):
        if s.displacement_resolved:
            # The error of a peak is an estimate: twice the allowed one.
            assert peak == pytest.approx(true, rel=2 * RESOLVED)
        else:
            assert peak <= true * (1 + 2 * RESOLVED)
    if s.pitch_resolved:
        assert s.largest_pitch == pytest.approx(pitch, rel=2 * RESOLVED)
    else:
        assert s.largest_pitch <= pitch * (1 + 2 * RESOLVED)
    assert s.resolved == (s.displacement_resolved and s.pitch_resolved)


@pytest.mark.parametrize("spin", SPINS)
def test_many_samples_show_all_peaks_and_few_do_not(spin):
    assert summary_of(run(401, spin)).resolved
    assert not summary_of(run(5, spin)).displacement_resolved


def test_peaks_of_a_fast_input_are_not_invented():
    """A pulse of 20 ms between samples 0.3 s apart: cubics through them would reach 1 cm."""
    data = {
        "schema_version": 2,
        "body": {"mass": 12.0, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, -0.25]},
        "controller": {
            "variant": "visco-elastic",
            "K_t": [4100, 4100, 3280],
            "L_t": [20, 20, 14],
            "K_r": [120, 120, 100],
            "L_r": [0.6, 0.6, 0.4],
            "K_c": [4.0e5, 4.0e5, 6.0e5],
            "L_c": [150, 150, 200],
        },
        "elements": {
            "push": {
                "kind": "input",
                "quantity": "force",
                "point": [0, 0, -0.25],
                "direction": [3, 1, 0],
                "amplitude": 3000,
                "signal": {"kind": "pulse", "start": 3.01, "duration": 0.02},
            }
        },
        "integration": {"duration": 12.0, "samples": 41},
    }
    coarse = summary_of(rbstab.simulate(rbstab.load_config(data)))
    data["integration"] = {"duration": 12.0, "samples": 12001}
    fine = summary_of(rbstab.simulate(rbstab.load_config(data)))
    assert fine.resolved
    assert not coarse.displacement_resolved
    assert coarse.peak_distance <= fine.peak_distance
    for coarsely, finely in zip(
        coarse.peak_contact_displacement, fine.peak_contact_displacement, strict=True
    ):
        assert abs(coarsely) <= abs(finely) * (1 + RESOLVED)


def test_what_stands_before_a_peak():
    assert at_least(True) == ""
    assert at_least(False) == "≥ "


@pytest.mark.parametrize(
    ("name", "samples", "resolved"),
    [("paper/case2_stiff", 401, True), ("examples/mounts", 41, False)],
)
def test_peaks_without_an_estimate_of_their_errors(name, samples, resolved):
    """Both have turns that the search suspects; only in the second one a turn is hidden."""
    path = ROOT / "configs" / f"{name}.yaml"
    s, fine = (
        summary_of(rbstab.simulate(rbstab.load_config(path, [f"integration.samples={count}"])))
        for count in (samples, MANY)
    )
    assert s.displacement_resolved == resolved
    if resolved:
        assert s.peak_contact_displacement == pytest.approx(
            fine.peak_contact_displacement, rel=1e-4
        )
    else:
        assert s.peak_distance < 0.9 * fine.peak_distance
