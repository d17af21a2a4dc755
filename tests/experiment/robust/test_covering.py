"""Members that lie inside the box of a stored proof, by exact comparison of decimals."""

from pathlib import Path

import numpy as np
import pytest
from support.bodies import config_of
from support.robust import robust_levels

from rbstab.config.schema import Config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust import covering
from rbstab.experiment.robust.cache import bodies_file, bodies_for
from rbstab.experiment.robust.covering import (
    are_counterexamples,
    counterexample_between,
    have_one_state,
    valid_proofs,
)
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.store.document import write_document

K_T = ("controller", "K_t", 0)
K_R = ("controller", "K_r", 0)
R_3 = ("body", "contact_point", 2)
TEXTS = ["controller.K_t[0]=±10%", "body.contact_point[2]=±0.01"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of results with the proof of `TEXTS`."""
    config = config_of("permanent")
    assert bodies_for(tmp_path, config, tolerances_of(config, TEXTS)).proved
    return tmp_path


def level_of(folder: Path) -> float:
    config = config_of("permanent")
    return bodies_for(folder, config, tolerances_of(config, TEXTS)).level


def test_bounds_are_included_and_nothing_beyond(folder: Path) -> None:
    """0.1 of 4100 is 410: the bounds are 3690 and 4510; those of R are -0.43 and -0.41."""
    K = np.array([3690.0, np.nextafter(3690.0, 0), 4510.0, np.nextafter(4510.0, 1e9), 4000.0])
    levels = robust_levels(folder, config_of("permanent"), {K_T: K}, 5)
    assert (levels > 0).tolist() == [True, False, True, False, True]
    np.testing.assert_array_equal(levels[levels > 0], level_of(folder))
    R = np.array([-0.43, np.nextafter(-0.43, -1), -0.41, np.nextafter(-0.41, 0), -0.42])
    levels = robust_levels(folder, config_of("permanent"), {R_3: R}, 5)
    assert (levels > 0).tolist() == [True, False, True, False, True]


def test_all_numbers_must_lie_inside(folder: Path) -> None:
    inside = {K_T: np.array([4000.0, 4000.0, 4600.0]), R_3: np.array([-0.42, -0.5, -0.42])}
    levels = robust_levels(folder, config_of("permanent"), inside, 3)
    assert (levels > 0).tolist() == [True, False, False]
    # A number without a tolerance must be that of the proof.
    other = {("controller", "K_r", 0): np.array([400.0, 400.1])}
    levels = robust_levels(folder, config_of("permanent"), other, 2)
    assert (levels > 0).tolist() == [True, False]


def test_numbers_of_the_initial_state_have_no_effect(folder: Path) -> None:
    varied = {("initial", "angular_velocity", 0): np.array([0.0, 100.0])}
    assert np.all(robust_levels(folder, config_of("permanent"), varied, 2) > 0)


@pytest.mark.parametrize(
    "config",
    [
        config_of("permanent", scale=0.5),
        config_of("permanent", gravity=[0.0, 0.0, -9.81]),
        config_of("permanent", controller={"anchor": "equilibrium"}),
        config_of("free"),
        config_of("permanent", body={"mass": 42.0}),
    ],
)
def test_other_configs_are_not_covered(folder: Path, config) -> None:
    assert not np.any(robust_levels(folder, config, {}, 2))


def test_unknown_numbers_are_not_covered(folder: Path) -> None:
    """A plan may give a gain as a matrix where the proof has a diagonal."""
    varied = {("controller", "K_t", 0, 0): np.array([4100.0])}
    assert not np.any(robust_levels(folder, config_of("permanent"), varied, 1))


def test_the_highest_level_counts(folder: Path) -> None:
    config = config_of("permanent")
    narrow = bodies_for(folder, config, tolerances_of(config, ["controller.K_t[0]=±1%"]))
    levels = robust_levels(folder, config, {K_T: np.array([4110.0, 4300.0])}, 2)
    assert levels.tolist() == [narrow.level, level_of(folder)]


def test_proofs_of_other_equations_or_without_a_proof_are_left_out(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = config_of("permanent")
    record = bodies_for(folder, config, tolerances_of(config, TEXTS))
    undecided = record.model_copy(update={"proved": None})
    write_document(bodies_file(folder, record.id), undecided.model_dump(mode="json"))
    assert not np.any(robust_levels(folder, config, {}, 1))
    write_document(bodies_file(folder, record.id), record.model_dump(mode="json"))
    assert np.all(robust_levels(folder, config, {}, 1) > 0)
    monkeypatch.setattr(covering, "bodies_id", lambda *_: "that of other equations")
    assert not np.any(robust_levels(folder, config, {}, 1))


def test_an_entry_and_its_mirror_image_have_the_same_bounds(tmp_path: Path) -> None:
    K_t = [[4100, 300, 0], [300, 4100, 0], [0, 0, 3280]]
    config = config_of("permanent", controller={"K_t": K_t})
    record = bodies_for(tmp_path, config, tolerances_of(config, ["controller.K_t[0][1]=±10"]))
    assert record.proved
    values = np.array([290.0, 310.0, 310.1, 300.0])
    mirrored = np.array([290.0, 310.0, 310.1, 311.0])
    varied = {("controller", "K_t", 0, 1): values, ("controller", "K_t", 1, 0): mirrored}
    levels = robust_levels(tmp_path, config, varied, 4)
    assert (levels > 0).tolist() == [True, True, False, False]


def test_a_folder_without_proofs_covers_nothing(tmp_path: Path) -> None:
    assert not np.any(robust_levels(tmp_path, config_of("permanent"), {}, 3))


@pytest.fixture
def several(tmp_path: Path) -> tuple[Path, BodiesRecord]:
    """A folder with a body that has several rest states, in a box of weak stiffnesses."""
    config = config_of("permanent", controller={"K_r": [80, 80, 64]}, gravity=[0.0, 0.0, -9.81])
    record = bodies_for(tmp_path, config, tolerances_of(config, ["controller.K_r[0]=±5"]))
    assert record.proved is False
    assert len(record.rest_states) > 1
    return tmp_path, record


def heavy(K_r: float) -> Config:
    return config_of("permanent", controller={"K_r": [K_r, 80, 64]}, gravity=[0.0, 0.0, -9.81])


def test_a_counterexample_is_one_body_of_its_box(several: tuple[Path, BodiesRecord]) -> None:
    folder, record = several
    assert record.body is not None
    (number,) = record.body.values()
    config = heavy(200.0)
    records = valid_proofs(folder, config)
    assert records == [record]
    values = {K_R: np.array([float(number), 76.0, np.nextafter(float(number), 0)])}
    assert are_counterexamples(records, config, values, 3).tolist() == [True, False, False]
    assert not have_one_state(records, config, values, 3).any()
    assert not robust_levels(folder, config, values, 3).any()


@pytest.mark.parametrize(
    ("least", "most", "inside"), [(0, 1, True), (-1, 0, True), (1, 9, False), (-9, -1, False)]
)
def test_a_counterexample_lies_between_the_ends_of_all_numbers(
    several: tuple[Path, BodiesRecord], least: int, most: int, *, inside: bool
) -> None:
    folder, record = several
    number = float((record.body or {})["controller.K_r[0]"])
    config = heavy(200.0)
    records = valid_proofs(folder, config)
    ends = {K_R: np.array([number + least, number + most])}
    found = counterexample_between(records, config, ends)
    assert (found == record) is inside
    assert (found is None) is not inside
    # The numbers that are not varied must be those of the body.
    assert counterexample_between(records, heavy(200.0), {}) is None
    other = ends | {("controller", "K_r", 1): np.array([81.0, 90.0])}
    assert counterexample_between(records, config, other) is None
    light = config_of("permanent", controller={"K_r": [200.0, 80, 64]})
    assert counterexample_between(records, light, ends) is None


def test_of_several_counterexamples_that_of_the_widest_box_is_named(
    several: tuple[Path, BodiesRecord],
) -> None:
    folder, record = several
    config = heavy(80.0)
    for radius in (1, 2, 7):
        found = bodies_for(folder, config, tolerances_of(config, [f"controller.K_r[0]=±{radius}"]))
        assert found.proved is False
    records = valid_proofs(folder, config)
    ends = {K_R: np.array([70.0, 90.0])}
    for order in (records, records[::-1]):
        assert counterexample_between(order, config, ends) == found
    widths = [float(covering._width(one)) for one in (record, found)]
    assert widths == [10.0, 14.0]


def test_a_proof_without_a_level_is_one_of_one_rest_state(folder: Path) -> None:
    config = config_of("permanent")
    record = bodies_for(folder, config, tolerances_of(config, TEXTS))
    without = record.model_copy(update={"level": 0.0})
    write_document(bodies_file(folder, record.id), without.model_dump(mode="json"))
    values = {K_T: np.array([4000.0, 4600.0])}
    assert not robust_levels(folder, config, values, 2).any()
    found = have_one_state(valid_proofs(folder, config), config, values, 2)
    assert found.tolist() == [True, False]
    assert not are_counterexamples(valid_proofs(folder, config), config, values, 2).any()
    assert counterexample_between(valid_proofs(folder, config), config, values) is None
