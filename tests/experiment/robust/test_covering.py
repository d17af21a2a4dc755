"""Members that lie inside the box of a stored proof, by exact comparison of decimals."""

import numpy as np
import pytest
from support.bodies import config_of

from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust import covering
from rbstab.experiment.robust.bodies import bodies_for
from rbstab.experiment.robust.covering import member_claims, valid_proofs

K_T = ("controller", "K_t", 0)
K_R = ("controller", "K_r", 0)
R_3 = ("body", "contact_point", 2)
TEXTS = ["controller.K_t[0]=±10%", "body.contact_point[2]=±0.01"]


def robust_levels(folder, config, varied, count):
    """Return the level of each member, J, by all proofs in a folder of results; 0: none."""
    return member_claims(valid_proofs(folder, config), config, varied, count)[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of results with the proof of `TEXTS`."""
    config, folder = config_of("permanent"), tmp_path_factory.mktemp("covering")
    assert bodies_for(folder, config, tolerances_of(config, TEXTS)).proved
    return folder


@pytest.mark.parametrize(
    ("varied", "inside"),
    [
        # 0.1 of 4100 is 410: the bounds are 3690 and 4510; those of R are -0.43 and -0.41.
        ({K_T: [3690.0, np.nextafter(3690.0, 0), 4510.0, np.nextafter(4510.0, 1e9)]}, [1, 0, 1, 0]),
        ({R_3: [-0.43, np.nextafter(-0.43, -1), -0.41, np.nextafter(-0.41, 0)]}, [1, 0, 1, 0]),
        ({K_T: [4000.0, 4000.0, 4600.0], R_3: [-0.42, -0.5, -0.42]}, [1, 0, 0]),
        # A number without a tolerance must be that of the proof.
        ({K_R: [400.0, 400.1]}, [1, 0]),
        ({("initial", "angular_velocity", 0): [0.0, 100.0]}, [1, 1]),
        # A plan may give a gain as a matrix where the proof has a diagonal.
        ({("controller", "K_t", 0, 0): [4100.0]}, [0]),
    ],
)
def test_all_numbers_must_lie_inside(folder, varied, inside):
    config = config_of("permanent")
    arrays = {path: np.array(values) for path, values in varied.items()}
    levels = robust_levels(folder, config, arrays, len(inside))
    level = bodies_for(folder, config, tolerances_of(config, TEXTS)).level
    assert levels.tolist() == [level * is_inside for is_inside in inside]


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
def test_other_configs_are_not_covered(folder, config):
    assert not np.any(robust_levels(folder, config, {}, 2))


def test_the_highest_level_counts_and_only_of_proofs_of_these_equations(tmp_path, monkeypatch):
    config = config_of("permanent")
    assert not np.any(robust_levels(tmp_path, config, {}, 3))
    wide, narrow = (
        bodies_for(tmp_path, config, tolerances_of(config, [f"controller.K_t[0]=±{size}%"]))
        for size in (10, 1)
    )
    varied = {K_T: np.array([4110.0, 4300.0])}
    assert robust_levels(tmp_path, config, varied, 2).tolist() == [narrow.level, wide.level]
    wide.model_copy(update={"proved": None}).keep(tmp_path)
    assert robust_levels(tmp_path, config, varied, 2).tolist() == [narrow.level, 0.0]
    # Without a level, each body has one rest state all the same.
    wide.model_copy(update={"level": 0.0}).keep(tmp_path)
    assert robust_levels(tmp_path, config, varied, 2).tolist() == [narrow.level, 0.0]
    members = {K_T: np.array([4300, 9e3])}
    _, states = member_claims(valid_proofs(tmp_path, config), config, members, 2)
    assert states.tolist() == [1, 0]
    monkeypatch.setattr(covering, "bodies_id", lambda *_: "that of other equations")
    assert not np.any(robust_levels(tmp_path, config, varied, 2))


def test_an_entry_and_its_mirror_image_have_the_same_bounds(tmp_path):
    K_t = [[4100, 300, 0], [300, 4100, 0], [0, 0, 3280]]
    config = config_of("permanent", controller={"K_t": K_t})
    assert bodies_for(tmp_path, config, tolerances_of(config, ["controller.K_t[0][1]=±10"])).proved
    values = np.array([290.0, 310.0, 310.1, 300.0])
    mirrored = np.array([290.0, 310.0, 310.1, 311.0])
    varied = {("controller", "K_t", 0, 1): values, ("controller", "K_t", 1, 0): mirrored}
    levels = robust_levels(tmp_path, config, varied, 4)
    assert (levels > 0).tolist() == [True, True, False, False]
