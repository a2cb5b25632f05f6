"""2. Your own recordings.

What you learn: to map the columns of a table in other units, to keep a recording for validation,
to see where the model fails, and to write the report.
"""

import numpy as np
import pandas as pd

import flexgui as fg

COLUMNS = {
    "t": "time",
    "dtheta1_ref": "cmd1 [deg/s]",
    "dtheta2_ref": "cmd2 [deg/s]",
    "theta1": "enc1 [deg]",
    "theta2": "enc2 [deg]",
    "z1": "x [mm]",
    "z2": "y [mm]",
}
"""Channel of FlexGUI -> column of the rig's table; a unit in brackets is converted."""


def rig_table(theta2: float, seed: int) -> pd.DataFrame:
    """Stand in for `pandas.read_csv("rig.csv")`: a table as a logger writes it."""
    machine = fg.project("paper", {"kind": "velocity_loop", "gains": [60.0, 30.0]})
    recorded = machine.simulate(theta2=theta2, seconds=1.5, seed=seed).recording
    rng = np.random.default_rng(seed)
    table = {"time": recorded.time}
    for channel, heading in COLUMNS.items():
        if channel != "t":
            factor = 1e3 if "mm" in heading else np.degrees(1.0)
            table[heading] = recorded[channel] * factor
            if "mm" in heading:
                table[heading] = table[heading] + rng.normal(0.0, 0.03, len(recorded.time))
    return pd.DataFrame(table)


def main() -> None:
    """Fit two recordings, check on a third, and write a report."""
    recordings = [
        {"table": rig_table(0.8, 1), "name": "low", "columns": COLUMNS},
        {"table": rig_table(2.2, 2), "name": "high", "columns": COLUMNS},
        {"table": rig_table(1.5, 3), "name": "check", "columns": COLUMNS, "role": "validate"},
    ]
    rig = fg.project(
        {"preset": "paper", "young_modulus": 1.2e9},  # believed to be stiffer than it is
        fg.drives.VelocityLoop(gains=(60.0, 30.0)),
        recordings,
        title="My bench",
        model={"level": "nonlinear"},
        identify={"parameters": ["EI1", "EI2"], "output": ["z", "encoder"], "generations": 0},
    )
    before = rig.compare()
    found = rig.identify()
    after = found.compare()
    print(f"The tip was missed by {1e3 * before['check'].tip_rms:.2f} mm before,")
    print(f"and by {1e3 * after['check'].tip_rms:.3f} mm after the identification.")
    print(after.to_dataframe()[["recording", "role", "channel", "fit_percent", "rms", "unit"]])
    before.plot("error_by_time").write_html("where_it_failed.html")
    print(f"The report is {found.export('report')}")


if __name__ == "__main__":
    main()
