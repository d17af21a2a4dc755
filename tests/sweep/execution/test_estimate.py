"""Protects the estimate of a sweep's time, with engines of known cost and a simulated clock."""

from pathlib import Path

import pytest
import yaml
from support.sweeps import plan_of

from rbstab.config.load import plain_data
from rbstab.sweep.execution import estimate as module
from rbstab.sweep.execution.estimate import CALIBRATION_TIME, estimate
from rbstab.sweep.members.engine import Shard
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs import motions

VARIANTS = Path(__file__).parents[3] / "configs" / "sweeps" / "variants.yaml"

NAMES = ["free", "permanent", "visco-elastic", "embedded", "sliding"]


class Clock:
    """A simulated clock, advanced by the engines alone."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class TimedEngine:
    """An engine that computes nothing and advances the clock by known times, s.

    Args:
        plan: The plan.
        clock: The clock that it advances.
        cost: Returns the time of a member from its number.
        call: The additional time of each call.
        compiling: The additional time of the first member of a variant.
    """

    def __init__(self, plan, clock, cost, call=0.0, compiling=0.0):
        self.plan, self.clock, self.cost = plan, clock, cost
        self.call, self.compiling = call, compiling
        self.compiled, self.calls = set(), []

    def compute(self, start, stop):
        assert 0 <= start < stop <= self.plan.members
        self.calls.append((start, stop))
        self.clock.now += self.call + sum(map(self.cost, range(start, stop)))
        new = {variant_of(self.plan, member) for member in (start, stop - 1)} - self.compiled
        self.clock.now += self.compiling * len(new)
        self.compiled |= new
        return Shard({})


def variant_of(plan, member):
    values = plan.values(member, member + 1, ["controller.variant"])
    return plan.variant_of({key: column[0] for key, column in values.items()})


@pytest.fixture(autouse=True)
def single_run_members(monkeypatch):
    """Replace single runs by calls that take no time; the list of their members."""
    members = []

    class Single:
        def __init__(self, *_):
            pass

        def compute(self, start, stop):
            assert stop == start + 1
            members.append(start)

    monkeypatch.setattr(module, "SingleRuns", Single)
    return members


def estimated(plan, cost, threads=1, **more):
    """Estimate a whole plan; return the estimate, the engine and the time it took, s."""
    clock = Clock()
    engine = TimedEngine(plan, clock, cost, **more)
    begin = clock.now
    found = estimate(plan, plan.members, lambda _: engine, threads, clock)
    return found, engine, clock.now - begin


def blocks():
    """Return a plan with 1000 members of each variant, one variant after the other."""
    return load_plan(VARIANTS, ("integration.engine=heyoka",))


def alternating():
    """Return a plan whose members cycle through five variants."""
    base = yaml.safe_load(VARIANTS.read_text())["base"]
    vary = {"body.mass": {"linspace": [30, 50, 400]}, "controller.variant": {"values": NAMES}}
    return load_plan({"title": "Side by side", "base": base, "vary": vary})


PLANS = {"blocks": blocks, "alternating": alternating}


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize("slow", NAMES)
def test_no_variant_is_forgotten(plan, slow):
    """The estimate is right for each choice of one variant that is a thousand times slower."""
    plan = PLANS[plan]()
    costs = dict.fromkeys(NAMES, 1e-4) | {slow: 0.1}
    found, _, _ = estimated(plan, lambda k: costs[variant_of(plan, k)])
    # A fifth of the members takes nearly all of the time.
    assert found.seconds == pytest.approx(plan.members * (0.2 * 0.1 + 0.8e-4), rel=0.15)


def test_members_all_over_the_plan_count():
    """Members after the first third of the plan are a hundred times slower."""
    plan = plan_of(6000)
    found, _, _ = estimated(plan, lambda k: 0.01 if k >= 2000 else 1e-4)
    assert found.seconds == pytest.approx(4000 * 0.01 + 2000 * 1e-4, rel=0.2)


def test_what_is_paid_once_is_not_counted_for_all():
    """Neither compilation nor the cost of a call scales with the number of members."""
    plan = plan_of(60_000)
    found, engine, _ = estimated(plan, lambda _: 2e-5, call=5e-3, compiling=20.0)
    assert found.seconds == pytest.approx(60_000 * 2e-5, rel=0.35)
    assert max(stop - start for start, stop in engine.calls) >= 1000


@pytest.mark.parametrize("cost", [1e-5, 1e-3, 0.02, 0.3, 1.4])
@pytest.mark.parametrize("plan", PLANS)
def test_a_calibration_is_short(plan, cost):
    plan = PLANS[plan]()
    found, _, taken = estimated(plan, lambda _: cost)
    # Two members of each variant always run, and a started batch runs to its end.
    assert taken <= 2 * CALIBRATION_TIME + 2 * 5 * cost
    assert found.seconds == pytest.approx(plan.members * cost)


def test_members_that_take_long_are_few_and_that_is_said():
    plan = blocks()
    found, engine, _ = estimated(plan, lambda _: 50.0)
    assert len(engine.calls) == 10
    assert all(stop == start + 1 for start, stop in engine.calls)
    assert sorted({variant_of(plan, start) for start, _ in engine.calls}) == sorted(NAMES)
    assert found.calibrated == 1
    assert found.seconds == pytest.approx(5000 * 50.0)
    fast, _, _ = estimated(plan, lambda _: 1e-4)
    assert fast.calibrated >= 100


@pytest.mark.parametrize("members", [1, 2, 3, 7])
def test_short_plans(members):
    plan = plan_of(members)
    found, _, _ = estimated(plan, lambda _: 0.25, threads=16)
    # No more threads work than there are members.
    assert found.seconds == pytest.approx(0.25)


def test_threads_and_what_is_done():
    plan = plan_of(1000)
    clock = Clock()
    engine = TimedEngine(plan, clock, lambda _: 0.01)
    assert estimate(plan, 400, lambda _: engine, 4, clock).seconds == pytest.approx(1.0)
    nothing = estimate(plan, 0, lambda _: pytest.fail("an engine was made"), 4, clock)
    assert (nothing.seconds, nothing.check_seconds, nothing.calibrated) == (0.0, 0.0, 0)


def test_the_comparison_is_that_of_the_variants_that_are_compared(monkeypatch):
    """Four members are compared, one of each variant; sliding members are left out."""
    plan, clock, members = blocks(), Clock(), []

    class Single:
        def __init__(self, given, name):
            assert (given, name) == (plan, "scipy")

        def compute(self, start, _):
            members.append(start)
            clock.now += 2.0

    monkeypatch.setattr(module, "SingleRuns", Single)
    engine = TimedEngine(plan, clock, lambda _: 1e-4)
    found = estimate(plan, plan.members, lambda _: engine, 1, clock)
    assert found.check_seconds == pytest.approx(4 * 2.0)
    assert sorted(variant_of(plan, member) for member in members) == sorted(NAMES[:-1])


def test_scipy_is_not_compared_with_itself(single_run_members):
    plan = plan_of(50, base=plain_data(plan_of().base_of("visco-elastic")))
    assert plan.engine == "scipy"
    found, _, _ = estimated(plan, lambda _: 0.01)
    assert found.check_seconds == 0.0
    assert single_run_members == []


@pytest.mark.parametrize(("limits", "share"), [({"steps": 9}, 1.0), ({"members": 50}, 0.05)])
def test_proofs_are_timed_with_some_of_their_members(monkeypatch, limits, share):
    plan = plan_of(1000, prove={"motion": limits})
    clock = Clock()
    proved: list[int] = []

    def prove(_, start, stop):
        assert plan.prove is not None
        assert plan.prove.selected(start, stop, 1000).all()
        # The first one proves the rest states.
        clock.now += 0.5 * (stop - start) if proved else 100.0
        proved.extend(range(start, stop))

    monkeypatch.setattr(motions, "motion_columns", prove)
    engine = TimedEngine(plan, clock, lambda _: 0.0)
    found = estimate(plan, 1000, lambda _: engine, 2, clock)
    assert found.seconds == pytest.approx(1000 * share * 0.5 / 2)
    # Members that are all enclosed are timed as a block in the middle of the plan.
    assert 3 < len(proved) < 20 if share < 1.0 else proved[1:] == list(range(468, 532))
    assert found.bytes > estimate(plan_of(1000), 1000, lambda _: engine, 2, clock).bytes
