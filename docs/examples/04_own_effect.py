"""4. An effect of your own.

What you learn: to state an effect as a formula, to write one as a class, and to let the diagnosis
weigh it against the effects that FlexGUI knows.
"""

import sympy as sp

import flexgui as fg
from flexgui.core.effects.per_joint import each_joint, joint_elements
from flexgui.core.forces.law import V, joint_law

_C = sp.Symbol("c", nonnegative=True)
LAW = joint_law(-_C * V * sp.sqrt(V**2 + sp.Rational(1, 10**6)), (_C,))
"""-c v |v|, rounded off where the joint stands."""


class OilBath(fg.Effect):
    """-c θ' |θ'| at every joint: oil that is churned."""

    kind = "oil_bath"
    location = "joint"
    title = "Oil bath"
    story = "A gear that turns in oil is braked with the square of its speed."
    formula = r"\tau = -c \, \dot\theta |\dot\theta|"
    dissipative = True
    acts_at = "joints"

    def parameters(self, arm, drive, sizes):
        """One coefficient per joint, in N m s²/rad²."""
        start = 0.1 * sizes.torque / sizes.speed**2
        return each_joint(arm, "oil", "oil bath {}", lambda j: "N m s²/rad²", start)

    def elements(self, arm, p, values):
        """The law at every joint."""
        return joint_elements(arm, LAW, ("oil",), values)


def main() -> None:
    """Hide the effect in a simulated machine, and find its size in two ways."""
    fg.register(OilBath)
    drive = fg.drives.VelocityLoop(gains=(60.0, 30.0))
    hidden = {"oil_bath": {"oil1": 6.0, "oil2": 3.0}}
    machine = fg.project("paper", drive, sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5})
    made = [
        machine.simulate(theta2=theta2, seconds=1.0, seed=k, hidden=hidden, name=f"run {k}")
        for k, theta2 in enumerate((0.9, 2.1), start=1)
    ]
    rig = fg.project(
        "paper", drive, [one.recording for one in made], model={"level": "nonlinear"},
        sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5},
        identify={"parameters": ["EI1", "EI2"], "output": ["z", "encoder"], "generations": 0},
    )  # fmt: skip

    by_class = rig.with_effects(OilBath).identify()
    size = by_class["oil1"]
    print(f"As a class:   oil1 = {size.value:.2f} ± {size.std:.2f} {size.unit}")

    text = "-a*dtheta1*sqrt(dtheta1**2 + 1e-6)"
    formula = fg.formula("joint1", text, a={"start": 1.0, "unit": "N m s²/rad²"})
    by_formula = rig.with_effects(
        formula, {"id": "oil_bath", "oil1": {"start": 0.0, "vary": False}, "oil2": 3.0}
    ).identify()
    print(f"As a formula: a = {by_formula['a'].value:.2f} {by_formula['a'].unit}")

    candidates = ["oil_bath", "viscous_friction", "coulomb_friction"]
    asked = rig.with_settings(diagnose={"candidates": candidates})
    print(f"The diagnosis adds: {', '.join(asked.diagnose(max_effects=1).added)}")
    fg.unregister(OilBath)


if __name__ == "__main__":
    main()
