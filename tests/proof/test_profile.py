"""Protects the energy along θ2 that reports draw: no point with this θ2 has less."""

from pathlib import Path

import numpy as np
import pytest
from support.bodies import least_energy
from support.proofs import energy_of_config as exact

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.proof.confine import confined
from rbstab.proof.profile import least_along_pitch, without_barriers

CONFIGS = Path(__file__).parents[2] / "configs"
PITCH = np.array([-np.pi / 2, -1.3, -0.4, 0.0, 0.8, 1.5])


END = np.array([np.pi, np.pi / 2, np.pi])


def end_of(energy):
    limits = confined(energy)
    assert limits is not None
    return np.array([limits[0], np.pi / 2, limits[1]])


def case(name="paper/case1_permanent", *changes):
    return load_config(CONFIGS / f"{name}.yaml", list(changes))


def guarded(**gains):
    """Return case 1 with barriers."""
    return case("paper/case1_guarded", *(f"elements.range.{k}={v}" for k, v in gains.items()))


@pytest.mark.parametrize(
    "config",
    [
        case("paper/case1_permanent", "controller.K_r=[120, 120, 96]"),
        case("examples/ligament_proved"),
    ],
)
def test_no_start_of_scipy_ends_lower(config):
    """Also where a ligament leaves the position free: SciPy minimises over it too."""
    at_rest, energy = configurations(problem_of(config).system), exact(config)
    end = END if energy.free else end_of(energy)
    rng = np.random.default_rng(5)
    pitch = PITCH[1:] if 1 in energy.closed else PITCH
    for angle, least in zip(pitch, least_along_pitch(energy, pitch, end), strict=True):
        lowest = least_energy(at_rest, 1, angle, rng, 6)
        assert least == pytest.approx(lowest, rel=1e-5, abs=1e-5)


def test_a_barrier_is_added():
    plain, closed = exact(case()), exact(guarded(stiffness=7))
    curves = [least_along_pitch(energy, PITCH[1:], END) for energy in (plain, closed)]
    added = 3.5 * np.tan(PITCH[1:]) ** 2
    assert without_barriers(closed).U == plain.U
    np.testing.assert_allclose(curves[1] - curves[0], added, rtol=1e-9, atol=1e-9)


def test_the_curve_ends_at_a_stop():
    energy = exact(case("examples/stop"))
    curve = least_along_pitch(energy, np.array([-0.91, -0.9, 0.0, 0.9, 0.91]), END)
    np.testing.assert_array_equal(np.isinf(curve), [True, False, False, False, True])
