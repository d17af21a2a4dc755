"""Protects the extremes of members: any number of samples gives those of very many samples."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.paper_runs import paper_config

from rbstab.analysis import extrema
from rbstab.config.build import problem_of
from rbstab.integrate.heyoka.ensemble import Ensemble
from rbstab.integrate.heyoka.observed import Observed
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.sweep.members.ensemble import ensemble_engine
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan
from rbstab.systems.quantities import BY_NAME

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
    outcome = columns(translating(samples, engine), engine)
    for member, speed in enumerate((SPEED, -1.0)):
        peaks = outcome["peak_contact_displacement"][member]
        assert peaks == pytest.approx([speed * peak, 0.0, 0.0], rel=1e-5, abs=1e-9)
        assert outcome["peak_time"][member, 0] == pytest.approx(time, abs=1e-3 / w)
        assert outcome["peak_contact_displacement_error"][member] <= 1e-5 * abs(speed * peak)
    assert (outcome["peak_orientation"] < 1e-9).all()


SPIN = {"uniform": [-15, 15]}


def random_spins(samples, engine="heyoka", members=16, keep="summary"):
    """Return a plan of bodies with fast random spins on stiff connectors."""
    gains = {"K_c": [3e5, 2e5, 2e5]}
    base = paper_config("visco-elastic", True, controller=gains, samples=samples, engine=engine)
    keys = [f"initial.angular_velocity[{axis}]" for axis in range(3)]
    drawn = {"design": "random", "members": members, "seed": 5, "keep": keep}
    return load_plan({"base": base, "vary": dict.fromkeys(keys, SPIN), **drawn})


@pytest.fixture(scope="module")
def dense_peaks():
    """The peaks of E, |Θ| and the tilt of `random_spins` from 60,001 samples; times of those of E.

    The tilt φ is that of SciPy's rotations.
    """
    plan = random_spins(2)
    problems = [problem_of(plan.config_of(member)) for member in range(plan.members)]
    times = np.linspace(0.0, 2.0, 60_001)
    ensemble = Ensemble(problems[0].system, 1e-14, times)
    parameters = np.array([parameter_values(problem.system) for problem in problems]).T
    starts = np.array([problem.start for problem in problems]).T
    watched = {name: BY_NAME[name] for name in ("contact_displacement", "orientation")}
    observed = Observed(ensemble.compiled, ensemble.symbolic, watched)
    samples = ensemble.run(parameters, starts).samples
    assert samples is not None
    values = observed.along(parameters, samples, times)
    (E, E_time), (Theta, _) = (
        sampled_peaks(times, np.moveaxis(values[name], 2, 0)) for name in watched
    )
    turns = Rotation.from_euler("XYZ", values["orientation"].reshape(-1, 3)).magnitude()
    tilts, _ = sampled_peaks(times, turns.reshape(plan.members, -1))
    return E.T, np.abs(Theta).T, E_time.T, tilts


def sampled_peaks(times, values):
    """Return the peaks of parabolas through the largest sample and its neighbours, and its time."""
    best = np.clip(np.abs(values).argmax(axis=-1), 1, len(times) - 2)
    before, at, after = (
        np.take_along_axis(values, (best + i)[..., np.newaxis], -1)[..., 0] for i in (-1, 0, 1)
    )
    return at - (after - before) ** 2 / (8.0 * (before - 2.0 * at + after)), times[best]


@pytest.mark.parametrize(
    ("samples", "engine"),
    [
        *((samples, "heyoka") for samples in (11, 21, 51, 201, 401)),
        *((samples, "scipy") for samples in (11, 201)),
    ],
)
def test_any_number_of_samples_gives_the_peaks_of_many(samples, engine, dense_peaks):
    E, Theta, E_time, tilts = dense_peaks
    outcome = columns(random_spins(samples, engine), engine)
    completed = outcome["status"] == STATUSES.index("completed")
    assert completed.sum() > 10
    for name, peaks in (("contact_displacement", E), ("orientation", Theta)):
        values, error = outcome[f"peak_{name}"], outcome[f"peak_{name}_error"]
        # The parabolas are good to some 1e-8, and the tolerance of the runs is as large.
        allowed = 1e-7 * np.abs(peaks).max(axis=1)
        assert (np.abs(values - peaks).max(axis=1) <= error + allowed)[completed].all(), name
        assert (error <= 1e-6 * np.abs(peaks).max(axis=1))[completed].all(), name
    error = outcome["peak_tilt_error"][completed]
    assert (np.abs(outcome["peak_tilt"] - tilts)[completed] <= error + 1e-7).all()
    assert (error <= 1e-6).all()
    assert np.ptp(tilts[completed]) > 0.1
    assert (np.abs(outcome["peak_time"] - E_time) < 1e-3)[completed].all()
    regularity = np.cos(np.minimum(Theta[:, 1], np.pi / 2))
    assert outcome["smallest_regularity"][completed] == pytest.approx(
        regularity[completed], abs=1e-5
    )


SUMMARIES = (
    *("peak_contact_displacement", "peak_orientation", "peak_tilt", "peak_time"),
    *("settling_time", "displacement_settling_time", "energy_residual"),
)


def test_the_number_of_samples_changes_neither_summaries_nor_ends_of_a_batch():
    """Nor do samples that are kept. To the last bit: the steps do not depend on samples."""
    few = columns(random_spins(5), "heyoka")
    assert np.isfinite(few["settling_time"]).any()
    for samples, keep in ((5, "traces"), (401, "summary"), (50, "traces")):
        other = columns(random_spins(samples, keep=keep), "heyoka")
        for name in (*SUMMARIES, "final_orientation", "final_position", "lyapunov_end", "steps"):
            assert few[name].tobytes() == other[name].tobytes(), (samples, name)


def test_the_number_of_samples_changes_no_summary_of_a_single_run():
    """Steps of SciPy end on samples, so they differ within the tolerance."""
    few, some, many = (columns(random_spins(n, "scipy", 3), "scipy") for n in (5, 50, 401))
    assert np.isfinite(few["settling_time"]).any()
    for other in (some, many):
        for name in SUMMARIES[:-1]:
            assert few[name] == pytest.approx(other[name], rel=1e-6, abs=1e-9, nan_ok=True), name


def test_a_step_that_is_too_long_is_divided(monkeypatch):
    """With a loose tolerance, polynomials on steps are not accurate enough: shorter steps are."""
    divided = []
    again = Ensemble.step_again

    def watched(self, parameters, scale, start, times):
        divided.append(times)
        return again(self, parameters, scale, start, times)

    monkeypatch.setattr(Ensemble, "step_again", watched)
    whole = columns(random_spins(11, "heyoka", 4), "heyoka")
    assert not divided
    monkeypatch.setattr(extrema, "RELATIVE", 1e-12)
    finer = columns(random_spins(11, "heyoka", 4), "heyoka")
    assert divided
    for name in ("contact_displacement", "orientation"):
        error = whole[f"peak_{name}_error"]
        assert (finer[f"peak_{name}_error"] <= error).all()
        assert (finer[f"peak_{name}_error"] < error).any()
        change = np.abs(np.abs(whole[f"peak_{name}"]) - np.abs(finer[f"peak_{name}"])).max(axis=1)
        assert (change <= error).all()


def test_a_sliding_member_has_a_peak_with_an_error():
    gains = {"K_s": [20000.0] * 3, "surface": {"slope": 20.0}}
    outcomes = []
    for samples in (201, 801):
        base = paper_config(
            "free",
            controller={"variant": "sliding", **gains},
            duration=0.5,
            samples=samples,
            engine="heyoka",
        )
        plan = load_plan({"base": base, "vary": {"body.mass": {"values": [40.0, 41.0]}}})
        outcomes.append(columns(plan, "heyoka"))
    coarse, fine = outcomes
    for name in ("contact_displacement", "orientation"):
        a, b = (np.abs(outcome[f"peak_{name}"]) for outcome in outcomes)
        errors = coarse[f"peak_{name}_error"] + fine[f"peak_{name}_error"]
        assert not (np.abs(a - b).max(axis=1) > errors + 1e-5 * b.max(axis=1)).any(), (a, b, errors)
