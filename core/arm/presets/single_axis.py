"""One rigid load on a motor-driven slide: the smallest rig that the model covers.

The mass is near that of EMPS, the electro-mechanical positioning system of Janot, Gautier and
Brunot ("Data set and reference models of EMPS", nonlinearbenchmark.org: 95.109 kg). The length
plays no part in its motion.
"""

from core.arm.arm import Arm
from core.arm.segment import Segment

ARM = Arm(
    name="single_axis",
    segments=(Segment(length=0.1, mass=95.0, modes=0, joint="prismatic"),),
)
