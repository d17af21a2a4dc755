"""Which starts are proved to converge, and how they are divided."""

import math
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.paper_runs import paper_config
from support.valleys import TWO_VALLEYS

import rbstab
from rbstab.config.build import start_of
from rbstab.config.numbers import replaced
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.experiment.convergence.many_motions import Motions
from rbstab.experiment.proof import prove
from rbstab.experiment.start_sets import prove_starts as module
from rbstab.experiment.start_sets.prove_starts import prove_starts
from rbstab.processes import workers
from rbstab.proof.motion.motion import Followed


def two_valleys(speed):
    return rbstab.load_config(TWO_VALLEYS | {"initial": {"angular_velocity": [speed, 0, 0]}})


def proved(config, *texts, **options):
    return prove_starts(config, tolerances_of(config, texts), prove(config), **options)


def motions_of(config, tolerances, part, count=3):
    """Yield the time and the states of motions from starts of a part, from its time on."""
    rng = np.random.default_rng(1)
    system = enclosed_system(config, lambda values: values)
    low, high = np.array(part.low), np.array(part.high)
    points = [low, high, *(low + (high - low) * rng.random((count, len(low))))]
    for z in points:
        numbers = {
            path: float(tolerance.middle) + float(tolerance.radius) * x
            for tolerance, x in zip(tolerances, z.tolist(), strict=True)
            for path in tolerance.entry.paths
        }
        start = start_of(replaced(config, numbers), system)
        motion = solve_ivp(
            lambda _, y: system.rates(y),
            (0, part.time + 20.0),
            start,
            t_eval=[part.time, part.time + 20.0],
            method="DOP853",
            rtol=1e-11,
            atol=1e-11,
        )
        yield system, motion.y.T


def check_motions(config, proof, *texts):
    """Check the claims about each part: v at its time, and the rest state in the end."""
    rests = prove(config).states
    for part in proof.parts:
        low, high = part.energy
        assert low <= high < part.bound
        rest = rests[part.rest_state - 1]
        for system, (then, last) in motions_of(config, tolerances_of(config, texts), part):
            v = system.observe(then).energy.sum() - rest.energy
            assert low - 1e-6 <= v <= high + 1e-6
            assert last[:3] == pytest.approx(rest.orientation, abs=0.02)


def check_cover(proof, variables):
    """Check that parts are disjoint boxes with dyadic bounds, and return their exact volume."""
    volume = Fraction(0)
    for part in proof.parts:
        assert len(part.low) == len(part.high) == variables
        sides = [Fraction(b) - Fraction(a) for a, b in zip(part.low, part.high, strict=True)]
        for side, low in zip(sides, part.low, strict=True):
            assert side > 0
            assert (2 / side).denominator == 1
            assert bin(int(2 / side)).count("1") == 1  # a power of two
            assert ((Fraction(low) + 1) / side).denominator == 1
        assert all(-1 <= x <= 1 for x in (*part.low, *part.high))
        volume += math.prod(side / 2 for side in sides)
    for box, other in combinations(proof.parts, 2):
        ends = zip(box.low, box.high, other.low, other.high, strict=True)
        assert any(a_high <= b_low or b_high <= a_low for a_low, a_high, b_low, b_high in ends)
    return volume


def test_starts_inside_need_no_step():
    config = rbstab.load_config(paper_config("free", initial={"angular_velocity": [1, 0, 0]}))
    text = "initial.angular_velocity=±0.5"
    proof = proved(config, text)
    assert (proof.proved, proof.fraction, proof.steps, proof.examined) == (True, 1.0, 0, 1)
    assert (proof.time, proof.why) == (0.0, "")
    (part,) = proof.parts
    assert (part.low, part.high) == ((-1.0,) * 3, (1.0,) * 3)
    # v = ½ Ω'JΩ at Θ = 0, at its exact ends.
    J = np.array(config.body.inertia)
    low, high = part.energy
    most = 0.5 * J @ np.array([1.5, 0.5, 0.5]) ** 2
    assert high >= most > high - 1e-3 - 0.5 * J @ np.array([0.5, 0.5, 0.5]) ** 2
    assert low <= 0.5 * J @ np.array([0.5, 0.0, 0.0]) ** 2
    first = proof.tolerances[0]
    assert (first.key, first.low, first.high) == ("initial.angular_velocity[0]", "0.5", "1.5")
    check_motions(config, proof, text)


def test_starts_of_a_valley_converge_to_its_rest_state():
    config, text = two_valleys(3.0), "initial.angular_velocity[0]=±1"
    proof = proved(config, text)
    assert (proof.proved, proof.rest_states) == (True, (1,))
    assert proof.time > 0
    check_motions(config, proof, text)


def decided(rest_state=1):
    return Convergence(True, rest_state=rest_state, time=0.5, energy=(1.0, 2.0), bound=3.0)


def outcomes(monkeypatch, decide):
    """Decide parts by the bounds of their first states alone, in place of following them."""

    def follow(_, start, *, rests):
        assert not rests  # a wide set may seem to
        low, high = start.models[3:6].range()
        return [decide(np.hstack([low, high]))]

    monkeypatch.setattr(Motions, "follow", follow)


SLOW_START = {"angular_velocity": [1.0, 2.0, 3.0]}
TEXT = "initial.angular_velocity=±1"


def free_config():
    return rbstab.load_config(paper_config("free", initial=SLOW_START))


def widest(bounds):
    return int(np.ptp(bounds, axis=1).argmax())


def test_parts_cover_the_box(monkeypatch):
    """All starts with a part of the box beyond a plane are halved again and again."""

    def decide(bounds):
        (a, _, _), (b, _, _) = bounds.T
        small = np.ptp(bounds, axis=1).max() < 0.6
        if b < 0.9 or a > 0.9 or small:
            return Followed(3, 0.25, decided(1 if b < 0.9 else 2))
        return Followed(2, 0.1, variable=widest(bounds))

    outcomes(monkeypatch, decide)
    proof = proved(free_config(), TEXT)
    assert proof.proved is True
    assert check_cover(proof, 3) == 1
    assert len(proof.parts) > 8
    assert proof.examined == 2 * len(proof.parts) - 1
    assert proof.steps == 3 * len(proof.parts) + 2 * (len(proof.parts) - 1)
    assert (proof.time, proof.why) == (0.25, "")
    assert {part.steps for part in proof.parts} == {3}
    # Each part is where its own starts are: the rest states tell on which side of the plane.
    for part in proof.parts:
        beyond = 1.0 + part.high[0] >= 0.9
        assert part.rest_state == 1 + beyond


def test_the_limit_of_parts_is_kept(monkeypatch):
    progress: list[tuple[float, int]] = []

    def decide(bounds):
        undecided = bounds[0, 0] <= 1.3 <= bounds[0, 1]
        return Followed(1, 0.1, variable=0) if undecided else Followed(1, 0.1, decided())

    outcomes(monkeypatch, decide)
    for limit, least in ((0, 0), (3, 1), (9, 7)):
        progress.clear()
        monkeypatch.setattr(module, "MAX_PARTS", limit)
        proof = proved(free_config(), TEXT, progress=lambda *now: progress.append(now))
        assert proof.proved is None
        assert least <= len(proof.parts) <= limit
        assert proof.why == f"more than {limit} parts would be needed"
        assert check_cover(proof, 3) == Fraction(proof.fraction) < 1
        assert len(progress) == proof.examined
        assert [now[0] for now in progress] == sorted(now[0] for now in progress)


def test_parts_that_are_given_up_count(monkeypatch):
    """Nothing more is done for them, and the whole is not proved."""

    def decide(bounds):
        if bounds[0, 1] < 1.01:
            return Followed(500, 0.7)
        return Followed(1, 0.1, decided()) if bounds[0, 0] > 0.99 else Followed(1, 0.1, variable=0)

    outcomes(monkeypatch, decide)
    proof = proved(free_config(), TEXT)
    assert (proof.proved, proof.fraction, proof.examined) == (None, 0.5, 3)
    assert proof.why == "v is too large after 500 steps, at t = 0.7 s"


def test_a_broken_pool_of_workers_loses_nothing(monkeypatch):
    """What the workers have not done is done here, in the same order."""
    from concurrent.futures import Future
    from concurrent.futures.process import BrokenProcessPool
    from contextlib import contextmanager

    class Pool:
        """A pool whose first task succeeds, and whose worker then dies."""

        def __init__(self) -> None:
            self.submitted = 0

        def submit(self, function, part):
            future: Future[Followed] = Future()
            self.submitted += 1
            if self.submitted == 1:
                future.set_result(function(part))
            else:
                future.set_exception(BrokenProcessPool())
            return future

    @contextmanager
    def pool(_count, set_up, *given):
        set_up(*given)
        yield Pool()

    def decide(bounds):
        return (
            Followed(1, 0.1, decided()) if np.ptp(bounds[0]) < 0.6 else Followed(1, 0.1, variable=0)
        )

    outcomes(monkeypatch, decide)
    alone = proved(free_config(), TEXT)
    monkeypatch.setattr(workers, "worker_pool", pool)
    with_workers = proved(free_config(), TEXT, processes=4)
    assert with_workers.model_copy(update={"seconds": alone.seconds}) == alone
    assert len(with_workers.parts) == 4
