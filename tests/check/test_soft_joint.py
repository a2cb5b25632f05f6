"""An elastic joint before a rigid link: nothing bends, and the check of its channels has no links
to fit."""

from __future__ import annotations

from pathlib import Path

from tests.check.rigs import rig
from tests.programs.sample.torque_rigs import TorqueRig, written


def test_a_rigid_link_behind_a_soft_joint_is_checked(tmp_path: Path) -> None:
    soft = TorqueRig((3.0,), (0.6,), hub_inertia=0.1, springs=(900.0,), rate=500.0, seconds=2.0)
    path = written(soft, 7, tmp_path)
    text = path.read_text(encoding="utf-8")
    stated = text.replace("modes = 0\n", "modes = 0\njoint_compliance = 1.1e-3\n")
    assert stated != text
    path.write_text(stated, encoding="utf-8")
    checked = rig(path)
    for k in range(soft.recordings):
        assert checked.untouched(k) == []
