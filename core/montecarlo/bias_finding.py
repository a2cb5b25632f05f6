"""The bias in EI that the paper's means imply: how large, and what could cause it, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from core.montecarlo import printed
from core.montecarlo.agreement import comparable, implied_bias
from core.montecarlo.estimates import EstimateTable
from core.montecarlo.phrases import signed, snr_words
from core.montecarlo.printed import Numbers
from core.montecarlo.sources import BiasSource
from core.sentences import listed
from core.written import format_number

LIKELY = 2.0
"""Root mean squares: a bias within so many is one that a draw of the excitation may well give."""

Compared = tuple[EstimateTable, tuple[Numbers, ...]]


def about_bias(
    tables: Sequence[EstimateTable], sources: Sequence[BiasSource], EI: float
) -> Iterator[tuple[str, str]]:
    """Nothing where no table can be laid beside the paper's."""
    both = [(t, told) for t in tables if (told := comparable(t)) is not None]
    if both:
        said = [_size(both, EI), *_candidate(both, sources, EI)]
        yield "The bias in EI that the paper's means imply", " ".join(said)


def _size(both: Sequence[Compared], EI: float) -> str:
    parts = []
    for table, told in both:
        each = [100.0 * implied_bias(told[k], EI) for k in printed.LOCALS]
        glocal = 100.0 * implied_bias(told[printed.GLOCAL], EI)
        parts.append(
            f"{signed(each[0], 1)} % at π/8, {signed(each[-1], 1)} % at 7π/8 and "
            f"{signed(glocal, 1)} % glocally at {snr_words(table.snr_db)}"
        )
    table = both[0][0]
    ours = [100.0 * (row.EI[0].mean / EI - 1.0) for row in table.rows]
    product = max(100.0 * (row.EI_of_means / row.EI[0].mean - 1.0) for row in table.rows)
    return (
        f"The paper's means imply an EI that is wrong by {'; by '.join(parts)}. Ours is wrong by "
        f"{signed(min(ours), 2)} to {signed(max(ours), 2)} %. Multiplying means instead of "
        f"averaging products explains {product:.1f} % at most, for ε d⁴ is curved."
    )


def _candidate(both: Sequence[Compared], sources: Sequence[BiasSource], EI: float) -> Iterator[str]:
    named = {(s.excitation, s.rates): s for s in sources}
    plain, paper = named.get(("prbs", "tip")), named.get(("prbs", "working point"))
    still = named.get(("prbs_balanced", "tip"))
    if plain is None or paper is None or still is None:
        return
    rms = 100.0 * paper.rms
    yield (
        f"What could be so large is the motion: a plain PRBS lets θ₂ wander by "
        f"{paper.wander.mean():.2f} rad on average within an experiment, and (8) takes the "
        f"Jacobian at the working point. Over {len(paper.local)} draws of the excitation, without "
        f"noise, the two together give a bias of {rms[0]:.1f} % rms at the first working point, "
        f"{np.median(rms):.1f} % at the median one, {rms[-1]:.1f} % at the last and "
        f"{100.0 * paper.glocal_rms:.1f} % glocally. With J at the tip's own angles it is "
        f"{100.0 * plain.rms[0]:.1f} % at the first and {100.0 * plain.rms.max():.1f} % at the "
        f"worst point, and with a balanced PRBS, which stays where it is, "
        f"{100.0 * still.rms.max():.2f} % at most."
    )
    yield from (_measured(table, told, paper, EI) for table, told in both)
    yield (
        "The mean of that bias over the draws is "
        f"{_mean(paper.local[:, 0])} % at the first and {_mean(paper.local[:, -1])} % at the last "
        "point (± standard error). An excitation that all runs share gives all of them the same "
        "bias, which no deviation shows. Which excitation and which draw the paper had is not "
        "printed, so this is a possible cause and not a proved one."
    )


def _measured(table: EstimateTable, told: Sequence[Numbers], source: BiasSource, EI: float) -> str:
    """The paper's bias at each point in root mean squares of the source's."""
    each = [implied_bias(told[k], EI) / source.rms[k] for k in printed.LOCALS]
    beyond = [
        f"{table.rows[k].label} ({format_number(abs(x), 2)} rms)"
        for k, x in enumerate(each)
        if abs(x) > LIKELY
    ]
    text = (
        f"At {snr_words(table.snr_db)} {len(each) - len(beyond)} of {len(each)} of the paper's "
        f"local means lie within {LIKELY:g} rms of that"
    )
    return f"{text}, but not {listed(beyond)}." if beyond else f"{text}."


def _mean(draws: np.ndarray) -> str:
    """'+2.1 ± 2.4' in %."""
    error = 100.0 * float(draws.std(ddof=1)) / np.sqrt(len(draws)) if len(draws) > 1 else 0.0
    return f"{signed(100.0 * float(draws.mean()), 1)} ± {error:.1f}"
