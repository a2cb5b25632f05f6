"""1. Identify a simulated arm.

What you learn: to make recordings in simulation, to build a project from tables, to read
estimates with their deviations, and why the data fix ε d⁴ but not ε and d apart.
"""

import flexgui as fg

WORKING_POINTS = (0.8, 1.6, 2.3)
"""rad, angle of the second joint."""


def main() -> None:
    """Simulate three experiments and fit one model to all of them."""
    drive = fg.drives.VelocityLoop(gains=(60.0, 30.0))
    machine = fg.project("paper", drive)

    # A recording is a table: one row per sample, SI units or the unit in the heading.
    tables = [
        machine.simulate(theta2=theta2, seconds=1.5, snr_db=20.0, seed=k).to_dataframe()
        for k, theta2 in enumerate(WORKING_POINTS, start=1)
    ]
    print(tables[0].head())

    rig = fg.project(
        "paper", drive, tables, title="Three working points", model={"level": "lpv"},
        identify={"parameters": ["EI"], "output": "ydot"},
    )  # fmt: skip
    found = rig.identify()
    stiffness = found["EI"]
    print(f"EI = {stiffness.value:.1f} ± {stiffness.std:.1f} {stiffness.unit}")
    print(found.to_dataframe()[["parameter", "value", "std", "unit", "identifiable"]])

    # Young modulus and width of the section enter the model through their stiffness only.
    both = {"parameters": ["epsilon", "d"], "bounds": {"epsilon": [8e8, 1.2e9], "d": [0.04, 0.06]}}
    free = rig.with_settings(identify={**both, "population": 20, "generations": 25}).identify()
    assert not free["epsilon"].identifiable
    print(free.words[0])

    found.compare().plot("signals").write_html("signals.html")
    free.plot("valley").write_html("valley.html")


if __name__ == "__main__":
    main()
