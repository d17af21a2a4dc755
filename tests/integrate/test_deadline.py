"""The deadline of a run: when it expires, the time reserved for samples, and compilations."""

import numpy as np
from support.problems import bare_system, problem
from support.systems import random_body

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.integrate.heyoka import run
from rbstab.integrate.heyoka.equations import compiled_equations


class Clock:
    """A clock that a test moves."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def test_it_expires_after_its_limit():
    clock = Clock()
    deadline = Deadline(2.0, clock)
    clock.now += 2.0
    assert not deadline.expired()
    assert deadline.remaining() == 0.0
    clock.now += 0.25
    assert deadline.expired()
    assert deadline.remaining() == -0.25
    assert deadline.reason == "stopped after 2 s of wall time"


def test_the_time_to_record_the_samples_is_reserved():
    clock = Clock()
    deadline = Deadline(2.0, clock)
    deadline.recording_time = 0.5
    deadline.samples = 3
    clock.now += 0.5
    assert not deadline.expired()
    clock.now += 0.25
    assert deadline.expired()
    # Recording itself may use the reserved time.
    assert deadline.remaining() == 1.25


def test_a_pause_does_not_count():
    clock = Clock()
    deadline = Deadline(2.0, clock)
    with deadline.paused():
        clock.now += 50.0
    assert not deadline.expired()
    assert deadline.remaining() == 2.0


def slow(compile_system, clock):
    def compiled(*arguments):
        clock.now += 1000.0
        return compile_system(*arguments)

    return compiled


def test_compiling_does_not_count(monkeypatch):
    """The clock stands still but for the compilations, which take 1000 s each."""
    clock = Clock()
    slow_compilation = slow(compiled_equations, clock)
    monkeypatch.setattr(run, "compiled_equations", slow_compilation)
    system = bare_system(random_body(np.random.default_rng(3)), K_r=300.0 * np.eye(3))
    start = np.concatenate([np.zeros(3), [0.1, 0.2, 0.1], np.zeros(6)])
    given = problem(system, start, [0.0, 0.1])
    trajectory = engine("heyoka")(given, None, Deadline(1.0, clock))
    assert trajectory.status == "completed"
    assert clock.now > 1000.0
