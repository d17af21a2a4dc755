"""Protects the list of notable members: at a border, near the range's end, near a proved level."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.made_sweeps import GRID, SPIN, code
from support.printed_paths import words_of
from support.sections import sweep_sections, tables, texts

from rbstab.files.shell_words import shell_word
from rbstab.report.sweeps.borders import border_pairs, notable
from rbstab.report.sweeps.commands import member_command
from rbstab.sweep.proofs.convergence import EnergyBound

X, Y = "initial_angular_velocity_0", "initial_angular_velocity_1"
DRAWN = {"design": "random", "members": 200, "seed": 5}


def test_in_a_grid_neighbours_across_the_border_are_found(members):
    found = members(GRID, lambda a: {"status": np.where(a[X] > 0.5, code("range left"), 0)})
    pairs = border_pairs(found)
    # The border is between spins 0 and 1, whose members differ by four; it has four such pairs.
    assert len(pairs) == 3
    assert set(pairs) <= {(8, 12), (9, 13), (10, 14), (11, 15)}


def test_along_the_fastest_axis_too(members):
    found = members(GRID, lambda a: {"settling_time": np.where(a[Y] < 15, 1.0, np.nan)})
    assert set(border_pairs(found)) <= {(4 * k + 1, 4 * k + 2) for k in range(5)}


def test_the_end_of_a_row_is_no_neighbour_of_the_next(members):
    # Only member 3, the last of the first row, differs: member 4 is far from it.
    found = members(GRID, lambda a: {"status": np.where(a["run"] == 3, code("diverged"), 0)})
    assert set(border_pairs(found)) == {(2, 3), (3, 7)}


def test_variants_are_no_neighbours(members):
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    found = members(vary, lambda a: {"status": a["controller_variant"]})
    assert border_pairs(found) == []


def test_of_drawn_members_the_nearest_two_are_found(members):
    vary = {"body.mass": {"loguniform": [1, 100]}}
    found = members(vary, lambda a: {"status": np.where(a["body_mass"] > 9, 1, 0)}, **DRAWN)
    mass = found.column("body_mass")
    below = int(np.flatnonzero(mass <= 9)[mass[mass <= 9].argmax()])
    above = int(np.flatnonzero(mass > 9)[mass[mass > 9].argmin()])
    assert border_pairs(found)[0] == tuple(sorted((below, above)))


def test_drawn_members_of_one_variant_stay_together(members):
    vary = {
        "controller.variant": {"each": {"values": ["free", "visco-elastic"]}},
        "body.mass": {"uniform": [1, 9]},
        f"{SPIN}[0]": {"normal": [0, 1]},
    }

    def columns(a):
        return {"status": np.where((a["body_mass"] > 5) ^ (a["controller_variant"] == 1), 1, 0)}

    found = members(vary, columns, **DRAWN)
    variant = found.column("controller_variant")
    pairs = border_pairs(found)
    assert len(pairs) == 3
    assert all(variant[a] == variant[b] for a, b in pairs)


def test_of_equal_values_the_first_members_are_notable(members):
    def columns(a):
        return {"smallest_regularity": np.where(a["run"] % 5 == 2, 0.25, 0.5)}

    found = notable(members(GRID, columns))
    assert [number for reason, number in found if "cos" in reason] == [2, 7]


def test_the_smallest_cos_of_those_that_stay(members):
    def columns(a):
        left = a[X] < -0.5
        return {
            # Member 0 has the smallest value of those that left, member 19 of the others.
            "smallest_regularity": np.where(left, 1e-3 * (a["run"] + 1), (40 - a["run"]) / 40),
            "status": np.where(left, code("range left"), 0),
            "settling_time": 1 + (a["run"] == 17),
        }

    found = notable(members(GRID, columns))
    assert [k for why, k in found if why.startswith("smallest cos θ2")] == [19, 18]
    assert [k for why, k in found if why == "comes to rest last"] == [17]


def test_those_that_failed_and_those_near_the_certified_level(members):
    def columns(a):
        return {
            "lyapunov_start": a["run"] * 10.0,
            "status": np.where(a["run"] >= 18, code("diverged"), 0),
        }

    found = members(GRID, columns)
    # The energies at rest of made up members are 1 J.
    bounds = {"visco-elastic": EnergyBound(95.0, 0.0)}
    found.__dict__["_certified"] = SimpleNamespace(bounds=bounds)
    why = {number: text for text, number in notable(found)}
    assert [k for k, text in why.items() if text == "v(0) nearest c*"] == [9, 10]
    assert {18, 19} <= set(why)


def test_the_list_is_short_and_each_member_is_there_once(made):
    vary = {f"{SPIN}[0]": {"linspace": [0, 1, 40]}, f"{SPIN}[1]": {"linspace": [0, 1, 40]}}
    sections = sweep_sections(made(vary, lambda a: {"status": a["run"] % 7}))
    rows = texts(tables(sections)["sweep-1-notable"])
    numbers = [row[0] for row in rows]
    assert len(set(numbers)) == len(numbers) <= 12


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
    assert all(one[0].command.endswith(f" --member {one[0].text}") for one in table.rows)
    assert (cells["outcome"].text, cells["outcome"].tone) == ("returns", "good")
    assert cells["settling time"].value == 2.0
    assert cells["v(0)"].value == 13
    assert cells["initial angular_velocity[0]"].value == 1
    assert cells["initial angular_velocity[1]"].value == 10
    assert cells["largest |E1|, |E2| or |E3|"].value == 9.0
    (section,) = (section for section in sections if section.name == "sweep-1-members")
    sentence = section.blocks[0]
    assert isinstance(sentence, str)
    plan = shell_word(sweep.path.parent / "plan.yaml")
    member = f"--member {texts(table)[0][0]}"
    assert f": rbstab run {plan} " in sentence
    assert sentence.endswith(member)
    # Without its plan, the folder does not say what to run.
    (sweep.path.parent / "plan.yaml").unlink()
    (section,) = (one for one in sweep_sections(sweep) if one.name == "sweep-1-members")
    assert str(section.blocks[0]).endswith(f": rbstab run PLAN.yaml {member}")


@pytest.mark.parametrize("folder", ["plain", "with a space"])
def test_the_command_is_quoted(tmp_path, folder):
    (tmp_path / folder).mkdir()
    plan = tmp_path / folder / "plan.yaml"
    plan.write_text("")
    command = f"{member_command(tmp_path / folder / 'members.h5')} 7"
    assert words_of(command) == ["rbstab", "run", str(plan), "--member", "7"]


def test_distances_are_those_of_scaled_parameters(members):
    vary = {"controller.K_t[0]": {"uniform": [2000, 6000]}, f"{SPIN}[0]": {"uniform": [0, 0.01]}}
    found = members(vary, lambda a: {"status": (a["run"] * 7 % 5 == 0).astype(int)}, **DRAWN)
    scaled = [(p.values - p.values.min()) / np.ptp(p.values) for p in found.parameters]
    distance = np.hypot(*(s[:, np.newaxis] - s for s in scaled))
    distance[found.outcomes[:, np.newaxis] == found.outcomes] = np.inf
    expected = np.unravel_index(distance.argmin(), distance.shape)
    assert border_pairs(found)[0] == tuple(int(k) for k in expected)


def test_the_condition_of_a_notable_member_stands_beside_its_number(made):
    vary = {
        "controller.variant": {"each": {"values": ["visco-elastic", "free"]}},
        f"{SPIN}[0]": {"normal": [0, 6]},
    }
    sections = sweep_sections(made(vary, design="random", members=10, seed=4))
    table = tables(sections)["sweep-1-notable"]
    assert [head.label for head in table.heads[:2]] == ["member", "condition"]
    for row in table.rows:
        assert row[1].text == ("visco-elastic" if int(row[0].text) < 10 else "free")
