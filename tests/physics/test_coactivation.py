"""A coactivated tie against the published activation, an oscillator, quadrature, a fixed tie."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp
from support.differences import derivative, relative_error
from support.elements import Form, random_element
from support.inputs import AUDIT, LEGS, SINE, driven, value_at
from support.member_plans import drawn
from support.path import random_path
from support.systems import random_body

import rbstab
from rbstab.analysis.linearisation import linearise
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.elements.coactivated import CoactivatedTie
from rbstab.elements.inputs.signals import Leg
from rbstab.experiment.simulate import simulate
from rbstab.experiment.tuning.sensitivities import sensitivities
from rbstab.mechanics.attitude import rotations
from rbstab.mechanics.motion import motion_from_centre
from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.members.single import SingleRuns

ENGINES = ("scipy", "heyoka")
EACH = pytest.mark.parametrize("name", ENGINES)
TIMES = {"activation_time": 0.015, "deactivation_time": 0.06}
MASS, K, L = 2.0, np.diag([900.0, 700.0, 800.0]), np.diag([9.0, 8.0, 7.0])
SIGNALS = {
    "pulse": LEGS["pulse"],
    "ramp": LEGS["ramp"],
    "table": LEGS["table"] | {"values": [0.5, -0.2, 1.0, 0.25]},
    "sine": SINE,
}
REST, SIZE = 0.35, 0.3
UPRIGHT = {"kind": "attitude", "K": [40.0, 30.0, 35.0], "L": [1.0, 1.0, 1.0]}
BALL = {"orientation": [0.1, 0.2, -0.1], "position": [0.05, -0.03, 0.04], "velocity": [0.5, 0.2, 0]}


def muscles(signal, **changes):
    """Return a tie of a point beside the centre."""
    return {
        "kind": "coactivated",
        "point": [0.1, 0.0, -0.2],
        "anchor": [0.1, 0.02, -0.2],
        "K_c": np.diag(K).tolist(),
        "L_c": np.diag(L).tolist(),
        "excitation": REST,
        "amplitude": SIZE,
        "signal": signal,
    } | (TIMES | changes)


def motion(elements, name="scipy", **sections):
    """Return a run of a body that spins on its tie, under its weight."""
    loads = {"gravity": [0, 0, -9.81], "initial": BALL} | sections
    run = simulate(driven({"upright": UPRIGHT} | elements, name, **loads))
    assert run.status == "completed"
    return run


def slope(u, a):
    """Return ȧ as it is printed, with its smoothness 10."""
    f = 0.5 * np.tanh(10 * (u - a))
    up = (f + 0.5) / (TIMES["activation_time"] * (0.5 + 1.5 * a))
    down = (-f + 0.5) / (TIMES["deactivation_time"] / (0.5 + 1.5 * a))
    return (up + down) * (u - a)


def activation(signal, times, start=REST):
    """Return a(t) by an integrator of the scalar equation, from one jump or kink to the next."""
    stops = {0.15, 0.31, 0.51, 0.65, 0.1, 0.4, 0.9} if signal["kind"] != "sine" else set()
    ends, a, values = sorted({*stops, times[-1]}), start, [start]
    for begin, end in zip([0.0, *ends], ends, strict=False):

        def rate(t, y, begin=begin, end=end):
            # The two ends of a leg belong to it.
            inside = np.clip(t, begin + 1e-12, end - 1e-12)
            return slope(REST + SIZE * value_at(signal, inside), y)

        leg = solve_ivp(
            rate, (begin, end), [a], "DOP853", rtol=1e-13, atol=1e-13, dense_output=True
        )
        chosen = times[(times > begin) & (times <= end)].tolist()
        values, a = [*values, *(leg.sol(t)[0] for t in chosen)], leg.y[0, -1]
    return np.array(values)


@EACH
@pytest.mark.parametrize("kind", SIGNALS)
def test_the_activation_is_the_solution_of_the_published_equation(kind, name):
    run = motion({"muscles": muscles(SIGNALS[kind])}, name)
    simulated = REST + run["muscles.rise"][:, 0]
    np.testing.assert_allclose(simulated, activation(SIGNALS[kind], run["time"]), atol=1e-10)
    assert np.ptp(simulated) > 0.1


def test_a_large_rise_and_a_large_fall_take_their_own_time_constants():
    """Far from u: -3a/2 - 2 ln(1 - a) = t/τ_a rising to 1; 2 ln(1/2 + 3a/2)/a falls by t/τ_d."""
    step = {"kind": "table", "times": [0.1, 0.1, 0.4, 0.4], "values": [0, 1, 1, 0]}
    tie = muscles(step, excitation=0.0, amplitude=1.0)
    run = motion({"muscles": tie}, integration={"duration": 0.6, "samples": 2401})
    t, a = run["time"], run["muscles.rise"][:, 0]
    up, down = (t > 0.1) & (a < 0.5) & (t < 0.4), (t > 0.4) & (a > 0.5)
    assert min(up.sum(), down.sum()) > 10
    rise = -1.5 * a[up] - 2 * np.log(1 - a[up])
    np.testing.assert_allclose(rise, (t[up] - 0.1) / 0.015, rtol=2e-4)
    fall = 2 * np.log((0.5 + 1.5 * a[down]) / (2 * a[down]))
    np.testing.assert_allclose(fall, (t[down] - 0.4) / 0.06, rtol=2e-3, atol=2e-3)


@pytest.mark.parametrize("kind", SIGNALS)
def test_energy_balances_and_engines_agree(kind):
    runs = [motion({"muscles": muscles(SIGNALS[kind])}, name) for name in ENGINES]
    for run in runs:
        size = max(np.abs(run["energy"]).max(), np.abs(run["supplied_energy"]).max())
        assert np.abs(run["energy_residual"]).max() < AUDIT * size
        assert np.ptp(run["supplied_energy"]) > 1e-3 * size
        assert run.attributes["verdict"] == "driven"
        checks = dict(zip(run["certificate/check"], run["certificate/verdict"], strict=True))
        assert {checks[c] for c in ("audit", "supply", "derivative")} == {"consistent"}
    for quantity in ("orientation", "angular_velocity", "position", "supplied_energy"):
        np.testing.assert_allclose(runs[0][quantity], runs[1][quantity], atol=1e-9)


@EACH
def test_what_is_supplied_is_half_the_rate_of_the_activation_times_the_stretch(name):
    """∫½ ȧ e'K_c e dt by Simpson's rule, from the positions and the printed equation alone."""
    run = motion({"muscles": muscles(SINE)}, name, integration={"samples": 4001})
    tie, t = muscles(SINE), run["time"]
    e = run["position"] + rotations(run["orientation"]) @ tie["point"] - tie["anchor"]
    a = activation(SINE, t)
    power = 0.5 * slope(REST + SIZE * value_at(SINE, t), a) * np.einsum("ti,ij,tj->t", e, K, e)
    supplied = simpson(power, x=t)
    assert abs(supplied) > 0.01
    assert relative_error(run["supplied_energy"][-1], supplied, supplied) < 1e-8
    stored = 0.5 * a * np.einsum("ti,ij,tj->t", e, K, e)
    part = run["part"].tolist().index("muscles")
    np.testing.assert_allclose(run["energy"][:, part], stored, atol=1e-9)


@EACH
def test_the_natural_frequency_follows_the_activation(name):
    """mẍ + a(l ẋ + k x) = 0 along x: zeros of x are half a period apart, before and after."""
    rise = {"kind": "table", "times": [2.0, 2.0], "values": [0.0, 1.0]}
    tie = muscles(rise, point=[0, 0, 0], anchor=[0, 0, 0], L_c=[0.02] * 3, amplitude=0.6)
    start = {"position": [0.05, 0, 0]}
    sections = {"initial": start, "gravity": [0, 0, 0]}
    sections["integration"] = {"duration": 5.0, "samples": 5001}
    run = motion({"muscles": tie}, name, **sections)
    t, x, v = run["time"], run["position"][:, 0], run["velocity"][:, 0]
    for a, first, last in ((REST, 0.0, 2.0), (REST + 0.6, 3.0, 5.0)):
        rows = np.flatnonzero((x[:-1] * x[1:] < 0) & (t[:-1] >= first) & (t[1:] <= last))
        # A zero between two samples, by the tangent and the curvature at the first.
        bend = -a * (K[0, 0] * x[rows] + 0.02 * v[rows]) / MASS
        step = -x[rows] / v[rows]
        step = -(x[rows] + 0.5 * bend * step**2) / v[rows]
        zeros = t[rows] + step
        frequency = np.pi / np.diff(zeros).mean()
        damped = np.sqrt(a * K[0, 0] / MASS - (a * 0.02 / (2 * MASS)) ** 2)
        assert frequency == pytest.approx(damped, rel=1e-6)


@EACH
@pytest.mark.parametrize("constant", [True, False])
def test_with_a_constant_excitation_it_is_the_visco_elastic_tie(constant, name):
    """Of K = u K_c and L = u L_c: from the signal, or without one that acts."""
    level = {"amplitude": SIZE, "initial_rise": [SIZE]} if constant else {"amplitude": 0.0}
    a = REST + SIZE if constant else REST
    tie = muscles({"kind": "constant"} if constant else SINE, **level)
    fixed = {"kind": "visco-elastic", "point": tie["point"], "anchor": tie["anchor"]}
    fixed |= {name: [a * entry for entry in tie[name]] for name in ("K_c", "L_c")}
    run, expected = motion({"tie": tie}, name), motion({"tie": fixed}, name)
    for quantity in ("orientation", "angular_velocity", "position", "energy", "dissipation"):
        np.testing.assert_allclose(run[quantity], expected[quantity], atol=1e-11)
    assert not run["supplied_energy"].any()
    if not constant:
        # Without the signal it also rests as that tie: m g/(u K_c) below its anchor, and lower.
        np.testing.assert_allclose(run["rest_position"], expected["rest_position"], atol=1e-9)
        np.testing.assert_allclose(run["lyapunov"], expected["lyapunov"], atol=1e-9)


def test_the_eigenvalues_are_those_without_the_signal():
    """Of the body on the tie of u_0, and the rate of the activation at rest: half of each way."""
    fixed = {"kind": "visco-elastic", "point": [0.1, 0, -0.2], "anchor": [0.1, 0.02, -0.2]}
    fixed |= {"K_c": (REST * np.diag(K)).tolist(), "L_c": (REST * np.diag(L)).tolist()}
    spectra = []
    for tie in (fixed, muscles({"kind": "constant"})):
        elements = {"upright": UPRIGHT, "tie": tie}
        system = problem_of(load_config(driven(elements, gravity=[0, 0, -9.81]))).system
        rest = nearest_rest_state(system)
        spectra.append(linearise(system, rest.motion, rest.element_states).eigenvalues)
    z = 0.5 + 1.5 * REST
    rate = -0.5 / (TIMES["activation_time"] * z) - 0.5 * z / TIMES["deactivation_time"]
    expected, values = np.sort_complex([*spectra[0], rate]), np.sort_complex(spectra[1])
    np.testing.assert_allclose(values, expected, rtol=1e-9)


FORM = Form(fields=lambda rng: {"name": "one", "signal": Leg(*rng.uniform(0, 1, 3))} | TIMES)


def test_power_on_the_body_is_stored_dissipated_or_supplied(rng):
    """For any tie, activation and motion: Ė = -f'ṗ - lost + supplied, by a difference of E."""
    for _ in range(20):
        tie, path = random_element(rng, CoactivatedTie, FORM), random_path(rng, random_body(rng))
        start, rise = motion_from_centre(path.body, np.zeros(3), path.Z()), rng.uniform(0, 1, 1)
        rates = tie.rates(start, rise)

        def stored(t, tie=tie, path=path, rise=rise, rates=rates):
            motion = motion_from_centre(path.body, np.zeros(3), path.Z(t))
            return tie.stored(motion, rise + t * rates)

        wrench = tie.wrench(start, rise)
        taken = -(wrench.force @ start.V + wrench.couple @ start.Omega)
        lost, supplied = tie.dissipated(start, rise), tie.supplied(start, rise)
        scale = abs(taken) + lost + abs(supplied)
        power = derivative(stored, 5e-4)
        assert relative_error(power, taken - lost + supplied, scale) < 1e-9


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "excitation": ({"amplitude": 0.7}, "muscles.signal: makes the excitation 1.05"),
    "below zero": ({"amplitude": -0.4}, "muscles.signal: makes the excitation -0.05"),
    "noise": ({"signal": LEGS["noise"]}, "muscles.signal: makes the excitation -inf"),
    "start": ({"initial_rise": [0.7]}, "initial_rise: makes the activation at the start 1.05"),
    "rest": ({"excitation": 1.5}, "muscles.excitation: is 1.5 (expected a number at most 1)"),
    "time": ({"activation_time": 0.0}, "muscles.activation_time: is 0 (expected a number"),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_activation_outside_of_0_to_1_is_refused(case):
    changes, words = WRONG[case]
    tie = muscles(SIGNALS["pulse"]) | changes
    with pytest.raises(ConfigError) as caught:
        load_config(driven({"muscles": tie}))
    assert words in str(caught.value)


def test_nothing_is_proved_and_the_reason_is_said():
    tie = muscles(SIGNALS["ramp"])
    controller = {"variant": "free", "K_t": [30.0] * 3, "L_t": [3.0] * 3}
    config = load_config(driven({"muscles": tie}, controller=controller))
    proof = rbstab.prove(config)
    assert not proof.states
    assert "an element supplies power" in proof.outcome


def test_derivatives_know_the_time_constants_and_when_the_muscles_begin():
    """After a step from rest r = g((t - t_0)/τ): ∂r/∂t_0 = -ȧ, and Σ τ ∂r/∂τ = -(t - t_0) ȧ."""
    pytest.importorskip("heyoka")
    tie = muscles({"kind": "pulse", "start": 0.9, "duration": 5.0})
    data: Any = driven({"upright": UPRIGHT, "muscles": tie}, gravity=[0, 0, -9.81], initial=BALL)
    derived = sensitivities(load_config(data))
    rows = {
        entry.key.removeprefix("elements.muscles."): k for k, entry in enumerate(derived.entries)
    }
    by = derived.derivatives[:, derived.column("final.muscles.rise[0]")]
    rate = slope(REST + SIZE, REST + simulate(data)["muscles.rise"][-1, 0])
    assert rate > 0.01
    assert by[rows["signal.start"]] == pytest.approx(-rate, rel=1e-9)
    scaled = sum(value * by[rows[key]] for key, value in TIMES.items())
    assert scaled == pytest.approx(-0.1 * rate, rel=1e-9)
    # The motion feels it too: against runs with other numbers.
    by = derived.derivatives[:, derived.column("final.velocity[2]")]
    for key, h in (("excitation", 1e-5), ("amplitude", 1e-5), ("activation_time", 1e-7)):
        ends = [
            simulate(data | {"elements": data["elements"] | {"muscles": tie | {key: tie[key] + d}}})
            for d in (h, -h)
        ]
        slopes = (ends[0]["velocity"][-1, 2] - ends[1]["velocity"][-1, 2]) / (2 * h)
        assert by[rows[key]] == pytest.approx(slopes, rel=1e-5)


EXAMPLE = Path(__file__).parents[2] / "configs/examples/coactivation.yaml"


def example(**changes):
    """Return the largest tilt of the example, in degrees, and what is supplied after the knock."""
    changed = [f"elements.muscles.{key}={value}" for key, value in changes.items()]
    run = simulate(load_config(EXAMPLE, [*changed, "integration.samples=4001"]))
    tilts = np.arccos(rotations(run["orientation"])[:, 2, 2])
    supplied = run["supplied_energy"][run["time"] > 0.53]
    return np.degrees(tilts.max()), supplied.max() - supplied[0]


def test_the_example_says_its_numbers():
    """In its comment, and in the section of the page."""
    page = (EXAMPLE.parents[2] / "docs/elements.md").read_text(encoding="utf-8")
    runs = [example(), example(amplitude=0.0), example(**{"signal.start": 0.55})]
    for text in (EXAMPLE.read_text(encoding="utf-8"), page):
        assert all(f"{tilt:.1f}°" in text for tilt, _ in runs)
        assert f"{runs[2][1]:.1f} J" in text
    assert runs[1][1] == 0


def test_members_in_a_batch_rest_as_single_runs_do(monkeypatch):
    """The batch descends from the last sample with the activation at rest too."""
    tie = muscles(SINE | {"frequency": 3.0})
    base = driven(
        {"muscles": tie, "upright": UPRIGHT}, "heyoka", gravity=[0, 0, -9.81], initial=BALL
    )
    vary = {
        "elements.muscles.excitation": {"uniform": [0.4, 0.6]},
        "elements.muscles.amplitude": {"uniform": [-0.3, 0.3]},
        "initial.velocity[0]": {"uniform": [-1.0, 1.0]},
    }
    plan = drawn(base, vary, members=8)
    alone = SingleRuns(plan, "scipy").compute(0, 8).outcome
    # No member needs a run, or a descent, of its own.
    monkeypatch.setattr("rbstab.sweep.members.ensemble.lyapunov_zero", None)
    nobody: Any = None
    batch = EnsembleEngine(plan, nobody).compute(0, 8).outcome
    for column in ("rest_orientation", "final_orientation", "lyapunov_start", "lyapunov_end"):
        np.testing.assert_allclose(batch[column], alone[column], atol=1e-7)
    assert not batch["rest_unstable"].any()
    assert np.isfinite(batch["rest_orientation"]).all()
