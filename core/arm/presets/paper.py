"""The arm of the paper: two revolute joints, two flexible segments of square section.

*Identification of a flexible robot manipulator using a linear parameter-varying descriptor
state-space structure*: l1 = l2 = 0.5 m, m1 = 7.5 kg, m2 = 5 kg, d = 5 cm, Young modulus
epsilon = 1 GPa, so EI = epsilon d^4 / 12 = 520.83 N m^2; one bending mode per segment.
"""

from core.arm.arm import Arm
from core.arm.segment import Segment

ARM = Arm(
    name="paper",
    segments=(
        Segment(length=0.5, mass=7.5, width=0.05, young_modulus=1e9, modes=1),
        Segment(length=0.5, mass=5.0, width=0.05, young_modulus=1e9, modes=1),
    ),
)
