"""Boxes of bodies: what is proved holds for random bodies; what is false is never proved."""

from fractions import Fraction

import numpy as np
import pytest
from support.bodies import (
    box_of,
    config_of,
    lowest_on_border,
    member,
    rest_states_by_scipy,
    some_bodies,
)
from support.rest import inverted_pendulum

from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.certified_region import certified_region
from rbstab.analysis.proof.rest_states import rest_states
from rbstab.analysis.proof.robust.bodies import BodiesOutcome, prove_bodies
from rbstab.analysis.proof.robust.definite import lowest_systems
from rbstab.analysis.proof.robust.numbers import Part
from rbstab.config.load import plain_data
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust.bodies import prove_within

HEAVY = [0.0, 1.0, -9.81]

PROVED = [
    ("permanent", {}, ["controller=±20%", "body.contact_point=±0.01"]),
    ("permanent", {"gravity": HEAVY}, ["controller=±5%", "gravity=±0.2", "body.mass=±2%"]),
    ("visco-elastic", {}, ["controller=±20%", "body.contact_point=±0.01"]),
    ("visco-elastic", {"gravity": HEAVY}, ["controller=±10%", "body.contact_point=±0.01"]),
    ("embedded", {}, ["controller=±20%", "body.contact_point=±0.01"]),
    ("free", {"gravity": HEAVY}, ["controller=±20%"]),
]

LONGEST = {3, 4}
"""The cases that take longest, up to 40 s."""


@pytest.mark.parametrize(
    ("variant", "sections", "texts"),
    [
        pytest.param(*case, marks=pytest.mark.long if k in LONGEST else ())
        for k, case in enumerate(PROVED)
    ],
)
def test_random_bodies_are_as_proved(variant, sections, texts):
    """Scipy searches the configurations of each body, without U and without this proof."""
    rng = np.random.default_rng(8)
    members, part = box_of(config_of(variant, **sections), *texts)
    proof = prove_bodies(members, part)
    assert proof.outcome is BodiesOutcome.PROVED
    assert proof.level > 0
    lowest = np.inf
    for numbers in some_bodies(part, rng, 40):
        system = member(members, numbers)
        (Theta,) = rest_states_by_scipy(system, rng, starts=4)
        at_rest = rest_energy(system, Theta)
        lowest = min(lowest, lowest_on_border(system, rng, starts=1) - at_rest)
    assert proof.level <= lowest + 1e-6
    assert proof.level >= 0.5 * lowest


def rest_energy(system, Theta):
    """Return the energy of the rest state near Θ."""
    from scipy.optimize import root

    at_rest = configurations(system)
    q = np.zeros(at_rest.size)
    q[:3] = Theta
    return at_rest.energy(root(at_rest.gradient, q, tol=1e-13).x)


def test_figures_of_the_trial():
    """Another program proved 733 J in three parts, and 641 J for gains ±30 %."""
    config = config_of("permanent")
    for text, level in (("controller=±20%", 733), ("controller=±30%", 641)):
        proof = prove_bodies(*box_of(config, text, "body.contact_point=±0.01"))
        assert proof.outcome is BodiesOutcome.PROVED
        assert level <= proof.level < 1.1 * level


def test_without_width_it_is_the_proof_of_one_body():
    config = config_of("permanent")
    members, part = box_of(config, "controller=±0.000001%")
    region = certified_region(rest_states(member(members, part.middle)))
    proof = prove_bodies(members, part)
    assert region is not None
    assert proof.level == pytest.approx(region.lower_bound, rel=2e-3)
    assert proof.level <= region.level


def test_wider_boxes_have_lower_levels():
    config = config_of("permanent")
    levels = [
        prove_bodies(*box_of(config, f"controller=±{percent}%")).level for percent in (1, 5, 15, 40)
    ]
    assert np.all(np.diff(levels) < 0)
    assert levels[-1] > 0


@pytest.mark.parametrize("scale", [0.03, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("percent", ["0.001", "1", "20"])
def test_several_rest_states_are_never_proved(scale, percent):
    members, part = box_of(config_of("permanent", scale=scale), f"controller=±{percent}%")
    proof = prove_bodies(members, part, part_limit=6)
    assert proof.outcome is BodiesOutcome.SEVERAL
    assert proof.false is not None
    system = member(members, proof.false.numbers)
    at_rest = configurations(system)
    assert len(proof.false.rest_states) >= 2
    for Theta in proof.false.rest_states:
        assert np.abs(at_rest.gradient(Theta)).max() < 1e-9
    for number, middle, radius in zip(proof.false.numbers, part.middle, part.radius, strict=True):
        assert abs(number - middle) <= radius


def test_a_single_bad_body_at_the_edge_is_enough():
    """With K_r at 0.3 there are two rest states, at 1 there is one; the middle body has one."""
    config = config_of("permanent", scale=0.65)
    members, part = box_of(config, "controller.K_r=±54%")
    proof = prove_bodies(members, part, part_limit=10)
    assert proof.outcome is not BodiesOutcome.PROVED
    assert proof.level == 0


def pendulum(low, high):
    """Return the box of pendulums that stand if k > 100, with k from low to high."""

    def members(numbers, convert):
        system = inverted_pendulum([100.0, 250, 70], 100.0)
        gravity, rotational = system.elements
        K_r = np.array([[numbers[0], 0, 0], [0, 250, 0], [0, 0, 70]], dtype=object)
        from dataclasses import replace

        changed = replace(rotational, K_r=convert(K_r))
        body = replace(
            system.body,
            mass=convert(np.array(1.0))[()],
            inertia=convert(system.body.inertia),
            contact_point=convert(system.body.contact_point),
        )
        weight = replace(gravity, weight=convert(gravity.weight))
        return replace(system, body=body, elements=(weight, changed))

    low, high = Fraction(low), Fraction(high)
    return members, Part(((low + high) / 2,), ((high - low) / 2,))


@pytest.mark.parametrize(
    ("low", "high", "outcome"),
    [
        ("102", "130", BodiesOutcome.PROVED),
        ("70", "95", BodiesOutcome.SEVERAL),
        # Below 100 the pendulum can also rest upright, which is a saddle.
        ("99", "130", BodiesOutcome.NO_MINIMUM),
        ("100", "100.0001", BodiesOutcome.PART_LIMIT),
        ("99.9999999999", "100", BodiesOutcome.PART_LIMIT),
    ],
)
def test_pendulum_is_proved_where_its_equation_says(low, high, outcome):
    """K θ1 = 100 sin θ1 has one root if k >= 100, a threefold one at 100, else three."""
    members, part = pendulum(low, high)
    assert prove_bodies(members, part, part_limit=12).outcome is outcome


def test_sliding_connectors_have_no_energy():
    config = config_of("permanent")
    data = plain_data(config)
    data["controller"] |= {"variant": "sliding", "K_s": [60, 60, 40], "surface": "position"}
    data["integration"] = {"duration": 1.0}
    import rbstab

    proof = prove_bodies(*box_of(rbstab.load_config(data), "controller.K_r=±1%"))
    assert proof.outcome is BodiesOutcome.NO_ENERGY
    assert "no gradient" in proof.reason


def test_all_matrices_must_be_definite():
    """With L_t12 from 0 to 400, L_t is not positive definite for all bodies."""
    L_t = [[200, 150, 0], [150, 200, 0], [0, 0, 140]]
    config = config_of("permanent", controller={"L_t": L_t})
    good = prove_within(config, tolerances_of(config, ["controller.L_t[0][1]=±49"]))
    assert good.proved is True
    diagonal = prove_within(config, tolerances_of(config, ["controller.L_t=±14.2%"]))
    bad = prove_within(config, tolerances_of(config, ["controller.L_t=±14.3%"]))
    assert (diagonal.proved, bad.proved) == (True, None)
    assert "L_t is not positive definite for each body" in bad.why
    assert bad.level == 0


def test_signs_beside_the_diagonal_are_all_tried():
    """A matrix may be definite with all its entries low, and all high, and yet not between."""
    seen = []

    def corner(signs):
        seen.append(signs)
        members, part = box_of(config_of("free"), "controller.K_r=±1%")
        return members(list(part.middle), lambda a: a)

    assert len(list(lowest_systems(corner))) == len(set(seen)) == 8


def test_parts_cover_the_box(monkeypatch):
    """Parts that are wider than a quarter are called undecided here; the others have a level."""
    from rbstab.analysis.proof.boxes import no_boxes
    from rbstab.analysis.proof.robust import bodies
    from rbstab.analysis.proof.robust.energies import energies_of
    from rbstab.analysis.proof.robust.part import PartProof

    members, box = box_of(config_of("permanent"), "controller.K_r[0]=±8%", "controller.K_t[0]=±8%")
    examined: list[Part] = []

    def recorded(members, part):
        examined.append(part)
        return energies_of(members, part)

    def proved(family, near):
        narrow = all(4 * x <= y for x, y in zip(examined[-1].radius, box.radius, strict=True))
        return PartProof(narrow, float(len(examined)), 1, no_boxes(), np.zeros((0, 3)))

    monkeypatch.setattr(bodies, "energies_of", recorded)
    monkeypatch.setattr(bodies, "prove_part", proved)
    monkeypatch.setattr(bodies, "counterexample", lambda *_: None)
    monkeypatch.setattr(bodies, "_axis", lambda *_: bodies._widest(examined[-1]))
    proof = prove_bodies(members, box)
    leaves = [
        one
        for one in examined
        if all(4 * x == y for x, y in zip(one.radius, box.radius, strict=True))
    ]
    assert proof.outcome is BodiesOutcome.PROVED
    assert len(leaves) == 16
    steps = {Fraction(k, 4) for k in (-3, -1, 1, 3)}
    places = {
        tuple(
            (middle - whole) / radius
            for middle, whole, radius in zip(one.middle, box.middle, box.radius, strict=True)
        )
        for one in leaves
    }
    assert places == {(one, two) for one in steps for two in steps}
    # The lowest level of all parts counts: that of the first leaf.
    assert proof.level == examined.index(leaves[0]) + 1


@pytest.fixture
def nothing_proved(monkeypatch):
    """Each part is called undecided, and no counterexample is found."""
    from rbstab.analysis.proof.boxes import no_boxes
    from rbstab.analysis.proof.robust import bodies
    from rbstab.analysis.proof.robust.part import PartProof

    undecided = PartProof(False, 0.0, 1, no_boxes(), np.zeros((0, 3)))
    monkeypatch.setattr(bodies, "prove_part", lambda *_: undecided)
    monkeypatch.setattr(bodies, "counterexample", lambda *_: None)
    return bodies


def test_the_axis_is_that_of_the_whole_box(nothing_proved, monkeypatch):
    members, box = box_of(config_of("permanent"), "controller.K_r[0]=±8%", "controller.K_t[0]=±8%")
    axes = iter([1, 0, 0])
    monkeypatch.setattr(nothing_proved, "_axis", lambda *_: next(axes))
    proof = prove_bodies(members, box, part_limit=3)
    assert (proof.outcome, proof.parts) == (BodiesOutcome.PART_LIMIT, 3)
    assert proof.axis == 1


def test_a_box_of_inertias_is_not_halved(nothing_proved):
    """All bodies of a held point have the same energy, and so have those of halves."""
    members, box = box_of(config_of("permanent"), "body.inertia=±10%", "controller.L_r=±10%")
    proof = prove_bodies(members, box)
    assert (proof.outcome, proof.parts, proof.axis) == (BodiesOutcome.UNDECIDED, 1, None)


def test_a_box_without_a_form_of_its_energy_is_halved_along_its_widest_number(monkeypatch):
    from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
    from rbstab.analysis.proof.robust import bodies
    from rbstab.analysis.proof.robust.energies import energies_of

    members, box = box_of(config_of("permanent"), "controller.K_r[0]=±2%", "controller.K_t[0]=±8%")
    widest = box.radius.index(max(box.radius))

    def of_halves(members, part):
        if part.radius == box.radius:
            raise NoReducedEnergy(next(iter(NoEnergyReason)))
        return energies_of(members, part)

    monkeypatch.setattr(bodies, "energies_of", of_halves)
    proof = prove_bodies(members, box)
    assert (proof.outcome, proof.parts, proof.axis) == (BodiesOutcome.PROVED, 3, widest)


def test_two_proved_rest_states_are_no_proof(monkeypatch):
    """All bodies of this box have two rest states, each of them isolated for all bodies."""
    from rbstab.analysis.proof.robust.energies import energies_of
    from rbstab.analysis.proof.robust.part import prove_part

    members, box = box_of(config_of("permanent", scale=0.2), "controller=±0.01%")
    proof = prove_part(energies_of(members, box).family, np.zeros(3))
    assert not proof.proved
    assert proof.level == 0
