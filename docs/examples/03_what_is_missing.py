"""3. What does the model lack?

What you learn: to diagnose recordings of a machine with an effect that the model does not know,
to follow long work and to stop it, and to go on with the model that was found.
"""

import flexgui as fg

CANDIDATES = ["coulomb_friction", "viscous_friction", "tip_payload", "camera_delay"]
"""All effects are tried without this; four are quicker."""


class Follow:
    """Follows the work; a callback that returns False stops it."""

    def __init__(self) -> None:
        self.stage = ""

    def __call__(self, update: fg.Update) -> bool:
        """Print each stage once."""
        if update.stage != self.stage:
            self.stage = update.stage
            print(f"  {update.stage}")
        return True


def main() -> None:
    """Find the friction that is hidden in a scenario that comes with FlexGUI."""
    print(fg.scenarios()["hidden_friction"])
    rig = fg.load("hidden_friction").with_settings(diagnose={"candidates": CANDIDATES})

    found = rig.diagnose(Follow(), max_effects=1)
    print(f"Verdict: {found.verdict}; added: {', '.join(found.added)}")
    print(found.words[0])
    print(found.to_dataframe("ranking")[["effect", "refit_drop_percent", "delta_bic"]])
    for name in ("fc1", "fc2"):
        print(f"{name} = {found[name].value:.3f} ± {found[name].std:.3f} {found[name].unit}")

    # The model as it now stands is a project again: a scenario that runs anywhere.
    found.project().save("diagnosed.toml")
    found.plot("ladder").write_html("ladder.html")


if __name__ == "__main__":
    main()
