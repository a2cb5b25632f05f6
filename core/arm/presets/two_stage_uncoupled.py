"""The same bench as the manufacturer models it: two stages that do not feel each other."""

from core.arm.arm import Arm
from core.arm.presets.two_stage_bench import FIRST, SECOND, lumped_load

ARM = Arm(
    name="two_stage_uncoupled",
    segments=(
        FIRST.model_copy(update={"tip_mass": lumped_load(0), "mount": "ground"}),
        SECOND.model_copy(update={"mount": "ground"}),
    ),
)
