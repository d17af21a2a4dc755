"""Protects `docs/performance.md` and `make bench-peers`: the plain equations agree with rbstab, a
tolerance is chosen by its error, and a program that is missing is named.
"""

import importlib
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from support.documents import ROOT, page, tables

from rbstab.config.build import problem_of

PAGE = page("performance")
MEMBERS = 3


@pytest.fixture(scope="module")
def peers():
    """The modules of the benchmark; the peers' scripts are imported by their bare names."""
    bare = ("equations", "scipy_numpy")
    driver = ("catalogue", "environments", "page", "problem", "process", "rows")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        patch.syspath_prepend(ROOT / "benchmarks" / "peers")
        # The benchmarks read configs by paths from the root.
        patch.chdir(ROOT)
        modules = {name: importlib.import_module(name) for name in bare}
        for name in driver:
            modules[name] = importlib.import_module(f"benchmarks.peers.driver.{name}")
        modules["swept"] = importlib.import_module("benchmarks.swept")
        yield SimpleNamespace(**modules)
    for name in bare:
        del sys.modules[name]


@pytest.fixture(scope="module")
def problem(peers):
    return peers.problem.problem_of_members(MEMBERS)


@pytest.fixture(scope="module")
def reference(peers):
    pytest.importorskip("heyoka")
    return peers.problem.reference_of(MEMBERS)


def test_the_plain_equations_are_those_of_rbstab(peers, problem):
    system = problem_of(peers.swept.plan_of(1).config_of(0)).system
    rates = peers.equations.make_rates(np, problem)
    random = np.random.default_rng(1)
    for _ in range(20):
        state = random.uniform(-1.4, 1.4, 12) * np.repeat([1, 20, 0.5, 5], 3)
        expected = system.rates(state)
        assert rates(0.0, state) == pytest.approx(expected, rel=1e-11, abs=1e-9)


def test_the_plain_script_leads_to_the_same_motion(peers, problem, reference):
    states = peers.scipy_numpy.peer("DOP853", problem)(1e-11, MEMBERS)(True)
    assert peers.problem.largest_error(states, reference) < 1e-8


def test_each_peer_gets_the_members_of_the_sweep(peers, problem):
    plan = peers.swept.plan_of(MEMBERS)
    for member, start in enumerate(problem["starts"]):
        assert start == problem_of(plan.config_of(member)).start.tolist()
    # Peers integrate the first members of a larger plan: these are the same members.
    larger = peers.problem.problem_of_members(10 * MEMBERS)
    assert larger["starts"][:MEMBERS] == problem["starts"]


def test_the_error_is_relative_to_the_largest_length_of_each_vector(peers):
    reference = np.zeros((2, 5, 12))
    reference[:, 0, ::3] = [2.0, 40.0, 0.1, 4.0]
    states = reference.copy()
    states[1, 3, 7] = 1e-4
    assert peers.problem.largest_error(states, reference) == pytest.approx(1e-3)
    states[0, 2, 1] = np.nan
    assert peers.problem.largest_error(states, reference) == np.inf


class FakeProcess:
    """A process whose error is a hundredth of its setting."""

    def __init__(self, reference) -> None:
        self.reference = reference

    def states(self, setting, members):
        return self.reference[:members] * (1 + setting / 100)

    def times(self, setting, members):
        return SimpleNamespace(wall=0.01 + 0.001 * members)


@pytest.mark.parametrize(
    ("ladder", "settings"),
    [
        ((1.0, 1e-3, 5e-5, 1e-5, 9e-7, 1e-9), [5e-5, 9e-7]),
        ((1e-9,), [1e-9, 1e-9]),
        ((1.0, 5e-5, 2e-6), [5e-5, None]),
    ],
)
def test_the_loosest_setting_within_the_limit_is_chosen(peers, ladder, settings):
    reference = np.ones((peers.rows.CHECKED, 5, 12))
    peer = SimpleNamespace(ladder=ladder, largest_batch=512)
    rows = list(peers.rows._settings(FakeProcess(reference), peer, reference))
    assert [row.setting for row in rows] == settings
    for row, target in zip(rows, peers.rows.TARGETS, strict=True):
        reached = ladder[-1] if row.setting is None else row.setting
        assert row.error == pytest.approx(reached / 100, rel=1e-6)
        assert (row.error <= target) == (row.setting is not None)
        # A member takes a millisecond, so the largest batch fits in a second.
        assert row.members == (0 if row.setting is None else 512)


def test_a_peer_runs_as_a_process_of_its_own(peers, problem, reference, tmp_path, monkeypatch):
    monkeypatch.setattr(peers.process, "FOLDER", tmp_path / "peers")
    # Without packages it runs in this environment.
    peer = peers.catalogue.Peer("numpy", "scipy_numpy.py", argument="LSODA")
    process = peers.process.PeerProcess(peer, problem, tmp_path)
    try:
        assert f"numpy {np.__version__}" in process.versions
        states = process.states(1e-11, 2)
        with pytest.raises(peers.process.PeerError, match="ValueError"):
            process.states(-1.0, 2)
        assert process.times(1e-3, 1).wall > 0
    finally:
        process.close()
    assert states.shape == (2, 201, 12)
    assert peers.problem.largest_error(states, reference) < 1e-8


def test_the_page_has_the_tables_of_all_peers(peers):
    place = peers.page.PLACE.search(PAGE)
    assert place is not None
    rates, settings = tables(place[0])
    for table in (rates, settings):
        assert {len(row) for row in table} == {2 + len(peers.rows.TARGETS)}
    assert [row[0] for row in rates[1:]] == [peer.title for peer in peers.catalogue.PEERS]
    assert [row[-1] for row in rates[1:]] == [peer.besides for peer in peers.catalogue.PEERS]
    for title, *cells, _ in rates[1:]:
        for cell in cells:
            stated = re.fullmatch(r"[\d,]+(\.\d+)?", cell)
            assert stated or cell.startswith(("not installed: ", "failed", "not reached")), title
    for title, *cells, _ in settings[1:]:
        for cell, target in zip(cells, peers.rows.TARGETS, strict=True):
            assert cell == "-" or float(cell.rpartition(", ")[2]) <= target, title
