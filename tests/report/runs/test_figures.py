"""Protects the figures of runs: at most six, chosen by what a run has, of the stored arrays."""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.figure_runs import KINDS, lines_of, run_of, without_config
from support.sections import figures_in

from rbstab.config.load import load_config
from rbstab.experiment.along.locus import linearised_at_rest
from rbstab.experiment.summary import lyapunov_function_of
from rbstab.report.model.figure import Level, Points, Stack
from rbstab.report.runs.figures.eigenvalues import eigenvalue_figure
from rbstab.report.runs.figures.states import HELD
from rbstab.report.runs.sections import MOST_FIGURES, figures_section


def figures_of(*runs):
    return figures_in([figures_section(runs)])


@functools.cache
def of_kinds(*kinds):
    return figures_of(*(run_of(kind, number) for number, kind in enumerate(kinds)))


FIRST = ["runs-rotation", "runs-contact", "runs-decay"]
LAST = ["runs-eigenvalues", "runs-phase"]


@pytest.mark.parametrize(
    ("kinds", "names"),
    [
        *((kind, [*FIRST, "run-1-energy", *LAST]) for kind in KINDS if kind != "sliding"),
        ("sliding", [*FIRST, "run-1-events", "run-1-energy", "runs-eigenvalues"]),
        ("free sliding", [*FIRST, *LAST]),
    ],
)
def test_at_most_six_figures_by_what_a_run_has(kinds, names):
    figures = of_kinds(*kinds.split())
    assert list(figures) == names
    assert len(names) <= MOST_FIGURES
    for figure in figures.values():
        assert len(figure.caption.split()) <= 40
        assert all(panel.marks for panel in figure.panels)
        if figure.shares_time:
            assert {panel.x.text for panel in figure.panels} == {"time t [s]"}


@pytest.mark.parametrize(
    ("figure", "names"),
    [
        ("runs-rotation", ("orientation", "angular_velocity")),
        ("runs-contact", ("contact_displacement", "contact_force")),
    ],
)
def test_the_curves_of_a_run_are_the_components_of_its_arrays(figure, names):
    run = run_of("embedded")
    for panel, name in zip(of_kinds("embedded")[figure].panels, names, strict=True):
        stored = run.result.variables[name]
        assert panel.y.unit == stored.unit
        assert panel.y.label.endswith(stored.long_name.split(":")[0])
        lines = lines_of(panel)
        np.testing.assert_array_equal(np.column_stack([line.y for line in lines]), stored.data)
        # They are told apart without colours, too.
        assert len({line.dash for line in lines}) == len({line.colour for line in lines}) == 3


def test_a_held_contact_point_has_a_force_and_no_displacement():
    (panel,) = of_kinds("permanent")["runs-contact"].panels
    assert panel.y.label == "contact force Λ"
    assert np.abs(run_of("permanent").result["contact_displacement"]).max() < HELD


def test_several_runs_have_a_row_for_each_component_and_a_colour_each():
    kinds = ("permanent", "free")
    figures = of_kinds(*kinds)
    panels = figures["runs-rotation"].panels
    symbols = [panel.y.label.split()[-1] for panel in panels]
    assert symbols == ["θ1", "Ω1", "θ2", "Ω2", "θ3", "Ω3"]
    for place, panel in enumerate(panels):
        name = ("orientation", "angular_velocity")[place % 2]
        for line, kind in zip(lines_of(panel), kinds, strict=True):
            np.testing.assert_array_equal(line.y, run_of(kind).result[name][:, place // 2])
    for figure in figures.values():
        for line in (line for panel in figure.panels for line in lines_of(panel)):
            assert kinds[line.colour] == line.label


def test_v_and_the_dissipated_power_decay_on_logarithmic_axes():
    """On s = F + κE a run stores v - ε, which does not end at zero: v is drawn."""
    for kind in ("visco-elastic", "sliding"):
        result = run_of(kind).result
        value, lost = of_kinds(kind)["runs-decay"].panels
        assert value.y.log
        assert lost.y.log
        np.testing.assert_array_equal(lines_of(value)[0].y, lyapunov_function_of(result))
        power = -result["lyapunov_rate"]
        np.testing.assert_allclose(lines_of(lost)[0].y, power, atol=1e-9 * power.max())
    assert "add up to v - ε" in of_kinds("sliding")["run-1-energy"].caption


@pytest.mark.parametrize("kind", ["permanent", "embedded", "free", "manifold"])
def test_the_stacks_add_up_and_each_part_is_drawn_by_its_size(kind):
    result = run_of(kind).result
    energy, dissipation, *sizes = of_kinds(kind)["run-1-energy"].panels
    whole = result["lyapunov"] + result["energy_at_rest"]
    for panel, total, logged in zip(
        (energy, dissipation), (whole, -result["lyapunov_rate"]), sizes, strict=True
    ):
        (stack,) = [mark for mark in panel.marks if isinstance(mark, Stack)]
        scale = np.abs(stack.parts).max()
        np.testing.assert_allclose(stack.parts.sum(axis=1), total, atol=1e-12 * scale)
        np.testing.assert_allclose(lines_of(panel)[0].y, stack.parts.sum(axis=1))
        assert logged.y.log
        parts = dict(zip(stack.labels, stack.parts.T, strict=True))
        for line in lines_of(logged):
            np.testing.assert_array_equal(line.y, np.abs(parts[line.label]))
    assert ("gravity" in stack.labels) == (kind != "permanent")


def test_phase_planes_begin_where_the_run_does_and_mark_the_rest_state():
    result = run_of("free").result
    for component, panel in enumerate(of_kinds("free")["runs-phase"].panels):
        (path,) = lines_of(panel)
        start, rest = (mark for mark in panel.marks if isinstance(mark, Points))
        np.testing.assert_array_equal(path.x, result["orientation"][:, component])
        np.testing.assert_array_equal(path.y, result["angular_velocity"][:, component])
        assert (start.x[0], start.y[0]) == (path.x[0], path.y[0])
        assert (rest.x[0], rest.y[0]) == (result["rest_orientation"][component], 0.0)


def test_what_a_sliding_connector_does():
    result = run_of("sliding").result
    *modes, chatter = of_kinds("sliding")["run-1-events"].panels
    seen = []
    for axis, panel in enumerate(modes):
        (mode,) = lines_of(panel)
        assert mode.step
        np.testing.assert_array_equal(mode.y, result["mode"][:, axis])
        points = [mark for mark in panel.marks if isinstance(mark, Points)]
        seen += [(t, axis + 1, mark.label) for mark in points for t in mark.x.tolist()]
    stored = (result[f"transition_{name}"].tolist() for name in ("time", "axis", "kind"))
    assert sorted(seen) == sorted(zip(*stored, strict=True))
    for panel in (*modes, chatter):
        (limit,) = [mark for mark in panel.marks if isinstance(mark, Level)]
        assert (limit.vertical, limit.value) == (True, float(result["trusted_until"]))


def translations(config):
    """Return the roots of m s² + L_t s + K_t of each axis: the translation of a free body."""
    controller = config.controller
    pairs = zip(controller.L_t, controller.K_t, strict=True)
    return np.concatenate([np.roots([config.body.mass, L, K]) for L, K in pairs])


def test_the_slow_eigenvalues_of_a_free_body_are_those_of_its_oscillators():
    run = run_of("free")
    figure = of_kinds("free")["runs-eigenvalues"]
    ((points, border),) = [panel.marks for panel in figure.panels]
    assert isinstance(points, Points)
    assert border == Level(0.0, "border of stability", vertical=True)
    # It rests at the desired attitude, which the legend says.
    assert points.label == "free, at (0°, 0°, 0°)"
    eigenvalues = points.x + 1j * points.y
    assert -eigenvalues.real.min() <= 10 * -eigenvalues.real.max()
    expected = translations(run.config)
    for value in expected[-expected.real <= 10 * -eigenvalues.real.max()]:
        assert np.abs(eigenvalues - value).min() < 1e-6 * abs(value)
    assert f"Not drawn: {12 - len(eigenvalues)} that decay" in figure.caption
    first = complex(eigenvalues[0])
    assert points.texts[0].endswith(f"ζ = {-first.real / abs(first):.4g}")


def test_eigenvalues_of_unreadable_configs_are_left_out():
    alone = without_config(run_of("free"))
    assert "runs-eigenvalues" not in figures_of(alone)
    figure = figures_of(alone, run_of("permanent", 1))["runs-eigenvalues"]
    assert figure.caption.endswith("Not known of 1 run.")
    assert "modes exp(-κt)" in of_kinds("sliding")["runs-eigenvalues"].caption


def test_where_a_stop_holds_the_pitch_its_zero_eigenvalues_are_not_drawn():
    """They are those of θ2, and say nothing on stability."""
    config = load_config(Path("configs/examples/stop.yaml"))
    run = replace(run_of("free"), config=config)
    linear = linearised_at_rest(config).linearisation
    assert linear is not None
    assert linear.eigenvalues.tolist().count(0) == 2
    figure = eigenvalue_figure([run])
    assert figure is not None
    points, _ = figure.panels[0].marks
    assert isinstance(points, Points)
    assert (points.x != 0).all()
    assert "held by a stop" in figure.caption
