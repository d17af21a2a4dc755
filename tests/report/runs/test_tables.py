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

from rbstab.experiment.summary import ReferenceValue
from rbstab.report.model.document import Cell, Section, Table
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

ORIGIN = (0.0, 0.0, 0.0)


def column(table, label):
    """Return the cells of a column by the text of the first cell of their row."""
    [k] = [k for k, head in enumerate(table.heads) if head.label == label]
    return {row[0].text: row[k] for row in table.rows}


def table_of(section: Section | None, name: str) -> Table:
    assert section is not None
    [found] = [b for b in section.blocks if isinstance(b, Table) and b.name == name]
    return found


@pytest.fixture
def path(tmp_path):
    return made_file(tmp_path / "made.h5")


def test_the_numbers_of_a_run(path):
    table = summary_table(runs_of(path))
    value = {head.label: cell.value for head, cell in zip(table.heads, table.rows[0], strict=True)}
    unit = {head.label: head.unit for head in table.heads}
    assert value["v(0)"] == V_START
    assert value["v(end)"] == pytest.approx(V_START * math.exp(-2 * DECAY))
    assert value["|r|/largest energy"] == pytest.approx(RESIDUAL / V_START)
    assert value["peak |θ2|"] == pytest.approx(LARGEST_PITCH)
    # All components of the made motion peak at the same time.
    assert value["peak |E|"] == pytest.approx(np.linalg.norm(PEAKS), rel=1e-6)
    # v falls below a thousandth of its start when exp(-DECAY t) does.
    assert value["at rest from"] == pytest.approx(math.log(1000) / DECAY)
    for axis, peak in enumerate(PEAKS):
        assert unit[f"peak E{axis + 1}"] == "m"
        assert value[f"peak E{axis + 1}"] == pytest.approx(peak, rel=1e-6)


def test_the_deciding_columns_are_first(path):
    """A page shows as many columns as fit, from the left."""
    heads = [head.label for head in summary_table(runs_of(path)).heads]
    answers = ["run", "outcome", "tilt", "this start", "whole range"]
    assert heads[:8] == [*answers, "v(0)/c*", "at rest from", "peak |E|"]


@pytest.mark.parametrize(
    ("verdict", "level", "text", "inside"),
    [
        ("certified", (100.0, 200.0), "0.5", "yes"),
        ("unknown", (300.0, 200.0), "1.5", "no"),
        ("unknown", (100.0, 0.0), "-", "no"),
        ("unknown", (math.nan, math.nan), "-", "-"),
        # Every start converges: no level is exceeded, and none is named.
        ("certified", (100.0, math.inf), "-", "yes"),
    ],
)
def test_the_margin_of_a_start(verdict, level, text, inside, tmp_path):
    path = made_file(tmp_path / "a.h5", verdicts={"certified region": verdict}, level=level)
    table = summary_table(runs_of(path))
    assert column(table, "v(0)/c*")["a"].text == text
    assert column(table, "in certified region")["a"].text == inside


def test_a_run_that_stopped(tmp_path):
    path = made_file(
        tmp_path / "a.h5", status="range left", status_detail="cos θ2 = 1e-3 at t = 2 s"
    )
    table = summary_table(runs_of(path))
    cell = column(table, "status")["a"]
    assert cell.text == "range left at 2 s"
    assert cell.tone == "bad"
    assert answer_sentence(runs_of(path)).startswith("Left the range at t = 2 s")
    outcome = column(table, "outcome")["a"]
    assert (outcome.text, outcome.tone) == ("left the range", "bad")


def test_it_is_said_where_work_stands_in_place_of_an_energy(tmp_path):
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
    path = made_file(tmp_path / "b.h5")
    ends = column(summary_table(runs_of(path, tmp_path / "a.h5")), "v(end)")
    assert ends["a"].text.endswith(" (v - ε)")
    assert "ε" not in ends["b"].text


def test_a_run_that_does_not_settle_and_is_not_finite(tmp_path):
    made = made_result(status="diverged")
    v = made["lyapunov"].copy()
    v[200:] = np.nan
    settled = {"lyapunov": v, "settling_time": np.array(np.nan)}
    changed = {name: made.variables[name]._replace(data=data) for name, data in settled.items()}
    write_result(
        tmp_path / "a.h5", Result({**made.variables, **changed}, made.attributes, made.config)
    )
    table = summary_table(runs_of(tmp_path / "a.h5"))
    assert column(table, "at rest from")["a"].text == "-"
    assert column(table, "v(end)")["a"].text == "-"
    json.dumps(column(table, "v(0)")["a"].value, allow_nan=False)


@pytest.mark.parametrize(
    ("verdict", "word", "tone"),
    [("certified", "proved", "good"), ("consistent", "seen", ""), ("violated", "false", "bad")],
)
def test_verdicts_and_their_tones(verdict, word, tone, tmp_path):
    path = made_file(tmp_path / "a.h5", verdict=verdict)
    cell = column(summary_table(runs_of(path)), "checks")["a"]
    assert (cell.text, cell.tone, cell.target) == (word, tone, "certificates")


@pytest.mark.parametrize(("states", "tone"), [(1, ""), (3, "warning")])
def test_rest_states_of_a_kept_proof(states, tone, path, tmp_path):
    assert column(summary_table(runs_of(path)), "rest states")["made"].text == "-"
    store_proof(tmp_path, made_config(), states)
    cell = column(summary_table(runs_of(path)), "rest states")["made"]
    text = {1: "1", 3: "3: 3 stable"}[states]
    assert (cell.text, cell.value, cell.tone) == (text, states, tone)


@pytest.mark.parametrize(("level", "answer"), [(1e9, "yes"), (1e-9, "no")])
def test_a_proof_that_came_after_the_run_says_whether_it_starts_inside(
    level, answer, path, tmp_path
):
    store_proof(tmp_path, made_config(), 1, level=level)
    assert column(summary_table(runs_of(path)), "in certified region")["made"].text == answer


def test_what_differs_and_what_does_not(tmp_path):
    same = made_file(tmp_path / "same.h5"), made_file(tmp_path / "too.h5")
    section = differences_section(runs_of(*same))
    assert section is not None
    assert section.blocks == ("The configs of all runs are equal.",)
    a = made_file(tmp_path / "a.h5", made_config("body.mass=40", "controller.K_t=[1,2,3]"))
    b = made_file(tmp_path / "b.h5", made_config("body.mass=50", "controller.K_t=[1,2,4]"))
    differences = table_of(differences_section(runs_of(a, b)), "differences")
    heads = ["run", "body.mass [kg]", "controller.K_t [N/m]"]
    assert [head.text for head in differences.heads] == heads
    assert [[cell.text for cell in row] for row in differences.rows] == [
        ["a", "40", "[1, 2, 3]"],
        ["b", "50", "[1, 2, 4]"],
    ]
    equal = column(table_of(config_section(runs_of(a, b)), "equal"), "value")
    assert equal["initial.angular_velocity [rad/s]"].text == "[16, 32, -16]"
    assert not {"body.mass [kg]", "controller.K_t [N/m]"} & set(equal)
    assert {"integration.duration [s]", "integration.time_limit [s]"} <= set(equal)


def test_not_more_keys_are_compared_than_can_be_read(tmp_path):
    names = ("K_t", "L_t", "K_r", "L_r", "K_c", "L_c")
    changes = [f"controller.{name}=[1,2,3]" for name in names]
    changes += [f"initial.{name}=[1,0,0]" for name in ("position", "velocity", "orientation")]
    changes += ["body.mass=1", "gravity=[0,0,-1]", "integration.samples=7", "title=Mine"]
    assert len(changes) == MAX_KEYS + 1
    paths = made_file(tmp_path / "a.h5"), made_file(tmp_path / "b.h5", made_config(*changes))
    table = table_of(differences_section(runs_of(*paths)), "differences")
    assert len(table.heads) == 1 + MAX_KEYS
    assert table.note == "Not shown: 1 more differing key."


def test_the_lines_of_a_certificate(tmp_path):
    path = made_file(tmp_path / "a.h5", verdicts={"decrease": "violated"}, verdict="violated")
    section = certificate_section(runs_of(path))
    lines = table_of(section, "certificate-lines")
    assert [row[1].text for row in lines.rows][-1] == "certified region"
    verdicts = {row[1].text: row[2] for row in lines.rows}
    assert verdicts["decrease"] == Cell("false", tone="bad")
    assert verdicts["audit"].text == "seen"
    assert [row[2].text for row in lines.rows].count("false") == 1


def test_of_several_runs_the_answers_stand_in_a_table(tmp_path):
    paths = [made_file(tmp_path / f"{name}.h5") for name in "ab"]
    table = table_of(certificate_section(runs_of(*paths)), "answers-in-full")
    (entry,) = runs_of(paths[0])
    answer = entry.answer.this_start
    assert [cell.text for cell in table.rows[0]] == [
        *("a", "From this start: does it come to rest?", answer.word, answer.sentence)
    ]


def test_of_many_certificates_only_what_is_violated_is_written_out(tmp_path):
    paths = [made_file(tmp_path / f"{k}.h5") for k in range(MAX_FULL_CERTIFICATES)]
    bad = made_file(tmp_path / "bad.h5", verdicts={"audit": "violated"}, verdict="violated")
    lines = table_of(certificate_section(runs_of(*paths, bad)), "certificate-lines")
    assert [(row[0].text, row[1].text) for row in lines.rows] == [("bad", "audit")]


REFERENCE = {
    "source": "a book",
    "note": "misprinted",
    "final": {"orientation": [0.1, 0.2, 0.3]},
    "peak_contact_displacement": [-0.04, 0.03, 0.06],
}


def test_printed_and_computed_values(tmp_path):
    path = made_file(tmp_path / "a.h5", made_config(reference=REFERENCE))
    section = reference_section(runs_of(path))
    assert section is not None
    assert section.blocks[0] == "a: a book: misprinted."
    final, peak = table_of(section, "reference").rows
    assert [cell.text for cell in final][:3] == ["a", "final orientation [rad]", "(0.1, 0.2, 0.3)"]
    assert [cell.text for cell in peak] == [
        "a",
        "peak contact displacement [m]",
        "(-0.04, 0.03, 0.06)",
        "-",
        "(-0.05, 0.02, 0.04)",
        "(-0.01, -0.01, -0.02)",
    ]


def test_a_run_that_stopped_is_not_taken_for_one_that_reached_the_end(tmp_path):
    config = made_config(reference=REFERENCE)
    paths = [
        made_file(tmp_path / f"{name}.h5", config, status=status)
        for name, status in (("a", "completed"), ("b", "step limit"))
    ]
    section = reference_section(runs_of(*paths))
    assert section is not None
    stopped = [block for block in section.blocks[1:] if isinstance(block, str)]
    assert len(stopped) == 1
    assert stopped[0].startswith("b: ended early: step limit at 2 s.")


def test_warnings_once_for_all_runs_that_have_them(tmp_path):
    a = made_file(tmp_path / "a.h5", warnings="one\ntwo")
    b = made_file(tmp_path / "b.h5", warnings="two")
    table = table_of(warnings_section(runs_of(a, b)), "warnings")
    assert [[cell.text for cell in row] for row in table.rows] == [["one", "a"], ["two", "a, b"]]
    assert warnings_section(runs_of(made_file(tmp_path / "c.h5"))) is None


def test_where_runs_come_from(tmp_path):
    proved: dict[str, Any] = {"convergence_time": 0.25, "convergence_bound": math.inf}
    a = made_file(tmp_path / "a.h5", numpy_version="2.0", **proved)
    b = made_file(tmp_path / "b.h5", numpy_version="2.1", commit="d" * 40, **proved)
    section = provenance_section(runs_of(a, b))
    shared = {row[0].text: row[1].text for row in table_of(section, "versions").rows}
    assert shared["rbstab version"] == "0.1.0"
    assert shared["rtol"] == "1e-12"
    assert shared["it is in a certified region from [s]"] == "0.25"
    assert shared["level of that region [J]"] == "no bound"
    assert "commit" not in shared
    own = table_of(section, "origins")
    assert column(own, "commit")["b"].text == "d" * 40
    assert column(own, "numpy version")["a"].text == "2.0"
    assert column(own, "file")["a"].text == str(a)
    (run,) = runs_of(a)
    assert shared["run id"] == run.result.run_id


def test_the_commands_that_repeat_runs_do_not_get_in_each_others_way(tmp_path):
    places = [tmp_path / folder / "-x y.h5" for folder in ("one", "two")]
    for place in places:
        place.parent.mkdir()
    paths = [made_file(place) for place in places]
    table = table_of(provenance_section(runs_of(*paths)), "commands")
    found = [words_of(row[1].text) for row in table.rows]
    assert [words[2] for words in found] == [str(path) for path in paths]
    # No file of the user is overwritten.
    configs = ["run-1-again.yaml", "run-2-again.yaml"]
    assert [(words[5], words[9]) for words in found] == [(name, name) for name in configs]


@pytest.mark.parametrize(
    ("printed", "word"),
    [((0.1, 0.2, 0.3), "disproved"), ((0.01, -0.02, 0.03), "possible")],
)
def test_a_printed_value_is_compared_with_the_exact_motion(printed, word):
    """A printed 0.01 stands for all numbers from 0.005 to 0.015."""
    exact = ((0.0051, -0.0249, 0.0251), (0.0052, -0.0248, 0.0349))
    value = ReferenceValue("final orientation", "rad", printed, (0.0, 0.0, 0.0), exact)
    assert value.disproved is (word == "disproved")
    assert Cell.of(_row("a", value)[3]).text == word
