"""`integration.time_limit` holds for all variants and both engines, also on hard problems.

Most tests use a clock that counts work, so they do not depend on the machine. The last ones use the
wall clock.
"""

import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from support.configs import BY_VARIANT, plain
from support.problems import each_engine

from rbstab.analysis import configuration
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment import record, simulate
from rbstab.experiment.simulate import simulate_problem
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine as engine_of
from rbstab.integrate.status import RunStatus
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.systems.system import System

UNIT = 1e-3
"""s of the counting clock for one piece of work."""

LATE = 0.4
"""s: 400 pieces of work of the counting clock. The most work between two checks of the deadline is
to locate the events of a step with held axes, and to choose the modes of three axes."""

LAWS: dict[str, dict[str, Any]] = {
    "s = E": {"surface": "position"},
    "s = E with sticking": {"surface": "position", "stick_energy": 10.0},
    "s = F + κE": {"surface": {"slope": 20.0}},
    "layer of E": {"surface": "position", "law": {"boundary_layer": 1e-3}},
    "layer of F + κE": {"surface": {"slope": 20.0}, "law": {"boundary_layer": 1e-3}},
    "implicit E": {"surface": "position", "law": {"implicit": 1e-4}},
    "implicit F + κE": {"surface": {"slope": 20.0}, "law": {"implicit": 1e-4}},
}


def sliding(law, K_s=20000.0):
    config = plain(BY_VARIANT["free"])
    config["controller"] |= {"variant": "sliding", "K_s": [K_s, K_s, K_s], **law}
    return config


VARIANTS: dict[str, dict[str, Any]] = {
    **{name: plain(text) for name, text in BY_VARIANT.items()},
    **{name: sliding(law) for name, law in LAWS.items()},
}

# Each change makes a run that takes far longer than its limit.
HARD = {
    "long": ["integration.duration=1e4", "integration.samples=2"],
    "many samples": ["integration.duration=1e4", "integration.samples=100000"],
    "short with many samples": ["integration.duration=1e-9", "integration.samples=100000"],
}


def config_of(variant, engine, *changes, limit=1.0):
    common = [f"integration.engine={engine}", f"integration.time_limit={limit}"]
    return load_config(VARIANTS[variant], [*common, "integration.step_limit=1000000000", *changes])


OF_ENERGIES = (configuration._energies_at, configuration._guards_at)

MUCH_WORK = 20_000
"""More work than any limit of these tests allows."""


class WorkClock:
    """A clock that counts work: evaluations of a system, and looks at the clock.

    heyoka's compiled steps evaluate no system, but each of them is followed by a look. A run that
    does not end fails when it has done `allowed` pieces of work.
    """

    def __init__(self, monkeypatch):
        self.work, self.allowed = 0, MUCH_WORK
        for name in ("rates", "audited_rates", "observe"):
            monkeypatch.setattr(System, name, self._counted(getattr(System, name)))
        by_code = StraightLine.finite_value

        def counted(code, *x):
            # The energies of the search for a rest state take far less time than rates.
            if code._equations not in OF_ENERGIES:
                self._count()
            return by_code(code, *x)

        monkeypatch.setattr(StraightLine, "finite_value", counted)

    def __call__(self):
        self._count()
        return UNIT * self.work

    def _count(self):
        self.work += 1
        assert self.work < self.allowed, "the run goes on after its deadline"

    def _counted(self, evaluate):
        def counted(*arguments):
            self._count()
            return evaluate(*arguments)

        return counted


@pytest.fixture
def clock(monkeypatch):
    """Return a counting clock, which `simulate` uses too; recording a sample is one unit."""
    counting = WorkClock(monkeypatch)
    monkeypatch.setattr(simulate, "Deadline", partial(Deadline, clock=counting))
    monkeypatch.setattr(simulate, "recording_time", lambda _problem: UNIT)
    return counting


@each_engine
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("hard", HARD)
def test_the_motion_ends_at_the_deadline(clock, variant, engine, hard):
    problem = problem_of(config_of(variant, engine, *HARD[hard]))
    compile_first(problem, engine)
    deadline = Deadline(0.5, clock)
    deadline.recording_time = UNIT
    run = engine_of(engine)(problem, None, deadline)
    late = -deadline.remaining() + len(run.times) * UNIT
    if engine == "heyoka" and hard == "short with many samples" and variant in BY_VARIANT:
        # The whole motion is a single step.
        assert run.status is RunStatus.COMPLETED
        return
    assert run.status is RunStatus.TIME_LIMIT
    assert 0.0 < late < LATE
    assert run.times[-1] < problem.times[-1]
    if run.switches is not None:
        assert run.trusted_until is None or np.isnan(run.trusted_until)


def compile_first(problem, engine):
    """Compile before the clock counts; compilations evaluate systems, too."""
    if engine == "heyoka":
        few = replace(problem, times=np.array([problem.times[0], problem.times[0] + 1e-6]))
        engine_of(engine)(few)


def test_one_step_that_spans_all_samples_ends_at_the_deadline(clock):
    """A body at rest: LSODA reaches the end in a few steps, and interpolates all samples."""
    rest = ["initial.angular_velocity=[0, 0, 0]", "integration.method=LSODA"]
    changes = [*rest, "integration.duration=1", "integration.samples=100000"]
    problem = problem_of(config_of("free", "scipy", *changes))
    deadline = Deadline(0.5, clock)
    run = engine_of("scipy")(problem, None, deadline)
    assert run.status is RunStatus.TIME_LIMIT
    assert -deadline.remaining() < LATE
    assert run.times.tolist() == problem.times[: len(run.times)].tolist()
    assert len(run.times) > 100
    assert run.detail.endswith(f" at t = {run.times[-1]:.9g} s")


@each_engine
@pytest.mark.parametrize("K_s", [1e9, 1e300])
@pytest.mark.parametrize("law", LAWS)
def test_a_huge_sliding_force_ends_at_the_deadline(clock, law, engine, K_s):
    changes = [f"controller.K_s=[{K_s},{K_s},{K_s}]", "integration.duration=1e4"]
    problem = problem_of(config_of(law, engine, *changes))
    compile_first(problem, engine)
    deadline = Deadline(0.5, clock)
    run = engine_of(engine)(problem, None, deadline)
    assert -deadline.remaining() < LATE
    assert run.status in {RunStatus.TIME_LIMIT, RunStatus.DIVERGED, RunStatus.SOLVER_FAILURE}


@pytest.mark.parametrize("law", ["s = E", "s = F + κE"])
def test_the_smooth_flow_between_two_switches_obeys_the_step_limit(law):
    """The first switch comes after more steps than are allowed."""
    problem = problem_of(config_of(law, "scipy", "integration.duration=1e4"))
    problem = replace(problem, step_limit=3, rtol=1e-13, times=np.array([0.0, 1e4]))
    run = engine_of("scipy")(replace(problem, diagnosed=False))
    assert run.status is RunStatus.STEP_LIMIT
    assert run.steps == 3


@each_engine
@pytest.mark.parametrize("law", ["s = E", "s = F + κE", "implicit E"])
def test_the_second_run_shares_the_deadline(clock, law, engine):
    """If it is cut short, the trusted time is unknown; the motion is the same."""
    changes = ["integration.duration=0.02", "integration.samples=11"]
    problem = problem_of(config_of(law, engine, *changes))
    compile_first(problem, engine)
    clock.allowed = 10 * MUCH_WORK

    def run(limit, *, diagnosed=True):
        before = clock.work
        deadline = Deadline(limit, clock)
        trajectory = engine_of(engine)(replace(problem, diagnosed=diagnosed), None, deadline)
        return trajectory, UNIT * (clock.work - before)

    _, once = run(1e6, diagnosed=False)
    whole, twice = run(1e6)
    assert twice > 1.5 * once
    assert np.isfinite(whole.trusted_until)
    cut, used = run(once + 0.25 * (twice - once))
    assert used < once + 0.25 * (twice - once) + LATE
    assert used < twice
    assert cut.status is RunStatus.COMPLETED
    assert np.isnan(cut.trusted_until)
    assert cut.states.tobytes() == whole.states.tobytes()
    enough, _ = run(twice + UNIT)
    assert enough.trusted_until == whole.trusted_until


@each_engine
@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "s = F + κE", "implicit E"])
def test_recording_the_samples_is_part_of_the_limit(clock, variant, engine):
    """The motion ends early enough to record its samples; none of them is dropped."""
    config = config_of(variant, engine, *HARD["many samples"])
    problem = problem_of(config)
    compile_first(problem, engine)
    before = clock.work
    result = simulate_problem(config, replace(problem, time_limit=2.0))
    used = UNIT * (clock.work - before)
    assert result.status == "time limit"
    # The certificate evaluates the system at up to 51 samples.
    assert used < 2.0 + LATE + 51 * 25 * UNIT
    assert 2 <= len(result["time"]) < 2000
    assert str(result.attributes["status_detail"]).startswith("stopped after 2 s of wall time")


@pytest.mark.parametrize("variant", ["visco-elastic", "s = F + κE", "s = E"])
def test_samples_that_cannot_be_recorded_in_time_are_dropped(clock, monkeypatch, variant):
    """The machine may become slower after the motion. What is left is the beginning of the run."""
    changes = ["integration.duration=0.4", "integration.samples=401"]
    config = config_of(variant, "heyoka", *changes)
    problem = problem_of(config)
    whole = simulate_problem(config, replace(problem, time_limit=1e6))
    monkeypatch.setattr(simulate, "recording_time", lambda _problem: 0.0)
    integrate = engine_of("heyoka")

    def leave_little_time(problem, progress, deadline):
        trajectory = integrate(problem, progress, Deadline(1e6))
        deadline._end = clock() + 0.1
        return trajectory

    monkeypatch.setattr(simulate, "engine", lambda _name: leave_little_time)
    cut = simulate_problem(config, replace(problem, time_limit=7.0))
    rows = len(cut["time"])
    # One observation and one look for each sample, until 0.1 s and the margin are used up; the
    # search for the rest state that the motion approaches looks a few times, too.
    most = (0.1 + record.RECORDING_MARGIN) / UNIT / 2
    assert most - 12 <= rows <= most + 3
    assert cut.status == "time limit"
    assert cut.attributes["status_detail"] == (
        f"stopped after 7 s of wall time at t = {cut['time'][-1]:.9g} s"
    )
    for name, variable in whole.variables.items():
        if variable.dimensions[:1] == ("time",):
            assert cut[name].tobytes() == variable.data[:rows].tobytes(), name
    if "switch_time" in whole:
        kept = whole["switch_time"] <= cut["time"][-1]
        assert kept.any()
        assert variant != "s = E" or not kept.all()
        assert cut["switch_time"].tobytes() == whole["switch_time"][kept].tobytes()
        assert cut["switch_axis"].tolist() == whole["switch_axis"][kept].tolist()
        assert cut["trusted_until"] <= cut["time"][-1]


# With the wall clock: what the counting clock does not see, such as compiled code and linear
# algebra. The limit is kept to 0.5 s on an idle machine. A machine with several processes on each
# core stops this process for longer than that between two instructions, hence the margin.
MARGIN = 4.0

SHORT = 0.2
"""s: a limit that all of these runs exceed: a hundred thousand samples take up to a second."""

HUGE_FORCE = ["controller.K_s=[1e9,1e9,1e9]", "integration.duration=1e4"]


@pytest.mark.slow
@each_engine
@pytest.mark.parametrize(
    ("variant", "changes"),
    [(variant, HARD["many samples"]) for variant in VARIANTS] + [(law, HUGE_FORCE) for law in LAWS],
)
def test_the_whole_run_ends_in_time(variant, engine, changes):
    config = config_of(variant, engine, *changes, limit=SHORT)
    problem = problem_of(config)
    compile_first(problem, engine)
    begin = time.monotonic()
    result = simulate_problem(config, problem)
    assert time.monotonic() - begin < SHORT + 0.5 + MARGIN
    assert result.status == "time limit"
