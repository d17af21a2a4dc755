"""Protects the sections of a sweep: any plan and any outcomes of members make a valid report."""

import tracemalloc

import numpy as np
import pytest
from support.configs import VISCO_ELASTIC, plain
from support.made_sweeps import GRID, SPIN, code
from support.sections import check_sections, figures_in, sweep_sections, tables, texts

from rbstab.report.model.document import Cards
from rbstab.report.reading.sources import SweepFile
from rbstab.report.sweeps.sections import sweep_part
from rbstab.report.writers.figure_files import figure_bytes
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.sweep import sweep_to_folder

DRAWN = {
    "body.mass": {"uniform": [1, 2]},
    f"{SPIN}[0]": {"normal": [0, 6]},
    "controller.K_r": {"scale": {"loguniform": [0.1, 10]}},
}
EACH = {"controller.variant": {"each": {"values": ["free", "sliding"]}}} | DRAWN
SINGLE = {"body.mass": {"values": [2]}}

SLIDING = plain(VISCO_ELASTIC)
SLIDING["controller"] |= {"K_s": [1, 1, 1], "surface": "position"}
SLIDING["integration"]["engine"] = "heyoka"

PLANS = {
    "grid": (GRID, {}),
    "curve": ({"body.mass": {"linspace": [1, 2, 30]}}, {}),
    "one": (SINGLE, {}),
    "drawn": (DRAWN, {"design": "random", "members": 700, "seed": 1}),
    "few": (DRAWN, {"design": "latin-hypercube", "members": 2, "seed": 1}),
    "one drawn": (DRAWN, {"design": "sobol", "members": 1, "seed": 1}),
    "each": (EACH, {"design": "random", "members": 350, "seed": 1, "base": SLIDING}),
    "each, one": (EACH, {"design": "random", "members": 1, "seed": 1, "base": SLIDING}),
}


def floats(a, value):
    """Return all columns of real numbers, filled with a value."""
    return {name: np.full_like(a[name], value) for name, c in COLUMNS.items() if c.dtype == "f8"}


def mixed(a):
    rng = np.random.default_rng(len(a["run"]))
    columns = {
        name: rng.choice([-1e300, 0.0, 1e-300, 2.0, np.inf, -np.inf, np.nan], array.shape)
        for name, array in floats(a, 0.0).items()
    }
    return columns | {"status": a["run"] % 7, "convergence": a["run"] % 3}


CASES = {
    "alike": lambda _: {},
    "failed": lambda a: floats(a, np.nan) | {"status": 0 * a["run"] + code("solver failure")},
    "diverged": lambda a: floats(a, np.inf) | {"status": 0 * a["run"] + code("diverged")},
    "left": lambda a: {"status": 0 * a["run"] + code("range left")},
    "unsettled": lambda a: {"settling_time": np.full(len(a["run"]), np.nan)},
    "zeros": lambda a: floats(a, 0.0),
    "mixed": mixed,
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("plan", PLANS)
def test_nothing_breaks(made, plan, case):
    vary, keys = PLANS[plan]
    sections = sweep_sections(made(vary, CASES[case], **keys))
    check_sections(sections)
    assert sections[0].name == "sweep-1"
    rows = tables(sections)["sweep-1-fractions"].rows
    returning = [row[-2 if len(row) < 5 else -4].value for row in rows if row[0].text == "returns"]
    assert not any(returning) or case not in ("failed", "diverged", "left")
    figures = figures_in(sections).values()
    assert len(figures) <= 4
    assert all(len(figure.caption.split()) <= 40 for figure in figures)
    assert not any(isinstance(block, Cards) for block in sections[0].blocks)


@pytest.mark.parametrize("plan", ["grid", "curve", "few", "each"])
def test_figures_can_be_drawn(made, plan):
    vary, keys = PLANS[plan]
    for figure in figures_in(sweep_sections(made(vary, mixed, **keys))).values():
        assert figure_bytes(figure, "svg").startswith(b"<svg")


def test_a_real_sweep_says_what_it_is(tmp_path):
    data = plain(VISCO_ELASTIC)
    data["integration"] |= {"duration": 0.2, "engine": "scipy"}
    vary = {f"{SPIN}[0]": {"linspace": [-4, 4, 3]}, "controller.K_r": {"scale": {"values": [1, 2]}}}
    plan = load_plan({"title": "Real", "base": data, "vary": vary})
    folder = tmp_path / "results" / "real"
    sweep_to_folder(plan, folder, SweepOptions(threads=1))
    sweep = SweepFile(2, "sweep-3", "real", folder / "members.h5")
    sections = sweep_sections(sweep)
    check_sections(sections)
    facts = dict(texts(tables(sections)["sweep-3-facts"]))
    # The title of the report is that of the plan, and the card has the name.
    part = sweep_part(sweep, alone=True)
    assert part.title == "Real"
    assert [section.title for section in part.sections][:2] == [
        "Summary",
        "Effects and distributions",
    ]
    # Among others, each heading has its name.
    among = sweep_part(sweep, alone=False)
    assert [section.title for section in among.sections][:2] == [
        "real: Real",
        "real: effects and distributions",
    ]
    assert among.answer.card.title == "real"
    assert facts["members"] == "3 x 2 = 6"
    assert facts["engine"] == "scipy"
    spins, factors = "linspace [-4, 4, 3]", "base value times values [1, 2]"
    assert facts["varied: initial.angular_velocity[0]"] == f"{spins} (3 values), independently"
    assert facts["varied: controller.K_r"] == f"{factors} (2 values), independently"
    assert facts["command to repeat"] == f"rbstab sweep {folder / 'plan.yaml'} -o again"
    assert len(facts["digest of the results"]) == 64


@pytest.mark.slow
def test_a_million_members_fit_into_memory(made):
    def columns(a):
        size = np.hypot(a["initial_angular_velocity_0"], a["body_mass"])
        return {
            "settling_time": np.where(size < 15, size, np.nan),
            "status": np.where(size > 20, code("range left"), 0),
            "smallest_regularity": np.exp(-size),
            "lyapunov_start": size**2,
        }

    sweep = made(DRAWN, columns, design="random", members=1_000_000, seed=1)
    tracemalloc.start()
    sections = sweep_sections(sweep)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    check_sections(sections)
    assert peak < 700e6
    # The numbers of points and cells do not grow with the number of members.
    for figure in figures_in(sections).values():
        for panel in figure.panels:
            assert sum(np.size(getattr(mark, "values", ())) for mark in panel.marks) <= 256**2
            assert sum(len(getattr(mark, "x", ())) for mark in panel.marks) <= 5000
