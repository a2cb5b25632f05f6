"""The law by which a drive turns references and states into joint torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DriveLaw:
    """u = R r - P q - V q' - S s, each component cut at its limit; s' = Fs s + Fq q + Fv q' + Fr r.

    Every drive is of this form, so the non-linear simulator and the linear model share it and
    neither asks which drive it is. Shapes with nj joints, n coordinates, nr references and
    ns own states: R (nj, nr), P and V (nj, n), S (nj, ns), Fs (ns, ns), Fq and Fv (ns, n),
    Fr (ns, nr), limit (nj,) in N m (or N), infinite where there is none.
    """

    R: np.ndarray
    P: np.ndarray
    V: np.ndarray
    S: np.ndarray
    Fs: np.ndarray
    Fq: np.ndarray
    Fv: np.ndarray
    Fr: np.ndarray
    limit: np.ndarray
    interpolate: bool = False
    """Whether references run straight between samples (a measured motion) or are held."""
    held: int = 0
    """How many of the last references are held even so."""

    @property
    def states(self) -> int:
        """Number of the drive's own states."""
        return int(self.Fs.shape[0])

    @property
    def references(self) -> int:
        """Number of references."""
        return int(self.R.shape[1])

    @property
    def straight(self) -> int:
        """How many of the first references run straight between samples."""
        return self.references - self.held if self.interpolate else 0

    def same_gains(self, other: DriveLaw) -> bool:
        """Whether references, places and speeds make the same torque."""
        pairs = ((self.R, other.R), (self.P, other.P), (self.V, other.V))
        return all(a is b or np.array_equal(a, b) for a, b in pairs)


def law_arrays(law: DriveLaw) -> tuple[np.ndarray, ...]:
    """R, P, V, S, Fs, Fq, Fv, Fr and the limit."""
    return law.R, law.P, law.V, law.S, law.Fs, law.Fq, law.Fv, law.Fr, law.limit


def static_law(
    R: np.ndarray,
    P: np.ndarray,
    V: np.ndarray,
    limit: np.ndarray | None = None,
    interpolate: bool = False,
    held: int = 0,
) -> DriveLaw:
    """A law without states of its own: R (nj, nr), P and V (nj, n), limit (nj,) in N m (N)."""
    joints, references = R.shape
    n = P.shape[1]
    return DriveLaw(
        R=R,
        P=P,
        V=V,
        S=np.zeros((joints, 0)),
        Fs=np.zeros((0, 0)),
        Fq=np.zeros((0, n)),
        Fv=np.zeros((0, n)),
        Fr=np.zeros((0, references)),
        limit=np.full(joints, np.inf) if limit is None else limit,
        interpolate=interpolate,
        held=held,
    )
