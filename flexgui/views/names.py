"""Names and shares in readable form: theta1 -> θ₁, \varepsilon -> ε."""

from __future__ import annotations

import math
import re

from markupsafe import Markup, escape

from flexgui.core.identify.first_states import START
from flexgui.core.recording.channels import channel_kind, is_channel
from flexgui.core.results import Estimate
from flexgui.sentences.written import (
    DOT,
    SUBSCRIPTS,
    SUPERSCRIPTS,
    channel_symbol,
    equals,
    estimate_text,
    split_name,
)

GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "varepsilon": "ε", "epsilon": "ε",
    "zeta": "ζ", "eta": "η", "theta": "θ", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν",
    "rho": "ρ", "sigma": "σ", "tau": "τ", "varphi": "φ", "phi": "φ", "psi": "ψ", "omega": "ω",
    "Delta": "Δ", "Lambda": "Λ", "Omega": "Ω",
}  # fmt: skip

TITLES = {
    "theta": "joint position",
    "dtheta": "joint velocity",
    "y": "position of the fictitious rigid joint",
    "ydot": "velocity of the fictitious rigid joint",
    "z": "tip position",
    "zdot": "tip velocity",
    "u": "joint torque",
    "torque": "joint torque",
    "i": "motor current",
    "deflection": "deflection of the link",
}


def channel_title(channel: str, unit: str = "") -> str:
    """'z1' -> 'tip position z₁'; a sensor's own columns have the title of its class, and an
    unknown channel keeps its name."""
    stem, _ = split_name(channel)
    own = channel_kind(channel).title if is_channel(channel) else ""
    title = TITLES.get(stem, own)
    return f"{title} {channel_symbol(channel, unit)}" if title else channel


def output_title(channel: str, unit: str) -> str:
    """The same with the angle of a revolute joint called that, and the force of a slide:
    'joint angle θ₂', 'joint force u₁'."""
    title = channel_title(channel, unit)
    if unit == "N":
        return title.replace("joint torque", "joint force")
    return title.replace("joint position", "joint angle") if unit == "rad" else title


def plain_symbol(symbol: str, name: str) -> str:
    r"""A symbol in LaTeX as plain text: '\varepsilon_{1}' -> 'ε₁'; `name` where there is none."""
    if not symbol:
        stem, number = split_name(name)
        return GREEK.get(stem, stem) + number.translate(SUBSCRIPTS)
    text = re.sub(r"\\d?dot\{?\s*(\\?[A-Za-z]+)\}?", lambda m: m[1] + DOT, symbol)
    text = re.sub(r"\\(?:mathrm|text|operatorname)\{([^}]*)\}", r"\1", text)
    text = re.sub(r"\\([A-Za-z]+)", lambda m: GREEK.get(m[1], m[1]), text)
    text = re.sub(r"_\{?(\d+)\}?", lambda m: m[1].translate(SUBSCRIPTS), text)
    text = re.sub(r"\^\{?(\d+)\}?", lambda m: m[1].translate(SUPERSCRIPTS), text)
    return re.sub(r"[{}\\]", "", text)


def typeset(symbol: str, name: str) -> Markup:
    """The same for HTML, where words can be subscripts too: 'f_{c1}' -> 'f<sub>c1</sub>'."""
    plain = plain_symbol(symbol, name)
    if not symbol:
        return escape(plain)  # an underscore of a name says nothing about a subscript
    return Markup(re.sub(r"_([\w,]+)", r"<sub>\1</sub>", str(escape(plain))))


def equation(e: Estimate) -> Markup:
    """'f_c1 = 1.201 ± 0.001 N m' for HTML, without a line break but before what stands in
    brackets."""
    value, bracket, reason = estimate_text(e).partition(" (")
    parts = typeset(e.symbol, e.name), equals(e), value
    stated = Markup("<span style='white-space: nowrap'>{} {} {}</span>").format(*parts)
    return stated + bracket + reason


def format_percent(value: float) -> str:
    """'97.12' of a value in per cent: two decimals, because FIT differs between models in the
    second."""
    return f"{value:.2f}" if math.isfinite(value) else "–"


def is_of_a_start(estimate: Estimate) -> bool:
    """Whether it belongs to the initial state of a recording."""
    return estimate.recording is not None and estimate.name.startswith(START)
