"""Protects the list of notable members: near the range's end, near a proved level, failed."""

from types import SimpleNamespace

import numpy as np
from support.made_sweeps import GRID, code
from support.sections import sweep_sections, tables, texts

from rbstab.files.text import shell_word
from rbstab.report.sweeps.notable import notable

X = "initial_angular_velocity_0"


def test_extremes(members):
    """Member 0 has the smallest cos θ2 of those that left, members 19 and 18 of the others."""

    def columns(a):
        left = a[X] < -0.5
        return {
            "smallest_regularity": np.where(left, 1e-3 * (a["run"] + 1), (40 - a["run"]) / 40),
            "status": np.where(left, code("range left"), 0),
            "settling_time": 1 + (a["run"] == 17),
        }

    reasons = notable(members(GRID, columns))
    assert [k for k, why in reasons.items() if why.startswith("smallest cos θ2")] == [19, 18]
    assert [k for k, why in reasons.items() if why == "comes to rest last"] == [17]
    # Of equal values the first members are notable.
    alike = notable(
        members(GRID, lambda a: {"smallest_regularity": 0.5 - 0.2 * (a["run"] % 5 == 2)})
    )
    assert [k for k, why in alike.items() if "cos" in why] == [2, 7]


def test_those_that_failed_and_those_near_the_certified_level(members):
    def columns(a):
        return {
            "lyapunov_start": a["run"] * 10.0,
            "status": np.where(a["run"] >= 18, code("diverged"), 0),
        }

    swept = members(GRID, columns)
    # The energies at rest of made up members are 1 J.
    bounds = {"visco-elastic": 95.0}
    swept.__dict__["_certified"] = SimpleNamespace(bounds=bounds)
    why = notable(swept)
    assert [k for k, text in why.items() if text == "v(0) nearest c*"] == [9, 10]
    assert {18, 19} <= set(why)


def test_a_row_says_what_a_member_is_and_how_it_is_run(made):
    def columns(a):
        return {
            "settling_time": np.where(a["run"] == 13, 2.0, 1.0),
            "lyapunov_start": a["run"],
            "peak_contact_displacement": np.tile([1.0, -9.0, 3.0], (20, 1)),
        }

    sweep = made(GRID, columns)
    sections = sweep_sections(sweep)
    table = tables(sections)["sweep-1-notable"]
    (row,) = (row for row in table.rows if row[1].text == "comes to rest last")
    cells = {head.label: cell for head, cell in zip(table.heads, row, strict=True)}
    assert cells["member"].value == 13
    # Each row has its own command.
    assert all(entry[0].command.endswith(f" --member {entry[0].text}") for entry in table.rows)
    assert (cells["outcome"].text, cells["outcome"].tone) == ("returns", "good")
    assert [cells[k].value for k in ("settling time of v", "v(0)")] == [2.0, 13]
    assert cells["largest |E1|, |E2| or |E3|"].value == 9.0
    assert cells["parameters"].text == (
        "initial angular_velocity[0] = 1; initial angular_velocity[1] = 10"
    )
    plan = sweep.path.parent / "plan.yaml"
    for name in (shell_word(plan), "PLAN.yaml"):
        (section,) = (
            section for section in sweep_sections(sweep) if section.name == "sweep-1-members"
        )
        command = f": rbstab run {name} --member {texts(table)[0][0]}"
        assert str(section.blocks[0]).endswith(command)
        # Without its plan, the folder does not say what to run.
        plan.unlink(missing_ok=True)
