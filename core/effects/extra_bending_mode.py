"""One more bending shape per segment."""

from ..arm.arm import Arm
from ..arm.segment import MAX_MODES
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.per_segment import unbent
from ..effects.sizes import Sizes


class ExtraBendingMode(Effect):
    """The next assumed shape x^(i+1) in every bending segment; switched, and may be repeated."""

    kind = "extra_bending_mode"
    location = "segments"
    title = "Extra bending mode"
    story = (
        "A beam has infinitely many bending shapes; the model allows only a few per segment. One "
        "more shape makes the modelled beam softer, as the real one is, and adds another, faster "
        "vibration. Without it a residual follows every hard push and is largest just after the "
        "torque jumps. The measurement also contains a vibration that the model cannot reproduce."
    )
    formula = r"\delta(x) \leftarrow \delta(x) + x^{\,i+1} v_i"
    linear = True
    repeats = True
    acts_at = "segments"

    def not_applicable(self, rig: Rig) -> str:
        full = all(modes in (0, MAX_MODES) for modes in rig.arm.modes)
        most = f"Every bending segment has {MAX_MODES} modes already."
        return unbent(rig) or (most if full else "")

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return ()

    def changed_arm(self, arm: Arm, values: Values) -> Arm:
        segments = tuple(
            s.model_copy(update={"modes": min(s.modes + 1, MAX_MODES)}) if s.modes else s
            for s in arm.segments
        )
        return arm.model_copy(update={"segments": segments})
