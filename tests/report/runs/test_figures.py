"""Protects the figures of runs: they show the stored arrays, grouped as in the paper."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from support.figure_runs import (
    KINDS,
    SAMPLES,
    lines_of,
    run_of,
    without_config,
)
from support.sections import figures_in

from rbstab.experiment.summary import lyapunov_function_of
from rbstab.report.model.figure import Axis, Bars, Level, Line, Panel, Points, Stack
from rbstab.report.model.palette import COLOURS
from rbstab.report.runs.figures.curves import layered, stepped
from rbstab.report.runs.figures.lyapunov import decay_figure
from rbstab.report.runs.sections import MAX_CURVES, run_sections
from rbstab.systems.quantities import BY_NAME


@functools.cache
def sections_of(*kinds):
    return run_sections([run_of(kind, number) for number, kind in enumerate(kinds)])


def figures_of(*kinds):
    return figures_in(sections_of(*kinds))


def sentences(sections):
    return " ".join(b for section in sections for b in section.blocks if isinstance(b, str))


PAPER = {
    "permanent": {"states": ("as the paper's Fig. 3", ["Θ", "Ω", "X", "V", "v", "v'"])},
    "visco-elastic": {
        "rotation": ("as the paper's Fig. 4", ["Θ", "Ω", "v", "v'"]),
        "translation": ("as the paper's Fig. 5", ["X", "V", "E"]),
    },
    "embedded": {
        "rotation": ("as the paper's Fig. 6", ["Θ", "Ω", "v", "v'"]),
        "translation": ("as the paper's Fig. 7", ["X", "V", "E", "D"]),
    },
    "free": {
        "rotation": ("", ["Θ", "Ω", "v", "v'"]),
        "translation": ("", ["X", "V", "E"]),
    },
}
"""The figures of the paper: the quantities in its captions, and D in addition."""


@pytest.mark.parametrize("kind", PAPER)
def test_curves_are_grouped_as_in_the_paper(kind):
    figures = figures_of(kind)
    for name, (source, symbols) in PAPER[kind].items():
        figure = figures[f"run-1-{name}"]
        assert figure.source == source
        assert [panel.y.label.split()[-1] for panel in figure.panels] == symbols
        assert figure.shares_time
        assert {panel.x.text for panel in figure.panels} == {"time t [s]"}


def test_the_curves_are_the_stored_arrays():
    run = run_of("embedded")
    figures = figures_of("embedded")
    names = {q.symbol: name for name, q in BY_NAME.items() if q.symbol != "-"}
    for figure in ("rotation", "translation", "forces"):
        for panel in figures[f"run-1-{figure}"].panels:
            name = names[panel.y.label.split()[-1]]
            stored = run.result.variables[name]
            assert panel.y.unit == stored.unit
            assert panel.y.label.endswith(stored.long_name.split(":")[0])
            drawn = np.column_stack([line.y for line in lines_of(panel)])
            np.testing.assert_array_equal(drawn, stored.data.reshape(SAMPLES, -1))
            for line in lines_of(panel):
                np.testing.assert_array_equal(line.x, run.result["time"])


def test_components_are_told_apart_without_colours_too():
    panel = figures_of("free")["run-1-rotation"].panels[0]
    labels = [line.label for line in lines_of(panel)]
    assert labels == ["θ1", "θ2", "θ3"]
    assert len({line.dash for line in lines_of(panel)}) == 3
    assert len({line.colour for line in lines_of(panel)}) == 3


def test_each_run_has_its_colour_in_all_overlays():
    kinds = ("permanent", "embedded", "free")
    for name, figure in figures_of(*kinds).items():
        if name.startswith("runs-"):
            for panel in figure.panels:
                for mark in panel.marks:
                    if not isinstance(mark, Level) and mark.label not in ("start", "rest state"):
                        assert kinds[mark.colour] == mark.label, name


def test_runs_of_the_same_colour_have_other_dashes():
    numbers = range(len(COLOURS) + 1)
    runs = [without_config(run_of("free", number, f"run {number}")) for number in numbers]
    looks = [
        (line.colour % len(COLOURS), line.dash) for line in lines_of(decay_figure(runs).panels[0])
    ]
    assert len(set(looks)) == len(runs)


def test_an_overlay_has_a_row_for_each_component():
    runs = [run_of("permanent"), run_of("free", 1)]
    figure = figures_in(run_sections(runs))["runs-rotation"]
    assert figure.columns == 2
    assert [panel.y.text for panel in figure.panels] == [
        "orientation θ1 [rad]",
        "angular velocity Ω1 [rad/s]",
        "orientation θ2 [rad]",
        "angular velocity Ω2 [rad/s]",
        "orientation θ3 [rad]",
        "angular velocity Ω3 [rad/s]",
    ]
    for row in range(3):
        for column, name in enumerate(("orientation", "angular_velocity")):
            for line, run in zip(lines_of(figure.panels[2 * row + column]), runs, strict=True):
                np.testing.assert_array_equal(line.y, run.result[name][:, row])


def test_v_and_the_distance_are_drawn_on_both_kinds_of_axes():
    result = run_of("visco-elastic").result
    figure = figures_of("visco-elastic")["runs-decay"]
    assert [panel.y.log for panel in figure.panels] == [False, True] * 3
    value, logged, rate, fall, distance, far = [lines_of(panel)[0].y for panel in figure.panels]
    np.testing.assert_array_equal(value, result["lyapunov"])
    np.testing.assert_array_equal(logged, result["lyapunov"])
    np.testing.assert_array_equal(rate, result["lyapunov_rate"])
    np.testing.assert_array_equal(fall, -result["lyapunov_rate"])
    E = result["contact_displacement"]
    np.testing.assert_allclose(distance**2, (E**2).sum(axis=1), rtol=1e-12, atol=1e-30)
    np.testing.assert_array_equal(far, distance)


@pytest.mark.parametrize("kind", ["permanent", "embedded", "free", "manifold"])
def test_the_stacks_add_up(kind):
    result = run_of(kind).result
    energy, dissipation, *_ = figures_of(kind)["run-1-energy"].panels
    (stored,), (lost,) = (
        [mark for mark in panel.marks if isinstance(mark, Stack)] for panel in (energy, dissipation)
    )
    whole = result["lyapunov"] + result["energy_at_rest"]
    size = np.abs(result["energy"]).max()
    np.testing.assert_allclose(stored.parts.sum(axis=1), whole, atol=1e-12 * size)
    np.testing.assert_allclose(
        lost.parts.sum(axis=1), -result["lyapunov_rate"], rtol=1e-12, atol=1e-9
    )
    for panel, stack in ((energy, stored), (dissipation, lost)):
        np.testing.assert_allclose(lines_of(panel)[0].y, stack.parts.sum(axis=1))
    assert ("gravity" in stored.labels) == (kind != "permanent")


def test_the_size_of_each_part_has_the_colour_of_its_part():
    figure = figures_of("embedded")["run-1-energy"]
    (stack,) = [mark for mark in figure.panels[0].marks if isinstance(mark, Stack)]
    sizes = lines_of(figure.panels[2])
    assert [line.label for line in sizes] == list(stack.labels)
    assert [line.colour for line in sizes] == list(range(len(stack.labels)))
    np.testing.assert_array_equal(np.column_stack([line.y for line in sizes]), np.abs(stack.parts))


def test_phase_portraits_begin_and_end_where_the_run_does():
    result = run_of("free").result
    figure = figures_of("free")["run-1-phase"]
    for component, panel in enumerate(figure.panels):
        (path,) = lines_of(panel)
        start, end, rest = (mark for mark in panel.marks if isinstance(mark, Points))
        for name, drawn in (("orientation", path.x), ("angular_velocity", path.y)):
            # All samples are on the curve, in their order.
            assert set(result[name][:, component]) <= set(drawn)
            assert (drawn[0], drawn[-1]) == tuple(result[name][[0, -1], component])
        assert (start.label, start.x[0], start.y[0]) == ("start", path.x[0], path.y[0])
        assert (end.label, end.x[0], end.y[0]) == ("end", path.x[-1], path.y[-1])
        at_rest = result["rest_orientation"][component]
        assert (rest.label, rest.x[0], rest.y[0]) == ("rest state", pytest.approx(at_rest), 0.0)


def test_what_a_sliding_connector_does():
    result = run_of("sliding").result
    figures = figures_of("sliding")
    modes = figures["run-1-modes"].panels
    seen = []
    for axis, panel in enumerate(modes):
        (mode,) = lines_of(panel)
        assert mode.step
        np.testing.assert_array_equal(mode.y, result["mode"][:, axis])
        for mark in panel.marks:
            if isinstance(mark, Points):
                seen += [(time, axis + 1, mark.label) for time in mark.x.tolist()]
    stored = (result[f"transition_{name}"].tolist() for name in ("time", "axis", "kind"))
    assert sorted(seen) == sorted(zip(*stored, strict=True))
    assert {kind for _, _, kind in seen} == {"stick", "release"}
    counts, chatter = figures["run-1-switching"].panels
    drawn = np.column_stack([line.y for line in lines_of(counts)])
    np.testing.assert_array_equal(drawn, result["switch_count"])
    assert chatter.y.log
    for panel in (*modes, counts, chatter):
        (limit,) = [mark for mark in panel.marks if isinstance(mark, Level)]
        assert limit.vertical
        assert limit.value == result["trusted_until"]


def test_other_runs_have_no_switching():
    assert not {"run-1-modes", "run-1-switching"} & set(figures_of("embedded"))


def test_how_far_a_held_point_has_drifted():
    result = run_of("manifold").result
    panels = figures_of("manifold")["run-1-audit"].panels
    names = ("energy_residual", "constraint_position_residual", "constraint_velocity_residual")
    for panel, name in zip(panels, names, strict=True):
        assert panel.y.log
        np.testing.assert_array_equal(lines_of(panel)[0].y, np.abs(result[name]))
    assert [panel.y.label.count("|") for panel in panels] == [2, 2, 2]
    assert len(figures_of("permanent")["run-1-audit"].panels) == 1


@pytest.mark.parametrize("kind", KINDS)
def test_sections_are_named_and_stand_in_order(kind):
    sections = sections_of(kind)
    assert [section.name for section in sections] == [
        "runs-decay",
        "runs-eigenvalues",
        "run-1-figures",
    ]
    assert all(section.blocks for section in sections)


def test_no_runs_have_no_sections():
    assert run_sections([]) == ()


def test_of_many_runs_there_are_distributions():
    kinds = ("embedded", "free", "permanent")
    runs = [run_of(kinds[n % 3], n, f"run {n}") for n in range(MAX_CURVES + 1)]
    (section,) = run_sections(runs)
    assert f"{MAX_CURVES + 1} runs" in sentences([section])
    (figure,) = figures_in((section,)).values()
    assert [panel.x.label for panel in figure.panels] == [
        "peak |E|",
        "v(end) / v(0)",
        "largest |r| / largest energy",
    ]
    # In 0.3 s no run settles: there are no empty axes, and the caption says why.
    assert f"settling time: {len(runs)}" in figure.caption
    for panel in figure.panels:
        (bars,) = panel.marks
        assert isinstance(bars, Bars)
        assert bars.heights.sum() == len(runs)
        assert len(bars.edges) == len(bars.heights) + 1
    ends = [run.result["lyapunov"][-1] / run.result["lyapunov"][0] for run in runs]
    (bars,) = figure.panels[1].marks
    assert isinstance(bars, Bars)
    assert (bars.edges[0], bars.edges[-1]) == pytest.approx((min(ends), max(ends)))


def test_up_to_that_many_there_are_curves():
    runs = [without_config(run_of("free", n, f"run {n}")) for n in range(MAX_CURVES)]
    assert "runs-rotation" in figures_in(run_sections(runs))


def test_overlaid_phase_portraits_have_marks_of_their_runs_and_a_margin():
    kinds = ("permanent", "free")
    for panel in figures_of(*kinds)["runs-phase"].panels:
        starts = [m for m in panel.marks if isinstance(m, Points) and m.label == "start"]
        assert [mark.colour for mark in starts] == [0, 1]
        assert {mark.key for mark in starts} == {6}
        for axis, letter in ((panel.x, "x"), (panel.y, "y")):
            values = np.concatenate([getattr(line, letter) for line in lines_of(panel)])
            assert axis.ends[0] < values.min() - 0.03 * np.ptp(values)
            assert axis.ends[1] > values.max() + 0.03 * np.ptp(values)


def test_runs_without_a_contact_force_are_not_in_its_figure():
    figure = figures_of("embedded", "free", "sliding")["runs-force"]
    for panel in figure.panels:
        assert [line.label for line in lines_of(panel)] == ["embedded", "sliding"]
    assert figure.caption.startswith("Contact force: none in free.")


def test_forces_that_jump_are_drawn_in_steps():
    t = np.arange(100.0)
    run, smooth = run_of("sliding"), Line(t, np.sin(0.1 * t))
    jumps = replace(smooth, y=np.sign(smooth.y))
    assert stepped(run, jumps).step
    assert not stepped(run, smooth).step
    assert stepped(run_of("free"), jumps) is jumps


def test_v_decays_and_v_minus_the_work_is_a_curve_of_its_own():
    """Runs on s = F + κE store v - ε, which does not end at zero."""
    run = run_of("sliding")
    v = lyapunov_function_of(run.result)
    assert run.stores_v_minus_work
    figures = figures_of("sliding", "free")
    for name, labels in (
        ("runs-decay", ["sliding", "free", "v - ε of sliding"]),
        ("run-1-rotation", ["v", "v - ε"]),
    ):
        panel = next(p for p in figures[name].panels if p.y.label == "Lyapunov function v")
        lines = lines_of(panel)
        assert [line.label for line in lines] == labels
        np.testing.assert_array_equal(lines[0].y, v)
        np.testing.assert_array_equal(lines[-1].y, run.result["lyapunov"])
        assert lines[0].dash != lines[-1].dash
        assert "v - ε (dotted)" in figures[name].caption
    logged = lines_of(figures["runs-decay"].panels[1])
    assert [line.label for line in logged] == ["sliding", "free"]
    assert "ε" not in figures_of("free")["runs-decay"].caption
    assert "ε" not in figures["run-2-rotation"].caption


def test_curves_that_swing_much_are_behind_the_others():
    """The first run covers all of the panel; in all panels it is behind, in its own place."""
    x = np.linspace(0.0, 1.0, 400)
    swinging = np.where(np.arange(400) % 4 < 2, 1.0, -1.0)
    curves = [
        (Line(x, swinging, "a"), Line(x, 0.3 * swinging, "b", colour=1), Line(x, x, "c")),
        (Line(x, x, "a"), Line(x, x, "b", colour=1), Line(x, x, "c")),
    ]
    panels = layered([Panel(Axis("t"), Axis("y"), marks) for marks in curves])
    for panel, given in zip(panels, curves, strict=True):
        assert [curve.label for curve in lines_of(panel)] == ["a", "b", "c"]
        assert [curve.depth for curve in lines_of(panel)] == [2, 1, 0]
        assert [curve.colour for curve in lines_of(panel)] == [curve.colour for curve in given]
    (calm,) = layered([Panel(Axis("t"), Axis("y"), curves[1])])
    assert [curve.depth for curve in lines_of(calm)] == [0, 0, 0]
