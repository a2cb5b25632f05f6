"""The two-stage serial flexible link bench (quanser_2dsfl_steps, ctu_2dsfl_lqr), coupled.

Nominal values of the manufacturer, all on the joint side: link stiffness 39.96 and
6.858 N m/rad (root moment over chord angle), hub inertia 0.06354 and 0.00302 kg m^2,
link-plus-load inertia 0.1704 and 0.006439 kg m^2, link damping 0 and 0.0856 N m s/rad, links of
0.202 m, 1.578 kg of stage 2 on the tip of link 1.

How they enter the arm, with two modes per link so that a tip load bends it exactly:
- a tip force bends a cantilever by a chord angle of root moment l / (3 EI), so EI = K l / 3;
- the steel links weigh 0.153 and 0.054 kg (1.27 mm x 76.2 mm and 0.889 mm x 38.1 mm sections);
- link 2's load is the tip mass that gives 0.006439 kg m^2 about joint 2;
- link 1 carries the 1.578 kg of stage 2. The manufacturer's 0.1704 kg m^2 lumps into one number
  what this arm has explicitly; `two_stage_uncoupled` is that model;
- damping 0.0856 N m s/rad over 6.858 N m/rad is a damping time of 12.5 ms.
"""

from core.arm.arm import Arm
from core.arm.segment import Segment

LENGTH = 0.202
STIFFNESS = (39.96, 6.858)
LINK_MASS = (0.1535, 0.0537)
HUB_INERTIA = (0.06354, 0.00302)
LINK_AND_LOAD = (0.1704, 0.006439)
STAGE_MASS = 1.578
LINK_DAMPING = 0.0856


def lumped_load(stage: int) -> float:
    """The tip mass in kg that gives a stage (from 0) its link-plus-load inertia."""
    return LINK_AND_LOAD[stage] / LENGTH**2 - LINK_MASS[stage] / 3.0


FIRST = Segment(
    length=LENGTH,
    mass=LINK_MASS[0],
    EI=STIFFNESS[0] * LENGTH / 3.0,
    modes=2,
    tip_mass=STAGE_MASS,
    hub_inertia=HUB_INERTIA[0],
)
SECOND = Segment(
    length=LENGTH,
    mass=LINK_MASS[1],
    EI=STIFFNESS[1] * LENGTH / 3.0,
    modes=2,
    damping_time=LINK_DAMPING / STIFFNESS[1],
    tip_mass=lumped_load(1),
    hub_inertia=HUB_INERTIA[1],
)

ARM = Arm(name="two_stage_bench", segments=(FIRST, SECOND))
