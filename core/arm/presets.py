"""Ready-made arms."""

from __future__ import annotations

from ..arm.arm import Arm
from ..arm.segment import Segment

# The arm of the paper: two revolute joints, two flexible segments of square section,
# l1 = l2 = 0.5 m, m1 = 7.5 kg, m2 = 5 kg, d = 5 cm, Young modulus epsilon = 1 GPa, so
# EI = epsilon d^4 / 12 = 520.83 N m^2; one bending mode per segment.
_PAPER = tuple(
    Segment(length=0.5, mass=mass, width=0.05, young_modulus=1e9, modes=1) for mass in (7.5, 5.0)
)

# One rigid load on a motor-driven slide: the smallest rig that the model covers. The mass is near
# that of EMPS, the electro-mechanical positioning system of Janot, Gautier and Brunot ("Data set
# and reference models of EMPS", nonlinearbenchmark.org: 95.109 kg). The length plays no part.
_SLIDE = Segment(length=0.1, mass=95.0, modes=0, joint="prismatic")

# The two-stage serial flexible link bench (quanser_2dsfl_steps, ctu_2dsfl_lqr), coupled.
#
# Nominal values of the manufacturer, all on the joint side: link stiffness 39.96 and
# 6.858 N m/rad (root moment over chord angle), hub inertia 0.06354 and 0.00302 kg m^2,
# link-plus-load inertia 0.1704 and 0.006439 kg m^2, link damping 0 and 0.0856 N m s/rad, links of
# 0.202 m, 1.578 kg of stage 2 on the tip of link 1.
#
# How they enter the arm, with two modes per link so that a tip load bends it exactly:
# - a tip force bends a cantilever by a chord angle of root moment l / (3 EI), so EI = K l / 3;
# - the steel links weigh 0.153 and 0.054 kg (1.27 mm x 76.2 mm and 0.889 mm x 38.1 mm sections);
# - link 2's load is the tip mass that gives 0.006439 kg m^2 about joint 2;
# - link 1 carries the 1.578 kg of stage 2. The manufacturer's 0.1704 kg m^2 lumps into one number
#   what this arm has explicitly; `two_stage_uncoupled` is that model;
# - damping 0.0856 N m s/rad over 6.858 N m/rad is a damping time of 12.5 ms.
_LENGTH, _LINK_MASS, _LINK_AND_LOAD = 0.202, (0.1535, 0.0537), (0.1704, 0.006439)


def _stage(k: int, stiffness: float, hub_inertia: float, damping: float = 0.0) -> Segment:
    """A stage (from 0) with the tip mass that gives it its link-plus-load inertia."""
    return Segment(
        length=_LENGTH,
        mass=_LINK_MASS[k],
        EI=stiffness * _LENGTH / 3.0,
        modes=2,
        damping_time=damping / stiffness,
        tip_mass=_LINK_AND_LOAD[k] / _LENGTH**2 - _LINK_MASS[k] / 3.0,
        hub_inertia=hub_inertia,
    )


_LUMPED, _SECOND = _stage(0, 39.96, 0.06354), _stage(1, 6.858, 0.00302, damping=0.0856)
_FIRST = _LUMPED.model_copy(update={"tip_mass": 1.578})

# The same bench as the manufacturer models it: two stages that do not feel each other.
_UNCOUPLED = tuple(s.model_copy(update={"mount": "ground"}) for s in (_LUMPED, _SECOND))

_SEGMENTS = {
    "paper": _PAPER,
    "single_axis": (_SLIDE,),
    "two_stage_bench": (_FIRST, _SECOND),
    "two_stage_uncoupled": _UNCOUPLED,
}
_ARMS = {name: Arm(name=name, segments=segments) for name, segments in _SEGMENTS.items()}


def presets() -> dict[str, Arm]:
    """The arms by their names."""
    return dict(_ARMS)
