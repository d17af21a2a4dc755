"""Bodies under disturbances: configs, and the held body in equations of its own."""

from typing import Any

import numpy as np

import rbstab
from rbstab.config.build import system_of
from rbstab.proof.disturbed.forms import Load, forms_of
from rbstab.proof.exact.expr import numbers
from support.config_elements import HELD, RANGE, STRUT, TIE, UPRIGHT, config_data
from support.paper_runs import paper_config

COUPLE, FORCE = Load("couple"), Load("force", (0.1, 0.2, 0.4))


def tied_config(variant, **controller):
    """Return a paper's body without gravity."""
    data = paper_config(variant, controller=controller)
    return rbstab.load_config(data | {"gravity": [0.0, 0.0, 0.0]})


def full_config():
    """Return a body of many parts that rests at Θ = 0, but neither at X = 0 nor at E = 0."""
    data: dict[str, Any] = {"schema_version": 2, **paper_config("embedded")}
    gains = {"K_c": [[9000, 800, 0], [800, 7000, 0], [0, 0, 8000]]}
    data["controller"] |= gains | {"K_r": [[400, 50, 20], [50, 400, 0], [20, 0, 320]]}
    data["body"]["contact_point"] = [0.0, 0.0, -0.4]
    data["gravity"] = [0.0, 0.0, -9.81]
    # All forces at rest act along one line through the centre.
    level = {"point": [0.0, 0.0, 0.3], "anchor": [0.0, 0.0, 0.2]}
    data["elements"] = {"tie": {**TIE, **level, "K_c": [900.0, 1100.0, 2000.0]}, "up": UPRIGHT}
    return rbstab.load_config(data)


def sprung_config():
    """Return a held body with a damped spring, a barrier and an attitude spring."""
    # At Θ = 0 the spring pulls along the line from the held point through the centre.
    strut = STRUT | {"point": [0.0, 0.0, 0.3], "anchor": [0.0, 0.0, 1.4]}
    data = config_data({"strut": strut, "range": RANGE, "up": UPRIGHT}, HELD)
    data["body"]["contact_point"] = [0.0, 0.0, -0.42]
    return rbstab.load_config(data)


def forms_of_config(config, *loads):
    """Return V and V' of a config."""
    return forms_of(system_of(config, numbers), loads or (COUPLE,))


def random_matrix(rng, scale):
    """Return a positive definite matrix."""
    M = rng.normal(size=(3, 3))
    return scale * (np.eye(3) + 0.15 * (M @ M.T))


def as_matrix(value):
    """Return a matrix, which a config may give by its diagonal."""
    M = np.array(value, dtype=float)
    return M if M.ndim == 2 else np.diag(M)


class Held:
    """A body held at a point: Jc Ω̇ = Jc Ω × Ω + N - R × A'H + w, in matrices of its own.

    All arrays have the members last.
    """

    def __init__(self, config):
        data = config.plain()
        body, gains = data["body"], data["controller"]
        names = ("K_t", "L_t", "K_r", "L_r")
        self.K_t, self.L_t, self.K_r, self.L_r = (as_matrix(gains[name]) for name in names)
        self.R = R = np.array(body["contact_point"])
        about = R @ R * np.eye(3) - np.outer(R, R)
        self.J = as_matrix(body["inertia"]) + body["mass"] * about

    def attitude(self, Theta):
        """Return A and the columns of B⁻¹: the axes of the three rotations in the body."""
        first, second, third = (_turn(k, Theta[k]) for k in range(3))
        A = np.einsum("ijm,jkm,klm->ilm", first, second, third)
        back = np.einsum("ijm,jkm->ikm", second, third)
        return A, np.stack([back[0], third[1], np.eye(3)[2][:, None] + 0 * Theta], axis=1)

    def energy(self, Theta, Omega):
        """Return ½Ω'JcΩ + ½Θ'K_rΘ + ½X'K_tX with X = R - AR."""
        X = self.R[:, None] - np.einsum("ijm,j->im", self.attitude(Theta)[0], self.R)
        pairs = ((self.J, Omega), (self.K_r, Theta), (self.K_t, X))
        return sum(0.5 * np.einsum("im,ij,jm->m", x, M, x) for M, x in pairs)

    def value(self, Theta, Omega, cross):
        """Return V = energy + ε (B⁻¹Θ)'JcΩ."""
        return self.energy(Theta, Omega) + cross * (self.pull(Theta) * (self.J @ Omega)).sum(axis=0)

    def pull(self, Theta):
        """Return B⁻¹Θ."""
        return np.einsum("ijm,jm->im", self.attitude(Theta)[1], Theta)

    def rates(self, Theta, Omega, w):
        """Return the rates of Θ and Ω."""
        A, columns = self.attitude(Theta)
        B = np.moveaxis(np.linalg.inv(np.moveaxis(columns, 2, 0)), 0, 2)
        at = np.cross(Omega, self.R[:, None], axis=0)  # of C from the centre
        X = self.R[:, None] - np.einsum("ijm,j->im", A, self.R)
        V = -np.einsum("ijm,jm->im", A, at)
        H = -self.K_t @ X - self.L_t @ V
        N = -np.einsum("jim,jm->im", B, self.K_r @ Theta) - self.L_r @ Omega
        lever = -np.cross(self.R[:, None], np.einsum("jim,jm->im", A, H), axis=0)
        spin = -np.cross(Omega, self.J @ Omega, axis=0)
        return np.einsum("ijm,jm->im", B, Omega), np.linalg.solve(self.J, N + lever + spin + w)

    def driven(self, Theta, Omega, load, seconds, h=2e-3):
        """Yield the states of motions under load(t, Θ, Ω) (Runge and Kutta)."""
        for step in range(round(seconds / h)):
            w = load(step * h, Theta, Omega)
            a, b = self.rates(Theta, Omega, w)
            c, d = self.rates(Theta + 0.5 * h * a, Omega + 0.5 * h * b, w)
            e, f = self.rates(Theta + 0.5 * h * c, Omega + 0.5 * h * d, w)
            g, k = self.rates(Theta + h * e, Omega + h * f, w)
            Theta = Theta + h / 6 * (a + 2 * c + 2 * e + g)
            Omega = Omega + h / 6 * (b + 2 * d + 2 * f + k)
            yield Theta, Omega

    def tilt(self, Theta):
        """Return the angle of the rotation."""
        trace = np.einsum("iim->m", self.attitude(Theta)[0])
        return np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))


def random_held(seed):
    """Return a random body that is held at a point."""
    rng = np.random.default_rng(seed)
    # A body of masses at random points is a real one.
    points = rng.normal(size=(8, 3)) * [0.3, 0.2, 0.5]
    J = 5.0 * (np.einsum("ki,ki->", points, points) * np.eye(3) - points.T @ points)
    matrices = {"K_t": 3000.0, "L_t": 150.0, "K_r": 300.0, "L_r": 40.0}
    gains = {name: random_matrix(rng, scale).tolist() for name, scale in matrices.items()}
    R = (0.4 * rng.normal(size=3)).tolist()
    return rbstab.load_config(
        {
            "body": {"mass": 40.0, "inertia": (0.5 * (J + J.T)).tolist(), "contact_point": R},
            "controller": {"variant": "permanent", **gains},
            "initial": {},
            "integration": {"duration": 1.0},
        }
    )


def _turn(axis, angle):
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((3, 3, len(angle)))
    turn[axis, axis] = 1.0
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
    return turn
