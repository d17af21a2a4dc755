"""Protects `docs/elements.md`: its example is the file, its keys, units and drawings are those of
the program. `test_pages_run.py` runs its commands.
"""

import re

import numpy as np
import pytest
from support.documents import (
    FIGURES,
    ROOT,
    assert_same_drawing,
    blocks_of,
    page,
    script,
    section,
    tables,
)

import rbstab
from rbstab.config.elements import RESERVED_NAMES
from rbstab.elements.registry import KINDS as ALL_KINDS

PAGE = page("elements")
KINDS = {kind: methods for kind, methods in ALL_KINDS.items() if kind != "input"}
"""The kinds of the page; inputs have a page of their own."""

PROVED = ("visco-elastic", "embedded", "attitude", "guard", "spring")
"""The kinds beside which the rest state of the tied body of an example is proved to be unique."""

SECTIONS = {
    "visco-elastic": "Visco-elastic tie",
    "embedded": "Embedded tie",
    "sliding": "Sliding tie",
    "coactivated": "Coactivated tie",
}
EXAMPLES = ("elements", "joint", "mounts", "sliding_ties", "coactivation")
"""The examples that together have all kinds."""


@pytest.fixture(scope="module")
def drawings():
    """The program that makes the drawings."""
    return script(FIGURES / "elements.py")


def examples():
    return [rbstab.load_config(ROOT / f"configs/examples/{name}.yaml") for name in EXAMPLES]


def test_the_example_is_the_file():
    (block,) = blocks_of(PAGE, "yaml")
    path = ROOT / "configs/examples/elements.yaml"
    assert block == path.read_text(encoding="utf-8")
    kinds = {element.kind for example in examples() for element in example.elements.values()}
    assert kinds - {"input"} == set(KINDS)


@pytest.mark.parametrize(
    ("kind", "method"), [(k, m) for k, methods in KINDS.items() for m in methods]
)
def test_each_gain_has_its_row_with_its_unit(kind, method):
    text = section(PAGE, SECTIONS.get(kind, kind.title()))
    if method is not None:
        text = section(text, f"Method {method}", "###")
    rows = [row for _, *rows in tables(text) for row in rows if row[0].startswith("`")]
    units = {key.strip("` "): row[2] for row in rows for key in row[0].split(",")}
    element = KINDS[kind][method]
    expected = {gain.name: gain.unit for gain in element.gains}
    expected |= {state.initial_key: state.unit for state in element.states}
    assert units == expected | ({} if method is None else {"method": "-"})
    assert f"| [`{kind}`](#" in PAGE


def test_each_reserved_name_is_listed():
    for name in RESERVED_NAMES:
        assert f"`{name}`" in section(PAGE, "The schema")


def test_the_drawings_are_those_of_the_program(drawings):
    made = drawings.drawings()
    used = re.findall(r"!\[([^\]]+)\]\(figures/(elements_\w+\.svg)\)", PAGE)
    assert {name for _, name in used} == set(made)
    assert {path.name for path in FIGURES.glob("*.svg")} == set(made)
    assert all(len(words) > 60 for words, _ in used)
    for name, text in made.items():
        assert_same_drawing(FIGURES / name, text)


def test_the_curves_are_the_energies_of_the_page(drawings):
    """The energies of the drawings have the closed forms that the page prints."""
    from rbstab.elements.attitude_spring import AttitudeSpring
    from rbstab.elements.guards.barrier import Barrier

    angles = np.linspace(-1.2, 1.2, 7)
    turned = AttitudeSpring(name="", K=20 * np.eye(3), L=np.eye(3))
    for axis in range(3):
        energies = drawings.energies(turned, angles, axis)
        assert energies == pytest.approx(20 * (1 - np.cos(angles)), abs=1e-12)
    guard = Barrier(name="", stiffness=3.0, outer_stiffness=2.0)
    assert drawings.energies(guard, angles, 1) == pytest.approx(1.5 * np.tan(angles) ** 2)
    assert drawings.energies(guard, angles, 0) == pytest.approx(np.tan(angles / 2) ** 2)


def test_small_rotations_have_the_stiffness_that_the_page_says(drawings):
    from rbstab.elements.attitude_spring import AttitudeSpring

    element = AttitudeSpring(name="", K=np.diag([60.0, 60.0, 40.0]), L=np.eye(3))
    small = np.array([1e-3])
    for axis, stiffness in enumerate((50.0, 50.0, 60.0)):
        energies = drawings.energies(element, small, axis)
        assert energies == pytest.approx(0.5 * stiffness * small**2, rel=1e-5)
    assert "50 N m/rad about the first two" in PAGE
    assert "60 about the third" in PAGE


@pytest.mark.slow
def test_the_example_settles_when_the_page_says():
    result = rbstab.simulate(ROOT / "configs/examples/elements.yaml")
    v, t = result["lyapunov"], result["time"]
    assert t[v > v[0] / 1000].max() == pytest.approx(0.8, abs=0.05)
    foot = result.to_xarray()["element_force"].sel(element="foot")
    assert foot.dims == ("time", "axis")


@pytest.mark.parametrize("kind", KINDS)
def test_which_kinds_are_proved(kind):
    elements = [element for example in examples() for element in example.elements.values()]
    section_data = next(e for e in elements if e.kind == kind).model_dump(
        mode="json", exclude_none=True
    )
    config = rbstab.load_config(ROOT / "configs/examples/elements_proved.yaml")
    data = config.model_dump(mode="json", exclude_none=True)
    proof = rbstab.prove(rbstab.load_config(data | {"elements": {"one": section_data}}))
    assert bool(proof.unique) == (kind in PROVED)
    assert proof.every_start == (kind == "guard")
    without = {key: value for key, value in data.items() if key != "controller"}
    assert not rbstab.prove(rbstab.load_config(without)).unique
