"""A boundary layer converges to the exact law as it becomes thinner, at the expected order."""

from dataclasses import replace

import numpy as np
import pytest
from support.sliding import paper_problem, solve_sliding

OFFSET = np.array([0.03, 0.03, -0.04])
WIDTHS = np.array([2e-3, 1e-3, 5e-4, 2.5e-4])


def bounce(offset=OFFSET, **options):
    """Return a run from a point off its anchor, through the few predictable switches."""
    problem = paper_problem(2000, duration=0.2, samples=21, **options)
    start = problem.start.copy()
    start[6:9] += offset
    return replace(problem, start=start)


def slide(duration=0.4, **options):
    """Return a run on s = F + 20E, which the last of the three axes reaches at 0.117 s."""
    return paper_problem(2000, slope=20.0, duration=duration, samples=21, **options)


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def test_off_the_position_by_the_square_of_the_width():
    """A fast crossing of the layer differs from the exact law by a term of order δ².

    Half of the impulse comes before the middle and half after it, and the energies inside and
    outside the layer agree. What remains is a shift of kδ²/F².
    """
    exact = solve_sliding("heyoka", bounce())
    runs = [solve_sliding("heyoka", bounce(layer=width)) for width in WIDTHS]
    errors = [np.abs(run.states - exact.states).max() for run in runs]
    assert orders(errors) == pytest.approx(2.0, abs=0.05)
    assert errors[-1] < 1e-4
    # Into the layer and out of it: two switches for each one of the exact law.
    assert exact.switches.counts[-1].tolist() == [2, 1, 2]
    for run in runs:
        assert run.switches.counts[-1].tolist() == [4, 2, 4]
        assert run.switches.modes[-1].tolist() == exact.switches.modes[-1].tolist()


def test_off_the_slope_by_the_width():
    """In the layer s = -δΛ/K_s with the Λ of the exact law, up to a term of order δ²."""
    widths = 0.05 / 2 ** np.arange(4)
    exact = solve_sliding("heyoka", slide())
    sliding = exact.times > 0.15
    assert (exact.switches.modes[sliding] == 0).all()
    pairs = zip(exact.systems, exact.states, strict=True)
    forces = np.array([system.observe(y).contact_force for system, y in pairs])
    errors, residues = [], []
    for width in widths:
        run = solve_sliding("heyoka", slide(layer=width))
        errors.append(np.abs(run.states - exact.states)[sliding].max())
        s = run.states[:, 9:12] + 20 * run.states[:, 6:9]
        residues.append(np.abs(s + width * forces / 2000)[sliding].max())
        assert (run.switches.modes[sliding] == 0).all()
        assert (np.abs(s[sliding]) < width).all()
    assert orders(errors) == pytest.approx(1.0, abs=0.05)
    assert orders(residues) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("engine", ["heyoka", pytest.param("scipy", marks=pytest.mark.slow)])
def test_the_force_is_a_saturation(engine):
    """The force is -K_s s/δ inside and -K_s sgn s outside, at every sample of both surfaces."""
    seen = set()
    for problem, slope, width in (
        (bounce(layer=0.02), None, 0.02),
        (slide(0.13, layer=0.2), 20.0, 0.2),
    ):
        run = solve_sliding(engine, problem)
        for system, y in zip(run.systems, run.states, strict=True):
            s = y[6:9] if slope is None else y[9:12] + slope * y[6:9]
            expected = -2000 * np.clip(s / width, -1, 1)
            assert system.observe(y).contact_force == pytest.approx(expected, abs=1e-9)
            seen |= set(np.sign(np.trunc(s / width)).tolist())
    assert seen == {-1.0, 0.0, 1.0}
