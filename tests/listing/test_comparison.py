"""Protects the comparison of two results: all keys that differ and no others, outcomes that belong
to their result, and no ratio of numbers that have no common meaning.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.configs import VISCO_ELASTIC, plain
from support.made_runs import made_config, made_file, made_result
from support.stored_proofs import say_proved, store_proof_of

from rbstab.config.load import load_config
from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import summary_of
from rbstab.integrate import step_ends
from rbstab.listing.comparison import Row, compare
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result, write_result
from rbstab.sweep.folder.sweep_table import open_sweep

STORED = Path(__file__).parents[1] / "formats/data/format_1"

SHORT = ("integration.duration=0.02", "integration.samples=5", "initial.angular_velocity=[1,2,3]")


def run_file(folder, name, *changes):
    result = simulate(load_config(plain(VISCO_ELASTIC), (*SHORT, *changes)))
    write_result(folder / f"{name}.h5", result)
    return folder / f"{name}.h5"


@pytest.fixture
def usual(tmp_path):
    """A short run."""
    return run_file(tmp_path, "usual")


def named(rows):
    return {row.name: row for row in rows}


def test_another_start(usual, tmp_path):
    fast = run_file(tmp_path, "fast", "initial.angular_velocity=[2,4,6]")
    comparison = compare(usual, fast)
    assert comparison.kind == "run"
    assert comparison.same_system
    assert comparison.inputs == [Row("initial.angular_velocity [rad/s]", "[1, 2, 3]", "[2, 4, 6]")]
    outcomes = named(comparison.outcomes)
    # Twice the spin at the same place: four times the energy.
    assert outcomes["v(0) [J]"].ratio == "4"
    for row in outcomes.values():
        assert row.ratio == "" or row.name in ("v(0) [J]", "v(end) [J]") or "[" in row.name


def test_another_system_has_no_ratio_of_v(usual, tmp_path):
    soft = run_file(tmp_path, "soft", "controller.K_c=[100,100,100]", "gravity=[0,0,-1]")
    comparison = compare(usual, soft)
    assert not comparison.same_system
    assert [row.name for row in comparison.inputs] == ["gravity [m/s^2]", "controller.K_c [N/m]"]
    outcomes = named(comparison.outcomes)
    assert outcomes["v(0) [J]"].ratio == outcomes["v(end) [J]"].ratio == ""
    assert outcomes["peak |E| [m]"].ratio != ""


def test_the_numbers_are_those_of_their_run(usual, tmp_path):
    fast = run_file(tmp_path, "fast", "initial.angular_velocity=[2,4,6]")
    row = named(compare(fast, usual).outcomes)["peak |θ2| [rad]"]
    peaks = [summary_of(open_result(path)).largest_pitch for path in (fast, usual)]
    assert (row.first, row.second) == tuple(f"{peak:.5g}" for peak in peaks)
    assert float(row.ratio) == pytest.approx(peaks[1] / peaks[0], rel=1e-2)


def test_a_key_of_one_config_is_a_difference(tmp_path):
    plain_file = made_file(tmp_path / "plain.h5", made_config())
    aimed_file = made_file(tmp_path / "aimed.h5", made_config(desired={"within": 0.25}))
    rows = compare(plain_file, aimed_file).inputs
    assert all(row.name.startswith("desired.") for row in rows)
    assert ("-", "0.25") in [row[1:3] for row in rows]
    assert ("0.25", "-") in [row[1:3] for row in compare(aimed_file, plain_file).inputs]


def test_the_last_v_is_that_of_the_last_sample(usual, tmp_path):
    result = made_result()
    v = result.variables["lyapunov"]
    # v may rise, for example if an element supplies power.
    risen = v._replace(data=np.array([*v.data[:-2], 1.5, 2.5]))
    variables = {**result.variables, "lyapunov": risen}
    write_result(tmp_path / "risen.h5", replace(result, variables=variables))
    assert named(compare(usual, tmp_path / "risen.h5").outcomes)["v(end) [J]"].second == "2.5"


def test_a_start_that_leaves_the_range_where_all_others_come_to_rest(tmp_path):
    shutil.copy(STORED / "runs/range_left.h5", tmp_path)
    store_proof_of(STORED / "runs/range_left.h5", tmp_path)
    outcomes = named(compare(tmp_path / "range_left.h5", STORED / "runs/embedded.h5").outcomes)
    assert outcomes["this start"].first == "not decided"
    assert outcomes["whole range"].first == "returns: proved"


def test_the_same_config(usual, tmp_path):
    other = run_file(tmp_path, "other")
    comparison = compare(usual, other)
    assert comparison.inputs == []
    assert all(row.first == row.second for row in comparison.outcomes)
    assert compare(usual, usual) == comparison


def test_sweeps(tmp_path):
    folder = Path(shutil.copytree(STORED / "sweeps", tmp_path / "sweeps"))
    say_proved(folder / "finished_map", (0, 7, 8, 29))
    say_proved(folder / "finished_variants", (2, 3, 11))
    comparison = compare(folder / "finished_map", folder / "finished_variants")
    assert comparison.kind == "sweep"
    inputs, outcomes = named(comparison.inputs), named(comparison.outcomes)
    assert inputs["design"] == Row("design", "grid", "random")
    assert "base.body.mass" not in " ".join(inputs)
    assert outcomes["members completed"][1:3] == ("30 of 30", "20 of 20")
    assert outcomes["members: come to rest, proved"][1:3] == ("4 of 30", "3 of 20")
    settled = [
        np.isfinite(open_sweep(folder / name)["settling_time"]).sum()
        for name in ("finished_map", "finished_variants")
    ]
    assert settled == [30, 0]
    assert outcomes["settled"][1:3] == ("30", "0")
    words = ("proved", "false", "seen", "not decided")
    for place, members in ((1, 30), (2, 20)):
        counts = [outcomes[f"members: come to rest, {word}"][place].split() for word in words]
        assert sum(int(count[0]) for count in counts) == members


def test_a_run_with_a_word_of_no_version(usual, tmp_path):
    result = open_result(usual)
    result.attributes["convergence"] = "perhaps"
    write_result(tmp_path / "odd.h5", result)
    with pytest.raises(StoreError, match=r"odd.h5: its content is wrong .*'perhaps'"):
        compare(usual, tmp_path / "odd.h5")


@pytest.mark.parametrize(
    ("first", "second", "reason"),
    [
        ("runs/embedded.h5", "sweeps/finished_map", "is a run and .*finished_map is a sweep"),
        ("runs/embedded.h5", "runs/missing.h5", "cannot be read"),
        ("sweeps/begun_map", "sweeps/finished_map", "is not finished"),
    ],
)
def test_what_cannot_be_compared(first, second, reason):
    with pytest.raises(StoreError, match=reason):
        compare(STORED / first, STORED / second)


def test_a_folder_of_proofs_cannot_be_compared(tmp_path):
    proofs = store_proof_of(STORED / "runs/range_left.h5", tmp_path).parent
    reason = "is a folder of proofs, not a result. Look at it: rbstab show "
    with pytest.raises(StoreError, match=reason):
        compare(proofs, STORED / "sweeps/finished_map")


def test_a_folder_stands_for_the_only_result_in_it(tmp_path):
    file = STORED / "runs/embedded.h5"
    for name in ("one/a.h5", "other/results/a.h5"):
        (tmp_path / name).parent.mkdir(parents=True)
        shutil.copy(file, tmp_path / name)
    assert compare(tmp_path / "one", tmp_path / "other") == compare(file, file)


def test_of_two_results_in_a_folder_one_must_be_named(usual, tmp_path):
    pair = tmp_path / "pair"
    pair.mkdir()
    for name in ("a.h5", "b.h5"):
        shutil.copy(usual, pair / name)
    with pytest.raises(StoreError, match=r"pair has 2 results\. Name one of them: .*a\.h5.*b\.h5"):
        compare(pair, usual)


def test_a_peak_of_samples_alone_is_a_lower_bound(usual, tmp_path, monkeypatch):
    """A run of too many steps joins them, here all."""
    monkeypatch.setattr(step_ends, "MOST", 10)
    coarse = run_file(tmp_path, "coarse", "integration.duration=1", "integration.samples=3")
    assert not summary_of(open_result(coarse)).displacement_resolved
    row = named(compare(usual, coarse).outcomes)["peak |E| [m]"]
    assert not row.first.startswith("≥")
    assert row.second.startswith("≥ ")
    assert row.ratio == ""
