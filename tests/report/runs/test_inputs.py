"""Protects the figure of what inputs supply: its curves add up to v, and passive runs have none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.inputs import SINE, couple, driven, force
from support.made_runs import made_file

from rbstab.experiment.simulate import simulate
from rbstab.report.model.figure import Line
from rbstab.report.model.words import number
from rbstab.report.reading.sources import Run, read_sources
from rbstab.report.runs.answers import largest_v
from rbstab.report.runs.figures.energy import element_figures, energy_figure
from rbstab.report.runs.figures.lyapunov import decay_figure, supply_figures
from rbstab.report.runs.sketches import decay_sketches

TIE = {
    "kind": "visco-elastic",
    "point": [0, 0, 0.1],
    "anchor": [0, 0.1, 0],
    "K_c": [50, 60, 70],
    "L_c": [4, 5, 6],
}


def lines(panel):
    """Return the curves of a panel."""
    assert all(isinstance(mark, Line) for mark in panel.marks)
    return [mark for mark in panel.marks if isinstance(mark, Line)]


def run_of(elements):
    result = simulate(driven(elements | {"foot": TIE}))
    return Run(0, "run-1", "one", Path("one.h5"), result, None)


@pytest.fixture(scope="module")
def shaken():
    ramp = {"kind": "ramp", "start": 0.2, "duration": 0.3}
    return run_of({"push": force(ramp), "turn": couple(SINE)})


def test_the_curves_add_up_to_v(shaken):
    (figure,) = supply_figures(shaken)
    v, supplied, lost = (mark.y for mark in lines(figure.panels[0]))
    np.testing.assert_allclose(v, v[0] + supplied - lost, atol=1e-12)
    assert (np.diff(lost) >= -1e-15).all()
    assert np.abs(supplied).max() > 1e-3
    *powers, dissipated = (mark.y for mark in lines(figure.panels[1]))
    labels = [mark.label for mark in lines(figure.panels[1])]
    assert labels == ["supplied by push", "supplied by turn", "dissipated"]
    rate = shaken.result["lyapunov_rate"]
    np.testing.assert_allclose(sum(powers) - dissipated, rate, atol=1e-12)


def test_dissipation_is_not_minus_the_rate_where_inputs_supply(shaken):
    labels = {panel.y.label: panel for panel in decay_figure([shaken]).panels}
    assert "dissipated power -v'" not in labels
    total = shaken.result["dissipation"].sum(axis=1)
    np.testing.assert_array_equal(lines(labels["dissipated power"])[0].y, total)
    assert "what is supplied minus v'" in energy_figure(shaken).caption


def test_a_passive_run_has_no_such_figure():
    passive = run_of({})
    assert supply_figures(passive) == ()
    assert "add up to -v'" in energy_figure(passive).caption
    labels = [panel.y.label for panel in decay_figure([passive]).panels]
    assert "dissipated power -v'" in labels


def test_an_element_has_one_colour_in_all_figures(shaken):
    """Energies and loads stand below each other in the report; inputs have no energy."""
    energies, (loads,) = energy_figure(shaken), element_figures(shaken)
    by_load = {line.label: line.colour for panel in loads.panels for line in lines(panel)}
    by_energy = {line.label: line.colour for line in lines(energies.panels[2])}
    assert by_load["foot"] == by_energy["foot"]
    assert not {by_load["push"], by_load["turn"]} & {*by_energy.values()}
    assert len(set(by_load.values())) == len(by_load) == 3


def test_the_picture_of_a_run_from_rest_has_its_largest_v(shaken, tmp_path):
    """v(0) is zero there, so v is drawn over its largest value, also of runs beside it."""
    result = shaken.result
    v = result.variables["lyapunov"]
    from_rest = v.data - v.data.min()
    from_rest[0] = 0.0
    variables = result.variables | {"lyapunov": v._replace(data=from_rest)}
    run = replace(shaken, result=replace(result, variables=variables))
    first, second = decay_sketches([run, shaken])
    assert first is not None
    assert second is not None
    assert first.caption.startswith("v(t) over its largest value, over time.")
    for sketch, data in ((first, from_rest), (second, v.data)):
        ((_, points),) = sketch.curves
        inside = data > 0
        expected = (data / data.max())[inside]
        np.testing.assert_allclose(points[inside, 1], expected, atol=1e-12)
    place = int(np.argmax(from_rest))
    text = largest_v(run)
    assert text.startswith(f"{number(from_rest[place])} J at ")
    assert text.endswith(f" {number(result['time'][place])} s")


def test_only_a_driven_run_names_its_largest_v(tmp_path):
    assert largest_v(read_sources([made_file(tmp_path / "a.h5")]).runs[0]) == ""
