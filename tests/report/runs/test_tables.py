"""Protects the tables of runs: their numbers agree with the results they were made from."""

import json
import math
from typing import Any

import numpy as np
import pytest
from report.runs.stored import runs_of, store_proof
from support.made_runs import (
    DECAY,
    LARGEST_PITCH,
    PEAKS,
    RESIDUAL,
    V_START,
    made_config,
    made_file,
    made_result,
)
from support.printed_paths import words_of
from support.results import with_data
from support.sections import tables, texts

from rbstab.experiment.summary import ReferenceValue
from rbstab.report.model.document import Cell
from rbstab.report.runs.answers import answer_sentence
from rbstab.report.runs.certificate_tables import MAX_FULL_CERTIFICATES, certificate_section
from rbstab.report.runs.config_tables import (
    MAX_KEYS,
    config_section,
    differences_section,
    provenance_section,
)
from rbstab.report.runs.reference_tables import _row, reference_section
from rbstab.report.runs.tables import summary_table, warnings_section
from rbstab.store.result import Result, write_result


def row_of(path):
    """Return the cells of a run in the table of runs by their columns."""
    table = summary_table(runs_of(path))
    return {head.label: cell for head, cell in zip(table.heads, table.rows[0], strict=True)}


def texts_of(section, name):
    """Return the texts of a table by row, with those of its heads first."""
    table = tables([section])[name]
    return [[head.text for head in table.heads], *texts(table)]


def of_several(folder, make, *changes):
    """Return a section on runs, named a, b, ..., each with other keywords of `made_result`."""
    paths = [folder / f"{name}.h5" for name in "abc"[: len(changes)]]
    for path, change in zip(paths, changes, strict=True):
        write_result(path, made_result(**change), replace=True)
    return make(runs_of(*paths))


@pytest.fixture
def path(tmp_path):
    return made_file(tmp_path / "made.h5")


def test_the_numbers_of_a_run(path):
    value = {name: cell.value for name, cell in row_of(path).items()}
    assert value["v(0)"] == V_START
    assert value["v(end)"] == pytest.approx(V_START * math.exp(-2 * DECAY))
    assert value["|r|/largest energy"] == pytest.approx(RESIDUAL / V_START)
    assert value["peak |θ2|"] == pytest.approx(LARGEST_PITCH)
    # All components of the made motion peak at the same time.
    assert value["peak |E|"] == pytest.approx(np.linalg.norm(PEAKS), rel=1e-6)
    # v falls below a thousandth of its start when exp(-DECAY t) does.
    assert value["at rest from"] == pytest.approx(math.log(1000) / DECAY)
    peaks = [value[f"peak E{axis}"] for axis in (1, 2, 3)]
    assert peaks == pytest.approx(PEAKS, rel=1e-6)


def in_region(verdict, *level):
    return {"verdicts": {"certified region": verdict}, "level": level}


LEFT = {"status": "range left", "status_detail": "cos θ2 = 1e-3 at t = 2 s"}


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (in_region("certified", 100.0, 200.0), {"v(0)/c*": "0.5", "in certified region": "yes"}),
        (in_region("unknown", 300.0, 200.0), {"v(0)/c*": "1.5", "in certified region": "no"}),
        (in_region("unknown", 100.0, 0.0), {"v(0)/c*": "-", "in certified region": "no"}),
        (in_region("unknown", math.nan, math.nan), {"v(0)/c*": "-", "in certified region": "-"}),
        # Every start converges: no level is exceeded, and none is named.
        (in_region("certified", 100.0, math.inf), {"v(0)/c*": "-", "in certified region": "yes"}),
        (LEFT, {"status": "range left at 2 s: bad", "outcome": "left the range: bad"}),
        ({"verdict": "certified"}, {"checks": "proved: good"}),
        ({"verdict": "consistent"}, {"checks": "seen", "status": "completed"}),
        ({"verdict": "violated"}, {"checks": "false: bad"}),
    ],
)
def test_words_and_tones_of_a_run(made, expected, tmp_path):
    row = row_of(made_file(tmp_path / "a.h5", **made))
    words = {name: (row[name].text, row[name].tone) for name in expected}
    shown = {name: ": ".join(filter(None, both)) for name, both in words.items()}
    assert shown == expected


def test_a_run_that_left_the_range_says_when(tmp_path):
    runs = runs_of(made_file(tmp_path / "a.h5", **LEFT))
    assert answer_sentence(runs).startswith("Left the range at t = 2 s")


def test_v_is_shown_where_a_result_stores_v_minus_work(tmp_path):
    made = made_result()
    connector = made["part"].tolist().index("connector")
    work = np.linspace(0.0, 100.0, len(made["time"]))
    energy = made["energy"].copy()
    energy[:, connector] = -work
    arrays = {"lyapunov": made["lyapunov"] - work, "energy": energy}
    new = {name: made.variables[name]._replace(data=data) for name, data in arrays.items()}
    new["contact_work"] = made.variables["lyapunov"]._replace(data=work)
    sliding = {**made.attributes, "variant": "sliding"}
    write_result(tmp_path / "a.h5", Result({**made.variables, **new}, sliding, made.config))
    assert row_of(tmp_path / "a.h5")["v(end)"].value == pytest.approx(made["lyapunov"][-1])


def test_a_run_that_does_not_settle_and_is_not_finite(tmp_path):
    made = made_result(status="diverged")
    v = np.where(np.arange(len(made["time"])) < 200, made["lyapunov"], np.nan)
    made = with_data(with_data(made, "lyapunov", v), "settling_time", np.array(np.nan))
    write_result(tmp_path / "a.h5", made)
    row = row_of(tmp_path / "a.h5")
    assert (row["at rest from"].text, row["v(end)"].text) == ("-", "-")
    json.dumps(row["v(0)"].value, allow_nan=False)


@pytest.mark.parametrize(
    ("states", "level", "expected"),
    [(1, 1e9, (Cell("1", 1.0), "yes")), (3, 1e-9, (Cell("3: 3 stable", 3.0, "warning"), "no"))],
)
def test_a_proof_that_came_after_the_run(states, level, expected, path, tmp_path):
    assert row_of(path)["rest states"].text == "-"
    store_proof(tmp_path, made_config(), states, level=level)
    row = row_of(path)
    assert (row["rest states"], row["in certified region"].text) == expected


def test_what_differs_and_what_does_not(tmp_path):
    section = of_several(tmp_path, differences_section, {}, {})
    assert section.blocks == ("The configs of all runs are equal.",)
    changes = ("body.mass=40", "controller.K_t=[1,2,3]"), ("body.mass=50", "controller.K_t=[1,2,4]")
    configs = [{"config": made_config(*change)} for change in changes]
    assert texts_of(of_several(tmp_path, differences_section, *configs), "differences") == [
        ["run", "body.mass [kg]", "controller.K_t [N/m]"],
        ["a", "40", "[1, 2, 3]"],
        ["b", "50", "[1, 2, 4]"],
    ]
    equal = dict(texts_of(of_several(tmp_path, config_section, *configs), "equal"))
    assert equal["initial.angular_velocity [rad/s]"] == "[16, 32, -16]"
    assert not {"body.mass [kg]", "controller.K_t [N/m]"} & set(equal)
    assert {"integration.duration [s]", "integration.time_limit [s]"} <= set(equal)


def test_not_more_keys_are_compared_than_can_be_read(tmp_path):
    names = ("K_t", "L_t", "K_r", "L_r", "K_c", "L_c")
    changes = [f"controller.{name}=[1,2,3]" for name in names]
    changes += [f"initial.{name}=[1,0,0]" for name in ("position", "velocity", "orientation")]
    changes += ["body.mass=1", "gravity=[0,0,-1]", "integration.samples=7", "title=Mine"]
    section = of_several(tmp_path, differences_section, {}, {"config": made_config(*changes)})
    table = tables([section])["differences"]
    assert (len(changes), len(table.heads)) == (MAX_KEYS + 1, 1 + MAX_KEYS)
    assert table.note == "Not shown: 1 more differing key."


def test_the_lines_of_a_certificate(tmp_path):
    made = {"verdicts": {"decrease": "violated"}, "verdict": "violated"}
    lines = tables([of_several(tmp_path, certificate_section, made)])["certificate-lines"]
    verdicts = {row[1].text: row[2] for row in lines.rows}
    assert list(verdicts)[-1] == "certified region"
    assert verdicts.pop("decrease") == Cell("false", tone="bad")
    assert verdicts["audit"].text == "seen"
    assert not any(cell.text == "false" for cell in verdicts.values())


def test_of_several_runs_the_answers_stand_in_a_table(tmp_path):
    rows = texts_of(of_several(tmp_path, certificate_section, {}, {}), "answers-in-full")
    answer = runs_of(tmp_path / "a.h5")[0].answer.this_start
    question = "From this start: does it come to rest?"
    assert rows[1] == ["a", question, answer.word, answer.sentence]


def test_of_many_certificates_only_what_is_violated_is_written_out(tmp_path):
    paths = [made_file(tmp_path / f"{k}.h5") for k in range(MAX_FULL_CERTIFICATES)]
    bad = made_file(tmp_path / "bad.h5", verdicts={"audit": "violated"}, verdict="violated")
    lines = texts_of(certificate_section(runs_of(*paths, bad)), "certificate-lines")
    assert [row[:2] for row in lines[1:]] == [["bad", "audit"]]


REFERENCE = {
    "source": "a book",
    "note": "misprinted",
    "final": {"orientation": [0.1, 0.2, 0.3]},
    "peak_contact_displacement": [-0.04, 0.03, 0.06],
}


def test_printed_and_computed_values_also_of_a_run_that_stopped(tmp_path):
    config = made_config(reference=REFERENCE)
    early = {"config": config, "status": "step limit"}
    section = of_several(tmp_path, reference_section, {"config": config}, early)
    assert section.blocks[:2] == (
        "a, b: a book: misprinted.",
        "b: ended early: step limit at 2 s. Its computed values describe the motion until then.",
    )
    _, final, peak, *_ = texts_of(section, "reference")
    assert final[:3] == ["a", "final orientation [rad]", "(0.1, 0.2, 0.3)"]
    assert peak == [
        "a",
        "peak contact displacement [m]",
        "(-0.04, 0.03, 0.06)",
        "-",
        "(-0.05, 0.02, 0.04)",
        "(-0.01, -0.01, -0.02)",
    ]


@pytest.mark.parametrize(
    ("printed", "word"),
    [((0.1, 0.2, 0.3), "disproved"), ((0.01, -0.02, 0.03), "possible")],
)
def test_a_printed_value_is_compared_with_the_exact_motion(printed, word):
    """A printed 0.01 stands for all numbers from 0.005 to 0.015."""
    exact = ((0.0051, -0.0249, 0.0251), (0.0052, -0.0248, 0.0349))
    value = ReferenceValue("final orientation", "rad", printed, (0.0, 0.0, 0.0), exact)
    assert Cell.of(_row("a", value)[3]).text == word


def test_warnings_once_for_all_runs_that_have_them(tmp_path):
    section = of_several(tmp_path, warnings_section, {"warnings": "one\ntwo"}, {"warnings": "two"})
    assert texts_of(section, "warnings")[1:] == [["one", "a"], ["two", "a, b"]]
    assert of_several(tmp_path, warnings_section, {}) is None


def test_where_runs_come_from(tmp_path):
    proved: dict[str, Any] = {"convergence_time": 0.25, "convergence_bound": math.inf}
    a, b = {"numpy_version": "2.0", **proved}, {"numpy_version": "2.1", "commit": "d", **proved}
    section = of_several(tmp_path, provenance_section, a, b)
    run, _ = runs_of(tmp_path / "a.h5", tmp_path / "b.h5")
    expected = {
        "rbstab version": "0.1.0",
        "run id": run.result.run_id,
        "rtol": "1e-12",
        "it is in a certified region from [s]": "0.25",
        "level of that region [J]": "no bound",
    }
    shared = dict(texts_of(section, "versions"))
    assert {name: shared.get(name) for name in expected} == expected
    heads, *rows = texts_of(section, "origins")
    assert heads == ["run", "file", "commit", "numpy version"]
    assert rows[0][1::2] == [str(run.path), "2.0"]
    assert rows[1][2:] == ["d", "2.1"]


def test_the_commands_that_repeat_runs_do_not_get_in_each_others_way(tmp_path):
    places = [tmp_path / folder / "-x y.h5" for folder in ("one", "two")]
    for place in places:
        place.parent.mkdir()
    runs = runs_of(*map(made_file, places))
    commands = [words_of(row[1]) for row in texts_of(provenance_section(runs), "commands")[1:]]
    # No file of the user is overwritten.
    configs = ["run-1-again.yaml", "run-2-again.yaml"]
    assert [(words[2], words[5], words[9]) for words in commands] == [
        (str(place), config, config) for place, config in zip(places, configs, strict=True)
    ]
