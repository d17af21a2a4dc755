"""Protects the peaks of members between samples: any number of samples gives the same peaks."""

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.analysis.peak_search import Samples, find_peaks
from rbstab.analysis.peaks import peaks_at_samples
from rbstab.config.build import problem_of
from rbstab.integrate.heyoka.ensemble.ensemble import Ensemble
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.sweep.members import ensemble_peaks, single_peaks
from rbstab.sweep.members.ensemble import ensemble_engine
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

MASS, STIFFNESS, DAMPING, SPEED = 5.0, 6.0e4, 40.0, 3.0
"""kg, N/m, N s/m and m/s of a body that only translates; its frequency is 110 rad/s."""

ENGINES = {"heyoka": ensemble_engine, "scipy": SingleRuns}


def columns(plan, engine):
    return ENGINES[engine](plan).compute(0, plan.members).outcome


def translating(samples, engine):
    """Return a plan of bodies that oscillate along the first axis in the stabilizer alone."""
    gains = {"K_t": [STIFFNESS] * 3, "L_t": [DAMPING] * 3}
    spin = {"angular_velocity": [0, 0, 0]}
    settings = {"duration": 0.5, "samples": samples, "engine": engine}
    base = paper_config("free", controller=gains, initial=spin, **settings)
    base["body"]["mass"] = MASS
    return load_plan({"base": base, "vary": {"initial.velocity[0]": {"values": [SPEED, -1.0]}}})


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("samples", [3, 11, 21, 51, 201])
def test_a_translation_has_the_peak_of_its_closed_form(samples, engine):
    """The peak of x = V/w e^(-dt) sin wt is where tan wt = w/d."""
    d = DAMPING / (2 * MASS)
    w = np.sqrt(STIFFNESS / MASS - d**2)
    time = np.arctan2(w, d) / w
    peak = np.exp(-d * time) * np.sin(w * time) / w
    found = columns(translating(samples, engine), engine)
    for member, speed in enumerate((SPEED, -1.0)):
        peaks = found["peak_contact_displacement"][member]
        assert peaks == pytest.approx([speed * peak, 0.0, 0.0], rel=1e-5, abs=1e-9)
        assert found["peak_time"][member, 0] == pytest.approx(time, abs=1e-3 / w)
        assert found["peak_contact_displacement_error"][member] <= 1e-5 * abs(speed * peak)
    assert (found["peak_orientation"] < 1e-9).all()


SPIN = {"uniform": [-15, 15]}


def random_spins(samples, engine="heyoka", members=16):
    """Return a plan of bodies with fast random spins on stiff connectors."""
    gains = {"K_c": [3e5, 2e5, 2e5]}
    base = paper_config("visco-elastic", True, controller=gains, samples=samples, engine=engine)
    keys = [f"initial.angular_velocity[{axis}]" for axis in range(3)]
    drawn = {"design": "random", "members": members, "seed": 5}
    return load_plan({"base": base, "vary": dict.fromkeys(keys, SPIN), **drawn})


@pytest.fixture(scope="module")
def dense_peaks():
    """The peaks of E and |Θ| of `random_spins` from 20,001 samples, and the times of those of E."""
    plan = random_spins(2)
    problems = [problem_of(plan.config_of(member)) for member in range(plan.members)]
    times = np.linspace(0.0, 2.0, 20_001)
    ensemble = Ensemble(problems[0].system, 1e-14, times)
    parameters = np.array([parameter_values(problem.system) for problem in problems]).T
    starts = np.array([problem.start for problem in problems]).T
    trajectories = ensemble.run(parameters, starts)
    observed = ensemble.observer.observe(parameters, trajectories)
    E, E_time = peaks_at_samples(times, observed.E, observed.F)
    Theta, _ = peaks_at_samples(times, trajectories.states[:3], observed.Theta_rate)
    return E.T, np.abs(Theta).T, E_time.T


@pytest.mark.parametrize(
    ("samples", "engine"),
    [
        *((samples, "heyoka") for samples in (11, 21, 51, 201, 401)),
        *((samples, "scipy") for samples in (11, 201)),
    ],
)
def test_any_number_of_samples_gives_the_peaks_of_many(samples, engine, dense_peaks):
    E, Theta, E_time = dense_peaks
    found = columns(random_spins(samples, engine), engine)
    completed = found["status"] == STATUSES.index("completed")
    assert completed.sum() > 10
    for name, peaks in (("contact_displacement", E), ("orientation", Theta)):
        values, error = found[f"peak_{name}"], found[f"peak_{name}_error"]
        allowed = np.maximum(1e-5 * np.abs(peaks), 2e-9)
        assert (np.abs(values - peaks) <= allowed)[completed].all(), name
        largest = np.abs(peaks).max(axis=1)
        assert (error <= np.maximum(1e-5 * largest, 1e-9))[completed].all(), name
    assert (np.abs(found["peak_time"] - E_time) < 1e-3)[completed].all()
    regularity = np.cos(np.minimum(Theta[:, 1], np.pi / 2))
    assert found["smallest_regularity"][completed] == pytest.approx(regularity[completed], abs=1e-5)


def test_first_intervals_are_not_integrated_again(monkeypatch):
    """Their finer samples give the same peaks, within the errors of both."""
    base = paper_config("visco-elastic", True, samples=201, engine="heyoka")
    vary = {f"initial.angular_velocity[{axis}]": {"uniform": [-40, 40]} for axis in (0, 1)}
    drawn = {"design": "random", "members": 128, "seed": 1}
    plan = load_plan({"base": base, "vary": vary, **drawn})
    found, begins, divided = columns(plan, "heyoka"), [], []
    run, in_first_interval = Ensemble.run, EnsembleTrajectories.in_first_interval

    def run_again(self, parameters, starts, times=None, begin=None):
        if begin is not None:
            begins.extend(begin.tolist())
        return run(self, parameters, starts, times, begin)

    def first_of(self, members):
        divided.extend(members.tolist())
        return in_first_interval(self, members)

    monkeypatch.setattr(Ensemble, "run", run_again)
    monkeypatch.setattr(EnsembleTrajectories, "in_first_interval", first_of)
    assert columns(plan, "heyoka")["peak_time"].tobytes() == found["peak_time"].tobytes()
    assert divided
    # The second interval is not the first one.
    assert min(begins) == pytest.approx(0.01)
    monkeypatch.setattr(EnsembleTrajectories, "in_first_interval", None)
    monkeypatch.setattr(ensemble_peaks.EnsemblePeaks, "find", without_first(begins))
    again = columns(plan, "heyoka")
    assert min(begins) == 0.0
    for name in ("contact_displacement", "orientation"):
        difference = np.abs(np.abs(found[f"peak_{name}"]) - np.abs(again[f"peak_{name}"]))
        error = found[f"peak_{name}_error"] + again[f"peak_{name}_error"]
        assert (difference.max(axis=1) <= error + 1e-9).all()


def without_first(begins):
    """Return `EnsemblePeaks.find` of trajectories whose first interval is not divided."""
    find = ensemble_peaks.EnsemblePeaks.find
    begins.clear()

    def found(self, parameters, starts, trajectories, observed):
        return find(self, parameters, starts, trajectories._replace(first=None), observed)

    return found


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("most", [11, 21])
def test_the_peaks_of_members_too_fast_to_be_sampled_are_unknown(engine, most, monkeypatch):
    """With 11 or 21 samples at most, the samples do not show all turning points."""
    for module in (ensemble_peaks, single_peaks):
        monkeypatch.setattr(module, "MAX_SAMPLES", most)
    found = columns(random_spins(11, engine, 3), engine)
    for name in ("contact_displacement", "orientation"):
        assert np.isfinite(found[f"peak_{name}"]).all()
        assert np.isnan(found[f"peak_{name}_error"]).all()


def test_more_samples_do_not_change_a_trajectory():
    plan = random_spins(201)
    coarse, fine = columns(plan, "heyoka"), columns(random_spins(801), "heyoka")
    for name in ("final_orientation", "final_position", "lyapunov_end", "steps"):
        assert coarse[name].tobytes() == fine[name].tobytes(), name


def test_peaks_that_the_cubics_show_keep_their_bits():
    times = np.linspace(0.0, 2.0, 401)
    phase = 3.0 * times + np.arange(5)[:, np.newaxis]
    values, rates = np.sin(phase), 3.0 * np.cos(phase)
    found = find_peaks(Samples(times, values[np.newaxis], rates[np.newaxis]))
    value, time = peaks_at_samples(times, values, rates)
    assert found.value[0].tolist() == value.tolist()
    assert found.time[0].tolist() == time.tolist()
    assert (found.error <= 1e-5).all()


@pytest.mark.parametrize("members", [1, 2, 30])
def test_the_peaks_of_a_quantity_do_not_depend_on_other_quantities(members):
    """Few signals are searched together. The last interval is longer, as after a stop."""
    times = np.append(np.linspace(0.0, 2.0, 22), 2.2)
    shift = np.arange(members)[:, np.newaxis]
    curves = [
        (lambda t, w=w: np.sin(w * t + shift), lambda t, w=w: w * np.cos(w * t + shift))
        for w in (3.0, 7.0, 19.0)
    ]

    def samples_of(chosen, t, rows):
        def divide(members, intervals):
            begin, end = t[members, intervals], t[members, intervals + 1]
            return samples_of(chosen, np.linspace(begin, end, 5, axis=1), rows[members])

        values, rates = (
            np.array(
                [[curve(line)[row] for row, line in zip(rows, t, strict=True)] for curve in kind]
            )
            for kind in zip(*chosen, strict=True)
        )
        return Samples(t, values, rates, divide)

    rows = np.arange(members)
    lines = np.broadcast_to(times, (members, len(times)))
    together = find_peaks(samples_of(curves, lines, rows)._replace(times=times))
    for number, curve in enumerate(curves):
        alone = find_peaks(samples_of([curve], lines, rows)._replace(times=times))
        for one, all_of_them in zip(alone, together, strict=True):
            assert one[0].tobytes() == all_of_them[number].tobytes()
    peaks, in_tolerance = np.abs(together.value), together.error <= 1e-5
    assert in_tolerance.all()
    assert peaks == pytest.approx(1.0, abs=2e-5)


def test_a_sliding_member_has_a_peak_with_an_error():
    gains = {"K_s": [20000.0] * 3, "surface": {"slope": 20.0}}
    found = []
    for samples in (201, 801):
        base = paper_config(
            "free",
            controller={"variant": "sliding", **gains},
            duration=0.5,
            samples=samples,
            engine="heyoka",
        )
        plan = load_plan({"base": base, "vary": {"body.mass": {"values": [40.0, 41.0]}}})
        found.append(columns(plan, "heyoka"))
    coarse, fine = found
    for name in ("contact_displacement", "orientation"):
        a, b = (np.abs(one[f"peak_{name}"]) for one in found)
        errors = coarse[f"peak_{name}_error"] + fine[f"peak_{name}_error"]
        assert not (np.abs(a - b).max(axis=1) > errors + 1e-5 * b.max(axis=1)).any(), (a, b, errors)
