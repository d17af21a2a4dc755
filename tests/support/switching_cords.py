"""Files with elements of users that have own states and switch."""

from support.user_code import element_text

CORD = element_text(
    """
    states = (OwnState("creep", "D", "m", "creep", size=1),)

    def share(self, motion, states):
        return (position(motion, self.point)[0] - states[0]) / 0.3

    def rates(self, motion, states):
        return (6 * (exp(self.share(motion, states)) - 1) - 30 * states) / 2

    def wrench(self, motion, states):
        tension = 6 * (exp(self.share(motion, states)) - 1)
        pull = force_at(motion, self.point, np.array([-tension, 0, 0]))
        return pull

    def stored(self, motion, states):
        x = self.share(motion, states)
        return 1.8 * (exp(x) - x - 1) + 15 * states[0] ** 2

    def dissipated(self, motion, states):
        return 2 * self.rates(motion, states)[0] ** 2
    """,
    'POINT, Gain("k", "1", "strength of the switches", shape="number"), '
    'Gain("soft", "rad", "angle", shape="number")',
)
"""A cord along e1 that stiffens and creeps."""

SWITCHES = """
    mode_count = 2

    def guards(self, motion, states):
        pitch = motion.Theta[1]
        return np.array([pitch - self.soft, -pitch - self.soft])

    def rates"""

STIFF = {
    "    def rates": SWITCHES,
    "        return pull\n": """\
        above, below = self.mode * self.guards(motion, states)
        push = couple_on_body(-self.k * (above - below) * motion.B[1])
        return pull._replace(couple=pull.couple + push.couple)
""",
    "+ 15 * states[0] ** 2": """+ 15 * states[0] ** 2 + 0.5 * self.k * (
            self.mode @ power(self.guards(motion, states), 2)
        )""",
}
"""What makes the cord one with a stiff guard."""

REPELLING = {
    "    def rates": SWITCHES,
    "        return pull\n": """\
        push = couple_on_body(-self.k * (self.mode[0] - self.mode[1]) * motion.B[1])
        return pull._replace(couple=pull.couple + push.couple)
""",
    "+ 15 * states[0] ** 2": "+ 15 * states[0] ** 2 "
    "+ self.k * (self.mode @ self.guards(motion, states))",
}
"""What makes the cord one with a repelling guard."""

TIGHTER = element_text(
    """
    mode_count = 1
    states = (OwnState("creep", "D", "m", "creep", size=2),)

    def longer(self, motion):
        return position(motion, self.point)[1] + self.soft

    def guards(self, motion, states):
        return np.array([self.longer(motion)])

    def slopes(self, motion, states):
        e = position(motion, self.point)[0] - states[0]
        p = self.mode[0] * power(self.longer(motion), 2)
        first = -20 * e - 40 * power(e, 3) + 10 * states[0] - 4 * states[1]
        first = first + 2 * self.k * states[0] * p
        return np.array([first, 12 * states[1] - 4 * states[0]])

    def rates(self, motion, states):
        return -0.5 * self.slopes(motion, states)

    def wrench(self, motion, states):
        e = position(motion, self.point)[0] - states[0]
        g = self.mode[0] * self.longer(motion)
        pull = np.array([20 * e + 40 * power(e, 3), 2 * self.k * (1 + power(states[0], 2)) * g, 0])
        return force_at(motion, self.point, -pull)

    def stored(self, motion, states):
        e = position(motion, self.point)[0] - states[0]
        springs = 10 * power(e, 2) + 10 * power(e, 4)
        matrix = 5 * states[0] * states[0] - 4 * states[0] * states[1] + 6 * states[1] * states[1]
        p = self.mode[0] * power(self.longer(motion), 2)
        return springs + matrix + self.k * (1 + power(states[0], 2)) * p

    def dissipated(self, motion, states):
        a, b = self.slopes(motion, states)
        return 0.5 * (power(a, 2) + power(b, 2))
    """,
    'POINT, Gain("k", "N/m", "stiffness", shape="number"), '
    'Gain("soft", "m", "place", shape="number")',
)
"""Springs with a matrix that is not diagonal, and one whose strength depends on an own state."""

CLUTCH = (
    TIGHTER[: TIGHTER.index("    def longer")]
    + """\
    def guards(self, motion, states):
        return np.array([motion.Theta[1] + self.soft])

    def rates(self, motion, states):
        return np.array([self.mode[0] * velocity(motion, self.point)[0], 0]) - self.k * states

    def wrench(self, motion, states):
        return force_at(motion, self.point, np.array([-self.mode[0] * self.k * states[0], 0, 0]))

    def stored(self, motion, states):
        return 0.5 * self.k * (states @ states)

    def dissipated(self, motion, states):
        return self.k * self.k * (states @ states)
"""
)
"""Its energy has no kink, but its force jumps at the switch while the own state is not at rest."""

LINEAR = (
    ("6 * (exp(self.share(motion, states)) - 1)", "60 * self.share(motion, states)"),
    ("1.8 * (exp(x) - x - 1)", "9 * x * x"),
)
"""What makes a cord a linear one, with an energy that is quadratic in X and D."""


def linear(text):
    for old, new in LINEAR:
        assert old in text
        text = text.replace(old, new)
    return text


def text_of(changes):
    text = CORD
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text
