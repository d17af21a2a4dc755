"""What both engines share between switches: one code for all modes, and switches found late."""

import itertools

import numpy as np
from support.switching import INERTIA, TIGHT, data, guard, ligament, problem

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.run import MUTED, HeyokaRun
from rbstab.integrate.straight_line.equations import _code, forget_codes
from rbstab.integrate.switching.phase import Phases


def test_one_code_serves_all_modes():
    """A mode is an input of the code even if it is zero: making a code takes long."""
    forget_codes()
    phases = Phases(problem(data({"a": ligament(-1.0), "b": ligament(1.0)})))
    y = np.concatenate([np.full(12, 0.1), np.zeros(2)])
    rates = {
        tuple(phases.of(modes).audited_rates(y).tolist())
        for modes in itertools.product((0.0, 1.0), repeat=4)
    }
    for modes in itertools.product((0.0, 1.0), repeat=4):
        phases.of(modes).margins(y, 0.0)
    # That of the event functions, and that of the rates.
    assert _code.cache_info().misses == 2
    # Slack lines have no force, whether they are beyond the toe or not: three modes for each.
    assert len(rates) == 3 * 3


def test_code_of_each_mode_is_the_equations():
    phases = Phases(problem(data({"a": ligament(-1.0, damping=2.0), "b": guard("stiff", 9.0)})))
    y = np.concatenate([np.random.default_rng(1).normal(size=12), np.zeros(2)])
    for modes in itertools.product((0.0, 1.0), repeat=4):
        phase = phases.of(modes)
        expected = phase.system.audited_rates(y)
        np.testing.assert_allclose(phase.audited_rates(y), expected, atol=1e-12)
        assert phase.signs.tolist() == [2 * mode - 1 for mode in modes]


def test_a_switch_that_heyoka_misses_is_found_by_its_margin(monkeypatch):
    """Its first event is hidden: the step is repeated with shorter steps, up to the switch."""
    spin, soft, k = 1.3, 0.3, 40.0
    config = data(
        {"soft": guard("stiff", k, soft)},
        {"angular_velocity": [0, spin, 0]},
        {"duration": 0.6, "samples": 7, "engine": "heyoka"} | TIGHT["heyoka"],
    )
    begin = HeyokaRun.begin

    def hidden(self):
        begin(self)
        self.integrator.pars[-2:] = MUTED

    monkeypatch.setattr(HeyokaRun, "begin", hidden)
    run = HeyokaRun(problem(config), None, Deadline(60.0))
    trajectory = run.result()
    assert trajectory.status == "completed"
    w, t = np.sqrt(k / INERTIA), trajectory.times
    inside = soft + spin / w * np.sin(w * (t - soft / spin))
    expected = np.where(t < soft / spin, spin * t, inside)
    np.testing.assert_allclose(trajectory.states[:, 1], expected, atol=1e-11)
    assert run.driver.count == 1
