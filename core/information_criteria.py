"""Choice among models of the same recordings: AIC (Akaike 1974), BIC (Schwarz 1978), FPE.

Errors are whitened by an autoregression per channel, which is fitted to the errors of one model:
the noise. A difference of BIC is the evidence for an effect, wherever it is stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .least_squares import pseudo_inverse
from .results import Diagnosis, DiagnosisRound, ErrorProducts, InformationCriteria


def added_up(parts: Sequence[ErrorProducts]) -> ErrorProducts:
    """Of fits to other recordings each, as of one model."""
    first, count = parts[0], np.sum([p.samples for p in parts], axis=0)
    return replace(
        first, products=np.sum([p.products for p in parts], axis=0), samples=count,
        variance=np.sum([p.samples * p.variance for p in parts], axis=0) / np.maximum(count, 1),
        parameters=sum(p.parameters for p in parts), prior=sum(p.prior for p in parts),
    )  # fmt: skip


def information_criteria(
    errors: ErrorProducts, noise: ErrorProducts | None = None
) -> InformationCriteria | None:
    """The criteria of a model (Ljung 1999, System Identification, 16.4).

    Args:
        errors: Of the model.
        noise: Errors of the model that whitens; None: the model's own.

    Returns:
        None where too little was compared, or an output has no error or no variance.
    """
    whitens, own = (noise or errors), errors.samples > 0
    N, p, size = int(errors.samples.sum()), errors.parameters, errors.samples[own]
    pairs = zip(whitens.products[own], whitens.samples[own], strict=True)
    filters = np.array([_whitening(C, n) for C, n in pairs]).reshape(errors.products[own].shape[:2])
    squares = np.einsum("ci,cij,cj->c", filters, errors.products[own], filters)
    scale, variance = filters[:, 0] ** 2, errors.variance[own]
    if p >= N or not (np.isfinite(squares) & (squares > 0.0) & (variance > 0.0)).all():
        return None
    twice = float(np.sum(size * np.log(2.0 * np.pi / scale) + squares)) + errors.prior
    share = float(np.exp(np.sum(size * np.log(squares / (size * scale * variance))) / N))
    return InformationCriteria(
        twice + 2.0 * p, twice + p * float(np.log(N)), share * (N + p) / (N - p), N, p
    )


def _whitening(products: np.ndarray, samples: int) -> np.ndarray:
    """(n,) the filter that makes errors of these inner products (n, n) white, of variance one: an
    autoregression of the order of least AIC, by least squares."""
    best, least = np.full(len(products), np.nan), np.inf
    for order in range(len(products)):
        before = slice(1, order + 1)
        taps = pseudo_inverse(products[before, before]) @ products[before, 0]
        variance = float(products[0, 0] - taps @ products[before, 0]) / max(samples, 1)
        if not variance > 0.0:
            break
        criterion = samples * np.log(variance) + 2.0 * order
        if criterion < least:
            least, best = criterion, np.zeros(len(products))
            best[: order + 1] = np.concatenate([[1.0], -taps]) / np.sqrt(variance)
    return best


def fall_of_bic(
    before: ErrorProducts | None, after: ErrorProducts | None, noise: ErrorProducts | None
) -> float | None:
    """ΔBIC: by how much the criterion BIC falls from a model to another; None where one of them is
    not known."""
    if before is None or after is None or noise is None:
        return None
    was, now = (information_criteria(x, noise) for x in (before, after))
    return None if was is None or now is None else was.bic - now.bic


def with_evidence(found: Diagnosis) -> Diagnosis:
    """The diagnosis with every ΔBIC as the fall of BIC from the model that it was asked of, against
    the one noise of the last model."""
    last, laws = found.steps[-1].left, found.proposal.laws if found.proposal else ()
    stated = tuple(
        replace(law, delta_bic=fall_of_bic(last, law.left, found.noise) or law.delta_bic)
        for law in laws
    )
    proposal = found.proposal and replace(found.proposal, laws=stated)
    rounds = tuple(_against(r, found) for r in found.rounds)
    return replace(found, rounds=rounds, proposal=proposal)


def _against(tried: DiagnosisRound, found: Diagnosis) -> DiagnosisRound:
    """A round against the noise of a diagnosis; of the effect that was added, the step counts."""
    at = {s.added: k for k, s in enumerate(found.steps) if k}.get(tried.accepted)
    before = found.steps[-1 if at is None else at - 1].left
    grown = {} if at is None else {tried.accepted: found.steps[at].left}
    falls = {
        r.effect: fall_of_bic(before, grown.get(r.effect, r.left), found.noise)
        for r in tried.ranking
    }
    ranking = tuple(
        r if (fall := falls[r.effect]) is None else replace(r, delta_bic=fall)
        for r in tried.ranking
    )
    titled = {r.title: r.delta_bic for r in ranking if r.delta_bic is not None}
    refused = tuple(
        (title, replace(why, delta_bic=titled.get(title, why.delta_bic)))
        for title, why in tried.refused
    )
    return replace(tried, ranking=ranking, refused=refused)
