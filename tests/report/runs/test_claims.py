"""Protects the section on global stability: what it says is in the stored proofs and runs."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.made_runs import LARGEST_PITCH, V_START, made_config, made_file, made_result
from support.results import with_data

from rbstab.config.load import load_config
from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.proof.exact.expr import Expr, expr, variable
from rbstab.proof.model import Energy
from rbstab.proof.record import energy_record
from rbstab.report.model.document import Table
from rbstab.report.model.figure import Figure, Line, Points
from rbstab.report.reading.sources import read_sources
from rbstab.report.runs.claims import claims_section
from rbstab.report.runs.facts import facts_of
from rbstab.store.document import write_document
from rbstab.store.result import write_result

STIFFNESS = 6.0
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": STIFFNESS}
SECOND = (1.0, 1.1, -0.5)


def config_text(barrier: bool = False, *changes: str) -> str:
    """Return a config with a controller, and with a barrier if wanted."""
    import yaml

    data = yaml.safe_load(made_config(*changes))
    data["schema_version"] = 2
    return made_config_of(data | {"elements": {"range": BARRIER} if barrier else {}})


def made_config_of(data: dict[str, Any]) -> str:
    from rbstab.config.load import resolved_yaml

    return resolved_yaml(load_config(data))


def state(Theta: tuple[float, float, float], energy: float) -> dict[str, Any]:
    box = [[angle - 1e-9 for angle in Theta], [angle + 1e-9 for angle in Theta]]
    return {
        "orientation": Theta,
        "position": (0.0, 0.0, 0.0),
        "connector_state": (),
        "energy": energy,
        "index": 0,
        "proved": True,
        "enclosure": box,
        "index_proved": True,
    }


def energy(barrier: bool) -> dict[str, Any]:
    """Return the record of U = ½ |Θ|², J; with a barrier + ½ k tan² θ2 = ½ k (1/cos² θ2 - 1)."""
    squares = (variable(k) * variable(k) for k in range(3))
    U: Expr = sum(squares, expr(0)).scaled(Fraction(1, 2))
    if barrier:
        U = U + (variable(1).cos() ** -2 - 1).scaled(Fraction(STIFFNESS) / 2)
    return energy_record(Energy(U, closed=frozenset({1} if barrier else ())))


def store_proof(folder: Path, text: str, *, second: bool = False, index: int = 0) -> None:
    """Store a proof of that energy; with the barrier of the config, every start converges."""
    config = load_config(plain(text))
    states = [state((0.0, 0.0, 0.0), 0.0) | {"index": index}] + (
        [state(SECOND, 1.23)] if second else []
    )
    common = {"outcome": "all", "proved": True, "unique": not second, "examined": 1}
    common |= {"undecided": (), "states": states, "region": None}
    wide = common | {"end": (4.0, 1.6, 4.0), "every_start": True if config.elements else None}
    data = common | {"id": proof_id(config), "seconds": 0.1}
    data |= {"reduced_energy": energy(barrier=bool(config.elements))}
    proof = Proof.model_validate(data | {"unwrapped": None if second else wide})
    write_document(proof_file(folder, config), proof.model_dump(mode="json"))


def plain(text: str) -> Any:
    import yaml

    return yaml.safe_load(text)


def section_of(*paths: Path) -> Any:
    return claims_section(facts_of(read_sources(paths).runs))


def row(section: Any) -> list[str]:
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    ((_, *cells),) = table.rows
    return [cell.text for cell in cells]


def figure_of(section: Any) -> Figure:
    (figure,) = [block for block in section.blocks if isinstance(block, Figure)]
    return figure


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    return made_file(tmp_path / "bare.h5", config_text())


@pytest.fixture
def guarded(tmp_path: Path) -> Path:
    return made_file(tmp_path / "guarded.h5", config_text(barrier=True))


def test_without_a_proof_there_is_no_section(bare, guarded):
    assert section_of(bare, guarded) is None


def test_a_body_with_and_without_a_barrier_is_one_row(bare, guarded, tmp_path):
    for barrier in (False, True):
        store_proof(tmp_path, config_text(barrier))
    section = section_of(bare, guarded)
    distance = "proved only for motions that keep a distance from θ2 = ±π/2"
    every = "every start converges: proved (6 N m)"
    assert row(section) == [distance, every, "none known", "globally stable"]
    (table, _) = section.blocks
    assert table.rows[0][0].text == "bare, guarded"


def test_each_alone(bare, guarded, tmp_path):
    for barrier in (False, True):
        store_proof(tmp_path, config_text(barrier))
    section = section_of(guarded)
    assert row(section) == ["every start converges: proved (6 N m)", "globally stable"]
    assert [head.label for head in section.blocks[0].heads] == [
        *("body and controller", "with a barrier on θ2", "the paper on this variant")
    ]
    section = section_of(bare)
    assert [head.label for head in section.blocks[0].heads] == [
        *("body and controller", "without a barrier", "counterexample", "the paper on this variant")
    ]
    assert row(section)[1:] == ["none known", "globally stable"]


def test_a_second_rest_state_is_a_counterexample(bare, guarded, tmp_path):
    store_proof(tmp_path, config_text(), second=True)
    store_proof(tmp_path, config_text(barrier=True))
    cells = row(section_of(bare, guarded))
    # Both are minima, and they are all: every motion that stays in the range ends in one of them.
    assert cells[0] == "not every start; almost every start: proved"
    assert cells[2] == "the body can also rest at the stable rest state 2, Θ = (1, 1.1, -0.5) rad"
    assert cells[1].startswith("every start converges: proved")
    # The barrier of this body proves nothing if its own proof has a second rest state.
    store_proof(tmp_path, config_text(barrier=True), second=True)
    assert row(section_of(guarded))[0] == "not proved"


def test_a_single_rest_state_that_is_no_minimum_is_one_too(bare, tmp_path):
    store_proof(tmp_path, config_text(), index=1)
    cells = row(section_of(bare))
    assert cells[0] == "false: proved"
    assert cells[1] == "the only rest state in the range is not a minimum of the energy"


def test_a_run_that_leaves_the_range_is_a_computed_counterexample(tmp_path):
    path = made_file(tmp_path / "fast.h5", config_text(), status="range left")
    store_proof(tmp_path, config_text())
    cells = row(section_of(path))
    assert cells[0] == "false: a computed motion leaves the range"
    assert cells[1] == "fast leaves the range at 2 s"


def test_other_bodies_have_rows_of_their_own(bare, tmp_path):
    other = made_file(tmp_path / "other.h5", config_text(False, "body.mass=50"))
    store_proof(tmp_path, config_text())
    store_proof(tmp_path, config_text(False, "body.mass=50"))
    (table, figure) = section_of(bare, other).blocks
    assert [cells[0].text for cells in table.rows] == ["bare", "other"]
    assert [panel.title for panel in figure.panels] == ["bare", "other"]


@pytest.mark.parametrize(("factor", "is_shared"), [(3.0, True), (30.0, False)])
def test_bodies_that_are_compared_have_one_scale(factor, is_shared, bare, tmp_path):
    """Panels of different bodies have their own only where one of them would be flat."""
    text = config_text(False, "body.mass=50")
    result = made_result(text)
    changed = with_data(result, "energy", factor * result["energy"])
    write_result(tmp_path / "other.h5", changed)
    store_proof(tmp_path, config_text())
    store_proof(tmp_path, text)
    figure = figure_of(section_of(bare, tmp_path / "other.h5"))
    assert figure.shared == ("xy" if is_shared else "")
    first, other = figure.panels
    assert first.title == "bare"
    (motion,) = [m for m in other.marks if isinstance(m, Line) and m.label == "run without barrier"]
    assert motion.y.max() == factor * V_START


def test_the_curves_are_energies(bare, guarded, tmp_path):
    """U = ½ |Θ|², whose least value along θ2 is ½ θ2²; the barrier adds 3 tan² θ2."""
    for barrier in (False, True):
        store_proof(tmp_path, config_text(barrier))
    (panel,) = figure_of(section_of(bare, guarded)).panels
    lines = {mark.label: mark for mark in panel.marks if isinstance(mark, Line)}
    least, walled = lines["least, without barrier"], lines["least, with barrier"]
    np.testing.assert_allclose(least.y, 0.5 * least.x**2, atol=1e-9)
    drawn = np.isfinite(walled.y)
    expected = 0.5 * walled.x**2 + 3.0 * np.tan(walled.x) ** 2
    np.testing.assert_allclose(walled.y[drawn], expected[drawn], rtol=1e-9, atol=1e-9)
    assert not drawn[[0, -1]].any()
    assert np.nanmax(walled.y) <= 1.15 * V_START
    motion = lines["run with barrier"]
    assert motion.x[0] == LARGEST_PITCH
    assert motion.y[0] == V_START
    (rest,) = [mark for mark in panel.marks if isinstance(mark, Points)]
    np.testing.assert_array_equal(rest.y, 0.0)
