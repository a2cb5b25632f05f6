"""Covariance of the estimates that holds under coloured, cross-correlated residuals.

The least-squares estimate is theta + (S'S)^-1 S'e, so its covariance is
(S'S)^-1 S' cov(e) S (S'S)^-1 with cov(e) estimated from the residuals' own auto- and
cross-covariances per recording, tapered by a flat-top window whose width adapts to the data
(Politis, J. Nonparametric Statistics 15, 2003). For white residuals it is the usual formula. What
is known a priori counts as one more measurement of its parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ..errors import InputError
from ..least_squares import moving_columns, normal_equations, pseudo_inverse

QUIET_LAGS = 5
"""Correlations in a row that must be small before the window is cut (Politis' K_n)."""

LONGEST_SHARE = 0.2
"""No lag beyond this share of a recording is used: there are too few products to average."""

LEAST_EIGENVALUE = 1e-12
"""Relative eigenvalue of the normal equations below which nothing shows a direction: the square of
core.identify.identifiability.RANK_TOLERANCE."""


def covariance(
    slopes: Sequence[np.ndarray], residuals: Sequence[np.ndarray],
    counted: Sequence[np.ndarray], free: int, relative: float = LEAST_EIGENVALUE,
    known: np.ndarray | float = np.inf, level: float = 1.0,
) -> np.ndarray:  # fmt: skip
    """(P, P) from S_i (M, k, P) and residuals (M, k) per recording, both weighted and zero where a
    sample is not `counted` (M, k). `free`: number of independent directions estimated; zero along
    those whose `relative` eigenvalue of the normal equations is too small. `known`: deviations (P,)
    of what is known a priori, infinite where nothing is; `level`: rms of the noise in the
    residuals' unit."""
    P = slopes[0].shape[2]
    meat, (information, _) = np.zeros((P, P)), normal_equations(residuals, slopes)
    for S, r, counts in zip(slopes, residuals, counted, strict=True):
        own, flat = moving_columns(S)
        each = flat.reshape(*r.shape, len(own))
        meat[np.ix_(own, own)] += score_covariance(each, autocovariance((r, counts)))
    count = sum(int(counts.sum()) for counts in counted)
    prior = np.diag(np.broadcast_to((level / np.asarray(known)) ** 2, P))
    inverse = pseudo_inverse(information + prior, relative)
    correction = count / max(count - free, 1)
    total = inverse @ (correction * meat + level**2 * prior) @ inverse
    return np.asarray(0.5 * (total + total.T))


@dataclass(frozen=True)
class Autocovariance:
    """Autocovariance of errors in time and between channels.

    Attributes:
        gamma: (2 width + 1, k, k), the mean of r_a(t) r_b(t + lag) for each lag.
        width: samples, up to which they are used as they are.
    """

    gamma: np.ndarray
    width: int


def autocovariance(*errors: tuple[np.ndarray, np.ndarray]) -> Autocovariance:
    """The autocovariance of (residuals (M, k), which samples count (M, k)) of one recording, or of
    several that have the same; residuals are zero where a sample does not count."""
    width = max(bandwidth(r, counts) for r, counts in errors)
    parts = [_covariances_where_sampled(r, counts, 2 * width) for r, counts in errors]
    gammas, pairs = (np.array(each) for each in zip(*parts, strict=True))
    shares = pairs / np.maximum(pairs.sum(axis=0), 1.0)
    return Autocovariance(np.sum(shares * gammas, axis=0), width)


def _covariances_where_sampled(
    r: np.ndarray, counts: np.ndarray, lags: int
) -> tuple[np.ndarray, np.ndarray]:
    """(lags + 1, k, k) each: covariances of residuals (M, k) as if all samples counted, from the
    existing pairs, zero without any; and the number of pairs."""
    missing = max(lags + 1 - len(r), 0)
    r, counts = (np.pad(x, ((0, missing), (0, 0))) for x in (r, counts))
    M = len(r)
    gamma = cross_covariances(r, lags)
    complete = (M - np.arange(lags + 1.0))[:, None, None]
    if np.all(counts):
        return gamma, np.broadcast_to(complete, gamma.shape)
    pairs = M * cross_covariances(counts.astype(float), lags)
    shown = np.rint(pairs) > 0.0  # transforms count to the last digits only
    return np.where(shown, gamma * complete / np.where(shown, pairs, 1.0), 0.0), pairs * shown


def score_covariance(S: np.ndarray, errors: Autocovariance) -> np.ndarray:
    """S' cov(r) S (P, P) of one recording with sensitivities S (M, k, P); InputError where these
    are not finite."""
    total = _tapered(S, errors.gamma, flat_top(errors.width))
    if not np.isfinite(total).all():
        raise not_finite("sensitivities")
    d = np.sqrt(np.maximum(np.abs(np.diag(total)), 1e-300))
    if np.linalg.eigvalsh(total / np.outer(d, d)).min(initial=0.0) >= -ROUNDING:
        return total
    # Of errors without slow parts, such as noise that was differentiated twice, a flat top may
    # leave less than nothing, where a triangle is never negative.
    total = _tapered(S, errors.gamma, triangle(errors.width))
    values, vectors = np.linalg.eigh(total)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def not_finite(what: str) -> InputError:
    """What is said of `what` a model gives at its best, where that is no number or far from all
    that a rig could show."""
    return InputError(
        f"The {what} are not finite; look for a measured value or a reference that is far too "
        f"large."
    )


ROUNDING = float(np.sqrt(np.finfo(float).eps))
"""Of the eigenvalues of scaled covariances."""


def _tapered(S: np.ndarray, gamma: np.ndarray, taper: np.ndarray) -> np.ndarray:
    """(P, P) of sensitivities (M, k, P) and covariances (2 width + 1, k, k) times a taper."""
    M, k, P = S.shape
    total, reach = np.zeros((P, P)), len(taper) - 1
    size = scipy.fft.next_fast_len(M + 2 * reach, real=True)
    waves = scipy.fft.rfft(S, size, axis=0)
    for a in range(k):
        # Lags from -reach to reach: gamma_ab(-l) = gamma_ba(l).
        kernels = np.concatenate([(taper * gamma[:, :, a].T)[:, :0:-1], taper * gamma[:, a].T], 1)
        answers = scipy.fft.rfft(kernels[:, ::-1], size, axis=1)
        mixed = np.einsum("bf,fbp->fp", answers, waves)
        smooth = scipy.fft.irfft(mixed, size, axis=0)[reach : reach + M]
        total += S[:, a, :].T @ smooth
    return np.asarray(0.5 * (total + total.T))


def cross_covariances(r: np.ndarray, lags: int) -> np.ndarray:
    """(lags + 1, k, k) of r (M, k): mean of r_a(t) r_b(t + lag), by Fourier transforms."""
    M, k = r.shape
    covariances = np.empty((lags + 1, k, k))
    size = scipy.fft.next_fast_len(M + lags, real=True)
    waves = scipy.fft.rfft(r, size, axis=0)
    for a in range(k):
        both = scipy.fft.irfft(waves[:, a, None].conj() * waves, size, axis=0)
        covariances[:, a] = both[: lags + 1] / M
    return covariances


def flat_top(width: int) -> np.ndarray:
    """(2 width + 1,): one up to the width, then linear to zero at twice the width."""
    if width == 0:
        return np.ones(1)
    lags = np.arange(2 * width + 1)
    return np.clip(2.0 - lags / width, 0.0, 1.0)


def triangle(width: int) -> np.ndarray:
    """(2 width + 1,): a straight fall to zero beyond twice the width (Bartlett 1950)."""
    return np.asarray(1.0 - np.arange(2 * width + 1) / (2 * width + 1.0))


def bandwidth(r: np.ndarray, counts: np.ndarray) -> int:
    """The first lag after which QUIET_LAGS correlations of every two channels of residuals r (M, k)
    are insignificant; of a slow sensor, at the lags of its samples that count, `counts` (M, k)."""
    M, k = r.shape
    longest = max(int(LONGEST_SHARE * M) // 2, 1)
    sizes = counts.sum(axis=0)
    stride = int(np.ceil(M / sizes[sizes > 0].min(initial=M)))  # the slowest sensor's samples
    gamma, pairs = _covariances_where_sampled(r, counts, min(longest + QUIET_LAGS * stride, M - 1))
    scale = np.sqrt(np.maximum(np.diag(gamma[0]), 1e-300))
    rho = np.abs(gamma / np.outer(scale, scale))
    own = np.diag(pairs[0])
    counted = np.maximum(np.minimum.outer(own, own), 10.0)
    bound = 2.0 * np.sqrt(np.log10(counted) / counted)
    widths = [
        _quiet_after(rho[:, a, b] > bound[a, b], pairs[:, a, b] > 0.0, longest)
        for a in range(k) for b in range(k)
    ]  # fmt: skip
    return max(widths, default=0)


def _quiet_after(loud: np.ndarray, shown: np.ndarray, longest: int) -> int:
    """The first lag, `longest` at most, after which the next QUIET_LAGS of those `shown` (L + 1,)
    are not loud."""
    lags = np.flatnonzero(shown[1:]) + 1
    noisy = np.concatenate([loud[lags], np.zeros(QUIET_LAGS, dtype=bool)])
    windows = np.lib.stride_tricks.sliding_window_view(noisy, QUIET_LAGS)[: len(lags) + 1]
    after = np.concatenate([[0], lags])[~windows.any(axis=1)]
    return int(min(after[0], longest)) if len(after) else longest
