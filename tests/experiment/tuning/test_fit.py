"""Protects fits: they find known gains from noise, their intervals hold, and they say what the data
do not tell.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2
from support.config_elements import BAND, EACH_KIND, config_data
from support.problems import solve
from support.switching import data as switching_data
from support.user_code import element_text, python_section

from rbstab.config.build import problem_of
from rbstab.config.files.measured import read_measured
from rbstab.config.load import load_config
from rbstab.config.numbers import entries_of, replaced
from rbstab.experiment.tuning import fit as module
from rbstab.experiment.tuning.fit import FreeMotion, fit
from rbstab.experiment.tuning.gain_scaling import TuningError

pytest.importorskip("heyoka")

MASS, INERTIA = 4.0, 2.0
TRUE = {"K_t": 100.0, "L_t": 8.0, "K_r": 30.0, "L_r": 3.0}
START = {"X": 0.3, "Theta": 0.2}
TIMES = np.linspace(0.05, 3.0, 40)
FREE = ["controller.K_t[2]", "controller.L_t[2]", "controller.K_r[0]", "controller.L_r[0]"]


def body(factor=1.0, **changes):
    """Return the config of a body that moves along axis 3 and turns about axis 1."""
    gains = {name: [value * factor] * 3 for name, value in TRUE.items()}
    return {
        "body": {"mass": MASS, "inertia": [INERTIA, 1.5, 1.0], "contact_point": [0.1, 0.1, -0.4]},
        "controller": {"variant": "free"} | gains,
        "initial": {"position": [0, 0, START["X"]], "orientation": [START["Theta"], 0, 0]},
        "integration": {"duration": 4.0},
    } | changes


def oscillation(inertia, stiffness, damping, start, t):
    """Return the closed solution of a damped oscillator that is let go."""
    rate = damping / (2 * inertia)
    frequency = math.sqrt(stiffness / inertia - rate**2)
    wave = np.cos(frequency * t) + rate / frequency * np.sin(frequency * t)
    return start * np.exp(-rate * t) * wave


def closed(gains=TRUE, t=TIMES):
    """Return the closed solution of x3 and theta1, shape (n, 2)."""
    x = oscillation(MASS, gains["K_t"], gains["L_t"], START["X"], t)
    theta = oscillation(INERTIA, gains["K_r"], gains["L_r"], START["Theta"], t)
    return np.stack([x, theta], axis=1)


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def measured(values, heads=("x3 [mm]", "theta1 [rad]"), t=TIMES):
    """Write a measured motion, with gaps where a value is NaN; positions are given in m."""
    sizes = [1000.0 if head.endswith("[mm]") else 1.0 for head in heads]
    rows = np.column_stack([t, values * sizes]).tolist()
    cells = (",".join("" if math.isnan(n) else repr(n) for n in row) for row in rows)
    Path("data.csv").write_text("\n".join([",".join(["time [s]", *heads]), *cells]))
    return "data.csv"


def noisy(seed, sizes=(0.002, 0.02)):
    """Return the closed solution with noise of a size in each column, m and rad."""
    return closed() + np.random.default_rng(seed).normal(size=(len(TIMES), 2)) * sizes


def test_known_gains_are_found_without_noise():
    estimate = fit(body(1.5), measured(closed()), FREE)
    np.testing.assert_allclose(
        [number.fitted for number in estimate.numbers], [*TRUE.values()], rtol=1e-7
    )
    assert estimate.is_minimum
    assert estimate.config.controller.K_t == (150.0, 150.0, estimate.numbers[0].fitted)
    # What is left is round-off: it is neither weighed nor judged.
    assert not estimate.warnings


def test_19_of_20_intervals_hold_the_truth():
    """Of 30 measurements with noise of another size in each column."""
    repetitions, truth = 30, np.array([*TRUE.values()])
    inside, squares = 0, 0.0
    for seed in range(repetitions):
        estimate = fit(body(1.2), measured(noisy(seed)), FREE)
        assert estimate.is_minimum
        fitted, error, low, high = np.array([entry[3:] for entry in estimate.numbers]).T
        inside += int(((low < truth) & (truth < high)).sum())
        squares += float((((fitted - truth) / error) ** 2).sum())
        scatter = [entry.scatter for entry in estimate.columns]
        np.testing.assert_allclose(scatter, (0.002, 0.02), rtol=0.4)
    # A right program is outside of these ends once in 1000 times. The errors are estimated, too: a
    # square of n degrees of freedom has the mean n / (n - 2).
    count, freedom = repetitions * len(truth), 2 * len(TIMES) - len(truth)
    assert binom.ppf(5e-4, count, 0.95) <= inside <= binom.ppf(1 - 5e-4, count, 0.95)
    low, high = chi2.ppf([5e-4, 1 - 5e-4], count)
    assert low < squares * (freedom - 2) / freedom < high


def test_columns_that_share_no_number_have_the_intervals_of_fits_of_each_alone():
    """Also if one has many values and the other few: then few values are not taken for many."""
    values = noisy(4)
    values[np.arange(len(TIMES)) % 6 > 0, 0] = np.nan
    both = fit(body(1.2), measured(values), FREE)
    assert [entry.values for entry in both.columns] == [7, 40]
    for at, head, keys in ((0, "x3 [mm]", FREE[:2]), (1, "theta1 [rad]", FREE[2:])):
        there = np.isfinite(values[:, at])
        alone = fit(body(1.2), measured(values[there][:, [at]], [head], TIMES[there]), keys)
        numbers = both.numbers[2 * at : 2 * at + 2]
        for entry, other in zip(numbers, alone.numbers, strict=True):
            np.testing.assert_allclose(entry[3:], other[3:], rtol=2e-3)
        assert both.columns[at].scatter == pytest.approx(alone.columns[0].scatter, rel=2e-3)


def test_a_number_that_falls_to_zero_says_how_large_it_may_be():
    """By linear regression at a damping of 0: differences of the closed solution."""
    # The motion that is measured grows.
    angles = closed(TRUE | {"L_r": -0.1})[:, 1] + np.random.default_rng(1).normal(0, 0.02, 40)
    estimate = fit(body(), measured(angles[:, None], ALL[:1]), FREE[2:])
    stiffness, damping = estimate.numbers
    assert estimate.is_minimum
    assert 0 <= damping.fitted < 1e-5

    def theta(K, L):
        return oscillation(INERTIA, K, L, START["Theta"], TIMES)

    K, h = stiffness.fitted, 1e-4
    steps = [theta(K + h, 0) - theta(K - h, 0), theta(K, h) - theta(K, -h)]
    slopes = np.stack(steps, axis=1) / (2 * h)
    sigma = math.sqrt(((angles - theta(K, 0)) ** 2).sum() / (40 - 2))
    errors = sigma * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    np.testing.assert_allclose([stiffness.error, damping.error], errors, rtol=0.02)
    assert damping.high == pytest.approx(2.024 * errors[1], rel=0.02)
    (warning,) = estimate.warnings
    assert warning.startswith("controller.L_r[0]: fell to almost 0, and may not be less")


def test_angles_without_their_whole_turns_are_told():
    data = body(initial={"angular_velocity": [9.0, 0, 0]})
    data["controller"] |= {"K_r": [0.0] * 3, "L_r": [0.5] * 3}
    t = TIMES[:, None]
    turned = 9.0 * INERTIA / 0.5 * (1 - np.exp(-0.5 / INERTIA * t))
    assert turned.max() > 2 * np.pi
    keys = ["controller.L_r[0]"]
    assert not fit(data, measured(turned, ALL[:1]), keys).warnings
    wrapped = (turned + np.pi) % (2 * np.pi) - np.pi
    estimate = fit(data, measured(wrapped, ALL[:1]), keys)
    assert "theta1: jumps by more than half a turn" in "".join(estimate.warnings)
    # A damper that would stop it at once: the motions would take hours.
    assert 100 < estimate.numbers[0].fitted <= 5000


PENDULUM = Path(__file__).parents[2] / "data/pendulum.csv"


def test_a_measured_pendulum_is_as_its_authors_found():
    """They give a, m, I, k and g of (m a² + I) θ̈ = m g a sin θ - k θ̇ (arXiv 2205.06231).

    A swing knows the ratios of these alone: the length of the equal pendulum of a point, and the
    rate of damping. The authors fitted four parts at once, with a fixed start of each.
    """
    a, m, inertia, k, g = 0.147754901, 0.147584572, 1.09118505e-4, 2.23940125e-4, 9.81001310
    data = {
        "body": {"mass": m, "inertia": [2 * inertia] * 3, "contact_point": [0, 0, -a]},
        "gravity": [0, 0, -g],
        "controller": {"variant": "permanent", "K_r": [0] * 3, "L_r": [3 * k] * 3},
        "initial": {"orientation": [2.2, 0, 0], "angular_velocity": [3.0, 0, 0]},
        "integration": {"duration": 9.2},
    }
    free = ["controller.L_r[0]", "body.inertia[0]"]
    free += ["initial.orientation[0]", "initial.angular_velocity[0]"]
    estimate = fit(data, PENDULUM, free)
    assert estimate.is_minimum
    damping, about_centre = (number.fitted for number in estimate.numbers[:2])
    about_pivot, published = m * a**2 + about_centre, m * a**2 + inertia
    assert about_pivot / (m * a) == pytest.approx(published / (m * a), rel=5e-3)
    assert damping / about_pivot == pytest.approx(k / published, rel=0.25)
    # It swings through two radians, and the residuals are a thousandth of it. They are not noise:
    # friction in a bearing is not quite viscous.
    assert estimate.columns[0].scatter < 2e-3
    assert [w.partition(":")[0] for w in estimate.warnings] == ["theta1"]


SMOOTH = config_data(elements=EACH_KIND, integration={"duration": 0.4, "samples": 21})
SWITCHING = switching_data({"band": BAND}, {"angular_velocity": [0.3, 0.2, 0.1]}, {"duration": 0.5})
ALL = ("theta1 [rad]", "theta3 [rad]", "omega2 [rad/s]", "x1 [m]", "e2 [m]", "e3 [m]")
CHANGES = [
    (SMOOTH, "body.mass"),
    (SMOOTH, "body.contact_point[2]"),
    (SMOOTH, "controller.K_r[1]"),
    (SMOOTH, "elements.tie.K_c[0][1]"),
    (SMOOTH, "initial.orientation[0]"),
    (SWITCHING, "elements.band.stiffness"),
    (SWITCHING, "elements.band.slack_length"),
]


@pytest.mark.parametrize(("data", "key"), CHANGES)
def test_the_jacobian_is_that_of_differences_of_other_runs(data, key):
    """By finite differences of fourth order, with SciPy instead of heyoka."""
    config = load_config(data)
    (entry,) = [candidate for candidate in entries_of(config) if candidate.key == key]
    t = np.linspace(0.1, 0.4, 4)
    motion = FreeMotion(config, [entry], read_measured(measured(np.ones((4, 6)), ALL, t)))
    x, step, columns = np.array([0.0]), 2e-3, motion.data.columns

    def run(number):
        problem = problem_of(replaced(config, dict.fromkeys(entry.paths, number)))
        times = np.concatenate([[0.0], t])
        trajectory = solve("scipy", replace(problem, rtol=3e-14, atol=1e-15, times=times))
        motions = [trajectory.systems[0].motion(y) for y in trajectory.states[1:]]
        return np.array([[getattr(m, c.vector)[c.axis] for c in columns] for m in motions])

    size = float(motion.numbers(x)[1][0])
    assert size == abs(entry.value)
    ends = [run(entry.value + k * step * size) for k in (-2, -1, 1, 2)]
    differences = ((ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)).ravel()
    scale = np.abs(differences).max()
    assert scale > 0
    assert np.abs(motion.jacobian(x)[:, 0] - differences).max() < 2e-6 * scale


def test_a_gap_is_as_if_the_row_were_not_there():
    values, there = noisy(1), np.arange(len(TIMES)) % 5 > 0
    fewer = fit(body(1.2), measured(values[there], t=TIMES[there]), FREE)
    values[~there] = np.nan
    gaps = fit(body(1.2), measured(values), FREE)
    for entry, other in zip(gaps.numbers, fewer.numbers, strict=True):
        np.testing.assert_allclose(entry[3:], other[3:], rtol=1e-6)
    assert [entry.values for entry in gaps.columns] == [32, 32]
    rho = [[entry.autocorrelation for entry in estimate.columns] for estimate in (gaps, fewer)]
    np.testing.assert_allclose(rho[0], rho[1], rtol=1e-6)


def test_residuals_of_columns_that_take_turns_are_compared_with_the_next_of_their_own():
    """A damper is missing, as below; no row has both columns."""
    data = body(1.2)
    data["controller"] |= {"L_r": [1e-6] * 3}
    values = noisy(7)
    values[::2, 0] = values[1::2, 1] = np.nan
    estimate = fit(data, measured(values), ["controller.K_t[2]", "controller.K_r[0]"])
    assert estimate.columns[1].autocorrelation > 0.3
    residuals = estimate.residuals[::2, 1]
    scatter = np.sqrt((residuals**2).mean())
    rho = (residuals[1:] * residuals[:-1]).mean() / scatter**2
    assert estimate.columns[1].autocorrelation == pytest.approx(rho, rel=0.1)


PRODUCT = element_text(
    """
    def wrench(self, motion, states):
        return force_at_centre(-self.a * self.b * motion.X)

    def stored(self, motion, states):
        return 0.5 * self.a * self.b * (motion.X @ motion.X)
    """,
    'Gain("a", "N/m", "a", shape="number"), Gain("b", "1", "b", shape="number")',
)
AB = ["elements.mine.parameters.a", "elements.mine.parameters.b"]


def test_two_numbers_of_which_only_the_product_matters_are_not_determined():
    Path("mine.py").write_text(PRODUCT)
    data = body(schema_version=2, elements={"mine": python_section(a=10.0, b=3.0)})
    data["controller"] |= {"K_t": [70.0] * 3}
    estimate = fit(data, measured(noisy(3)), [*AB, "controller.L_t[2]"], allow_python=True)
    a, b, damping = estimate.numbers
    assert (a.low, a.high, b.error) == (-math.inf, math.inf, math.inf)
    assert (a.fitted * b.fitted) == pytest.approx(30.0, rel=0.05)
    # What the others do not hide is still known.
    assert damping.low < TRUE["L_t"] < damping.high
    assert damping.error < 0.3
    ((changes, reach),) = estimate.loose
    assert math.isinf(reach)
    np.testing.assert_allclose(changes / changes[0], [1, -1, 0], atol=1e-6)
    (warning,) = estimate.warnings
    sign = 1 if changes[0] > 0 else -1
    change = f"{AB[0]} {sign:+d} %, {AB[1]} {-sign:+d} %"
    assert warning == f"not determined: {change}: what was measured stays, to first order"
    alone = fit(data, measured(noisy(3)), [AB[0], "controller.L_t[2]"], allow_python=True)
    assert not alone.warnings
    assert alone.numbers[0].low < 10.0 < alone.numbers[0].high


def test_all_that_makes_a_motion_grows_together():
    """Without gravity a motion depends on the gains by their ratios to mass and inertia alone."""
    keys = ["controller.K_r[0]", "controller.L_r[0]", "body.inertia[0]"]
    estimate = fit(body(1.2), measured(noisy(5)), keys)
    np.testing.assert_allclose(estimate.loose[0][0], [1, 1, 1], atol=1e-6)
    assert all(math.isinf(number.error) for number in estimate.numbers)
    stiffness, damping, inertia = (number.fitted for number in estimate.numbers)
    assert stiffness / inertia == pytest.approx(TRUE["K_r"] / INERTIA, rel=0.1)
    assert damping / inertia == pytest.approx(TRUE["L_r"] / INERTIA, rel=0.3)


HIDDEN = "controller.K_r[1]"


def test_a_number_that_moves_nothing_measured_is_not_determined():
    estimate = fit(body(1.2), measured(noisy(5)), [*FREE, HIDDEN])
    assert [math.isinf(number.error) for number in estimate.numbers] == [False] * 4 + [True]
    (warning,) = estimate.warnings
    assert warning == f"not determined: {HIDDEN} +1 %: what was measured stays, to first order"


def test_a_number_that_noise_hides_is_hardly_determined():
    estimate = fit(body(), measured(noisy(6, (0.002, 0.15))), FREE)
    wide = [
        number.name for number in estimate.numbers if number.high - number.low > 2 * number.fitted
    ]
    assert wide == ["controller.L_r[0]"]
    (warning,) = estimate.warnings
    assert warning.startswith("hardly determined: controller.")
    assert "controller.L_r[0] +1 %" in warning


def test_a_number_that_is_zero_has_no_relative_change():
    """So an interval of several m/s is no reason to warn."""
    estimate = fit(body(), measured(noisy(6, (5.0, 0.02))), ["initial.velocity[2]", *FREE[2:]])
    number = estimate.numbers[0]
    assert number.given == 0.0
    assert number.low + 2.0 < 0.0 < number.high - 2.0
    assert len(estimate.loose) == 1
    assert not estimate.warnings


def test_a_model_that_misses_something_is_told():
    """Here the damper of the angle: the residuals swing."""
    data = body(1.2)
    data["controller"] |= {"L_r": [1e-6] * 3}
    estimate = fit(
        data, measured(noisy(7)), ["controller.K_t[2]", "controller.L_t[2]", "controller.K_r[0]"]
    )
    (warning,) = estimate.warnings
    assert warning.startswith("theta1: successive residuals are alike (autocorrelation 0.")


def test_a_fit_that_ends_early_is_no_minimum(monkeypatch):
    monkeypatch.setattr(module, "MAX_RUNS", 2)
    estimate = fit(body(3.0), measured(noisy(8)), FREE)
    assert not estimate.is_minimum
    assert " to " not in repr(estimate)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (["controller.K_q"], "controller.K_q: is no number to fit"),
        (["integration.rtol"], "integration.rtol: is no number to fit"),
        ([""], ": is no number to fit"),
        (["controller.K_t", "controller"], "controller: is no number to fit"),
        (
            ["controller", "body", "initial"],
            r"data.csv: x3: has 20 values \(expected more than the 31 free",
        ),
        ([], "no number to fit"),
    ],
)
def test_what_cannot_be_fitted_is_refused(keys, message):
    few = measured(noisy(9)[:20], t=TIMES[:20])
    with pytest.raises(TuningError, match=message):
        fit(body(), few, keys)
