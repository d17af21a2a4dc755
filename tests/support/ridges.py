"""Files with elements of users whose force pushes away from its switch."""

from pathlib import Path

from support.user_code import element_text

OUTWARDS = element_text(
    """
    mode_count = 2
    kinked = True

    def guards(self, motion, own):
        pitch = motion.Theta[1]
        return np.array([pitch - self.soft, -pitch - self.soft])

    def wrench(self, motion, own):
        return couple_on_body(self.k * (self.mode[0] - self.mode[1]) * motion.B[1])

    def stored(self, motion, own):
        above, below = self.guards(motion, own)
        return -self.k * (self.mode[0] * above + self.mode[1] * below)
    """,
    'Gain("k", "N m", "couple", shape="number"), Gain("soft", "rad", "angle", shape="number")',
)
"""A couple away from θ2 = 0, beyond an angle: the opposite of a repelling guard."""

EXAMPLE = Path(__file__).parents[2] / "configs" / "examples" / "latch.py"

LETS_GO = EXAMPLE.read_text(encoding="utf-8").replace("class Latch", "class Mine")
"""A spring to an upright body that lets go where it is stretched too far."""
