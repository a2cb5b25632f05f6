"""Units that suit the size of a number: a deflection reads in mm, a modulus in GPa."""

from core.written import ShownUnit, shown_unit

__all__ = ["ShownUnit", "shown_unit"]
