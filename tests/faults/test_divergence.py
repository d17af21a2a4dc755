"""Runs that overflow or reach a limit end with a status, and their results are stored."""

import numpy as np
import pytest
from support.configs import BY_VARIANT, VISCO_ELASTIC, plain
from support.hang_guard import within
from support.problems import each_engine
from support.results import assert_equal

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, run_id
from rbstab.experiment.run_to_file import run_to_file
from rbstab.experiment.simulate import simulate
from rbstab.store.result import open_result

# Changes and the statuses allowed: an integrator may fail before it meets an infinity.
OVERFLOWS = {
    "spin": (["initial.angular_velocity=[1e200, 1e200, 1]"], {"diverged"}),
    "position": (["initial.position=[1e308, 0, 0]"], {"diverged"}),
    "inertia": (["body.inertia=[1e308, 1e308, 1e308]"], {"diverged"}),
    "lever": (["body.contact_point=[1e200, 0, 0]"], {"diverged"}),
    "mass": (["body.mass=1e-300"], {"diverged", "solver failure"}),
    "far": (["initial.position=[1e160, 0, 0]"], {"diverged", "solver failure"}),
    "gains": (["controller.K_c=[1e308, 1e308, 1e308]"], {"diverged", "solver failure"}),
}


@each_engine
@pytest.mark.parametrize("case", OVERFLOWS)
def test_overflow_ends_with_a_status_and_is_stored(tmp_path, case, engine):
    changes, expected = OVERFLOWS[case]
    config = load_config(plain(), [*changes, f"integration.engine={engine}"])
    path = tmp_path / "a.h5"
    filed = within(30, run_to_file, config, path)
    assert filed.result.status in expected
    stored = open_result(path)
    assert_equal(stored, filed.result)
    assert stored.status in expected
    assert " at t = " in str(stored.attributes["status_detail"])
    assert stored["time"][0] == 0.0
    assert len(stored["time"]) < 11
    assert stored.run_id == run_id(config)


@each_engine
def test_the_start_is_kept(tmp_path, engine):
    """If no step is possible, the one sample is the initial state of the config."""
    spin = [1e200, -1e200, 1.0]
    changes = [f"initial.angular_velocity={spin}", f"integration.engine={engine}"]
    result = simulate(load_config(plain(), changes))
    assert result["time"].tolist() == [0.0]
    assert result["angular_velocity"].tolist() == [spin]
    assert result["orientation"].tolist() == [[0.0, 0.0, 0.0]]
    # Its energy overflows: infinity is right here, and no reason to fail.
    assert np.isinf(result["lyapunov"]).all()


LIMITS = {
    "step limit": (["integration.step_limit=3"], {"step limit"}),
    "time limit": (["integration.time_limit=1e-9"], {"time limit"}),
    "range": (
        ["initial.orientation=[0, 1.56, 0]", "initial.angular_velocity=[0, 9, 0]"],
        {"range left"},
    ),
    "endless": (["integration.duration=1e300", "integration.step_limit=50"], {"step limit"}),
}


@pytest.mark.parametrize("variant", BY_VARIANT)
@pytest.mark.parametrize("case", LIMITS)
def test_limits_are_stored_as_statuses(tmp_path, case, variant):
    changes, expected = LIMITS[case]
    config = load_config(plain(BY_VARIANT[variant]), changes)
    filed = run_to_file(config, tmp_path / "a.h5")
    stored = open_result(tmp_path / "a.h5")
    assert {stored.status} == expected
    assert_equal(stored, filed.result)
    assert np.isfinite(stored["orientation"]).all()
    assert (np.diff(stored["time"]) > 0).all()


@each_engine
def test_nothing_is_printed(tmp_path, engine, capfd):
    """The status reports an overflow; no library prints a warning or a message."""
    changes = ["initial.angular_velocity=[1e200, 1e200, 1]", f"integration.engine={engine}"]
    run_to_file(load_config(plain(), changes), tmp_path / "a.h5")
    assert capfd.readouterr() == ("", "")


@each_engine
@pytest.mark.parametrize(
    "changes",
    [
        ["gravity=[0, 0, -1e200]"],
        ["gravity=[0, 0, -1e308]"],
        ["gravity=[0, 1, -1e150]", "controller.anchor=equilibrium", "integration.step_limit=50"],
    ],
)
def test_a_load_beyond_all_numbers(tmp_path, engine, changes):
    config = load_config(plain(VISCO_ELASTIC), [*changes, f"integration.engine={engine}"])
    run_to_file(config, tmp_path / "a.h5")
    assert open_result(tmp_path / "a.h5").status != "completed"


def test_a_duration_too_short_for_its_samples():
    """With coinciding samples one engine would repeat them and the other raise."""
    with pytest.raises(ConfigError, match="are too close"):
        load_config(plain(), ["integration.duration=1e-323"])
