"""Protects what figures say of driven runs: supplied and dissipated energy add up to v."""

from pathlib import Path

import numpy as np
import pytest
from support.figure_runs import lines_of
from support.inputs import SINE, couple, driven, force
from support.results import with_data

from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.simulate import simulate
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.events import events_figure
from rbstab.report.runs.figures.lyapunov import decay_figure, energy_figure
from rbstab.report.runs.sketches import decay_sketches

TIE = {
    "kind": "visco-elastic",
    "point": [0, 0, 0.1],
    "anchor": [0, 0.1, 0],
    "K_c": [50, 60, 70],
    "L_c": [4, 5, 6],
}


def run_of(elements):
    result = simulate(driven(elements | {"foot": TIE}))
    return Run(Path("one.h5"), result, None, name="run-1", label="one")


@pytest.fixture(scope="module")
def shaken():
    ramp = {"kind": "ramp", "start": 0.2, "duration": 0.3}
    return run_of({"push": force(ramp), "turn": couple(SINE)})


def test_the_curves_add_up_to_v(shaken):
    energies, powers = decay_figure([shaken]).panels
    v, supplied, lost = (line.y for line in lines_of(energies))
    np.testing.assert_allclose(v, v[0] + supplied - lost, atol=1e-12)
    assert (np.diff(lost) >= -1e-15).all()
    assert np.abs(supplied).max() > 1e-3
    *each, dissipated = lines_of(powers)
    assert [line.label for line in each] == ["supplied by push", "supplied by turn"]
    rate = shaken.result["lyapunov_rate"]
    np.testing.assert_allclose(sum(line.y for line in each) - dissipated.y, rate, atol=1e-12)
    assert "what is supplied minus v'" in energy_figure(shaken).caption
    assert "v may rise" in decay_figure([shaken, run_of({})]).caption


def test_the_loads_of_elements_are_the_sizes_of_their_forces(shaken):
    figure = events_figure(shaken)
    assert figure is not None
    # An element has one colour in all figures; inputs have no energy.
    sizes = {line.label: line.colour for line in lines_of(energy_figure(shaken).panels[2])}
    colours = {line.label: line.colour for p in figure.panels for line in lines_of(p)}
    assert colours["foot"] == sizes["foot"]
    assert not {colours["push"], colours["turn"]} & {*sizes.values()}
    forces = {line.label: line.y for line in lines_of(figure.panels[0])}
    for number_, name in enumerate(shaken.result["element"].tolist()):
        size = np.linalg.norm(shaken.result["element_force"][:, number_], axis=1)
        if size.any():
            np.testing.assert_array_equal(forces.pop(name), size)
    assert not forces


def test_a_run_from_rest_has_its_largest_v(shaken):
    """v(0) is zero there, so v is drawn over its largest value, also of runs beside it."""
    from dataclasses import replace

    v = shaken.result["lyapunov"]
    from_rest = v - v.min()
    from_rest[0] = 0.0
    run = replace(shaken, result=with_data(shaken.result, "lyapunov", from_rest))
    for sketch, data in zip(decay_sketches([run, shaken]), (from_rest, v), strict=True):
        assert sketch is not None
        assert sketch.caption.startswith("v(t) over its largest value, over time.")
        ((_, points),) = sketch.curves
        inside = data > 0
        np.testing.assert_allclose(points[inside, 1], (data / data.max())[inside], atol=1e-12)
    place = int(np.argmax(from_rest))
    at = f"{number(from_rest[place])} J at {number(run.result['time'][place])} s"
    assert FACTS["largest v"].text(run) == at
    assert FACTS["largest v"].text(run_of({})) == ""
