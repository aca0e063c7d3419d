"""Electromyograms: read, made into envelopes, shifted, and compared with excitations.

emg = EMG.from_file("emg.sto").envelope().normalized()
agreement = compare_emg(result, emg, {"soleus_r": "soleus"}, delay=0.04)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import number_within
from ..errors import ParameterError
from ..files.storage import read_storage
from ..recruitment.limits import ControlLimits
from ..results.trajectory import Trajectory

# A recommendation of the field for envelopes of gait: the band of surface electrodes, and a
# low-pass of the rectified signal (C. J. De Luca and others, J. Biomech. 43 (2010), 1573-1579;
# D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed., section 10.3).
BAND = 20.0, 400.0  # Hz
CUTOFF = 6.0  # Hz
# Usual between the signal and the force that it leads to [s]: P. R. Cavanagh and P. V. Komi,
# European Journal of Applied Physiology 42 (1979), 159-163.
DELAY = 0.05
# Of the largest value: so far below zero do filters leave an envelope.
RINGING = 0.1
# Of the largest value: what rises above it is on.
ONSET = 0.2


@dataclass(frozen=True, eq=False)
class EMG:
    """Signals of c muscles over k times.

    Attributes
    ----------
    names : tuple of str
    time : (k,) ndarray
        [s], in equal steps for filters.
    values : (k, c) ndarray

    Raises
    ------
    ParameterError
        Shapes that do not fit, or times that do not increase.
    """

    names: tuple[str, ...]
    time: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        if np.shape(self.values) != (np.size(self.time), len(self.names)):
            raise ParameterError(
                f"EMG: {np.size(self.time)} times, {len(self.names)} names and values "
                f"{np.shape(self.values)} do not fit: expected (k,), c and (k, c)"
            )
        if not (np.diff(self.time) > 0.0).all():
            raise ParameterError("EMG: times must increase")

    @classmethod
    def from_file(cls, file: str | Path) -> EMG:
        """The `EMG` of a storage file (`.sto`, `.mot`).

        Parameters
        ----------
        file : str or Path

        Raises
        ------
        StorageError
            It cannot be read; names the line.
        """
        table = read_storage(file)
        return cls(table.labels, table.time, table.values)

    def envelope(self, *, band: tuple[float, float] | None = BAND, cutoff: float = CUTOFF) -> EMG:
        """The `EMG` rectified and smoothed: Butterworth filters of fourth order, forwards and back.

        Parameters
        ----------
        band : pair of float, optional
            Frequencies [Hz] that are kept before rectifying; its end is lowered to 0.9 of half the
            sampling rate where that is less. None: of a signal that was filtered before.
        cutoff : float
            Of the envelope [Hz].

        Raises
        ------
        ParameterError
            Steps are not equal, or the sampling rate is too low; tells the limit.
        """
        from scipy.signal import butter, sosfiltfilt  # slow to import

        nyquist = 0.5 / self._step()
        x = self.values
        for name, finite in zip(self.names, np.isfinite(x).all(axis=0), strict=True):
            if not finite:
                raise ParameterError(f"EMG of '{name}' has values that are no numbers")
        if band is not None:
            edges = band[0], min(band[1], 0.9 * nyquist)
            if not 0.0 < band[0] < band[1]:
                raise ParameterError(f"EMG: a band of frequencies increases, got {band}")
            if not edges[0] < edges[1]:
                raise ParameterError(
                    f"EMG: a band from {band[0]:g} Hz needs more than {2.3 * band[0]:.4g} samples "
                    f"a second, there are {2.0 * nyquist:.4g}"
                )
            x = sosfiltfilt(butter(2, edges, "bandpass", fs=2.0 * nyquist, output="sos"), x, axis=0)
        if not 0.0 < cutoff < nyquist:
            raise ParameterError(
                f"EMG: cutoff = {cutoff:g} Hz is outside (0, {nyquist:.4g}) Hz, half of the "
                "sampling rate"
            )
        low = butter(2, cutoff, fs=2.0 * nyquist, output="sos")
        return replace(self, values=np.maximum(sosfiltfilt(low, np.abs(x), axis=0), 0.0))

    def normalized(self, by: ArrayLike | None = None) -> EMG:
        """The `EMG` divided by the largest value of each, or by values that are given.

        Parameters
        ----------
        by : (c,) array_like, optional
            Such as values of maximum voluntary contraction.

        Raises
        ------
        ParameterError
            A divisor is not positive; names the muscle.
        """
        given = self.values.max(axis=0) if by is None else np.asarray(by, dtype=float)
        size = np.broadcast_to(given, len(self.names))
        for name, x in zip(self.names, size, strict=True):
            if not 0.0 < x < np.inf:
                raise ParameterError(f"EMG of '{name}' is to be divided by {x:g}")
        return replace(self, values=self.values / size)

    def delayed(self, delay: float) -> EMG:
        """The `EMG` as it acts, the electromechanical delay later.

        Parameters
        ----------
        delay : float
            [s]

        Raises
        ------
        ParameterError
            It is outside [-1, 1] s.
        """
        number_within("delay", delay, -1.0, 1.0, "s")
        return replace(self, time=self.time + delay)

    def at(self, name: str, t: np.ndarray) -> np.ndarray:
        """Values of one muscle, linear in between; NaN outside of the record.

        Parameters
        ----------
        name : str
        t : (k,) ndarray
            [s]

        Returns
        -------
        (k,) ndarray
        """
        return np.interp(t, self.time, self._of(name), left=np.nan, right=np.nan)

    def courses(
        self, muscles: Mapping[str, str], *, delay: float = DELAY
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Times and values of muscles, `delay` later, as `Followed` and `ControlLimits` take them;
        zero where a filter has left an envelope a little below.

        Parameters
        ----------
        muscles : mapping
            Muscle of a model -> name of the EMG; several muscles may share one.
        delay : float
            As of `compare_emg`.

        Returns
        -------
        dict of str to pair of (k,) ndarray
            Muscle of the model -> times [s] and values.

        Raises
        ------
        ParameterError
            There is no such EMG, or values are outside [0, 1]; names it.
        """
        _check_names(muscles)
        shifted = self.delayed(delay)
        found = {}
        for muscle, name in muscles.items():
            x = shifted._of(name)
            if not (np.isfinite(x).all() and x.max() <= 1.0 and x.min() >= -RINGING * x.max()):
                raise ParameterError(
                    f"EMG of '{name}' is within [{x.min():g}, {x.max():g}]; excitations are "
                    "within [0, 1], as after `envelope` and `normalized`"
                )
            found[muscle] = shifted.time, np.maximum(x, 0.0)
        return found

    def limits(
        self, muscles: Mapping[str, str], width: float, *, delay: float = DELAY
    ) -> dict[str, ControlLimits]:
        """Control limits around the EMG, for `control_limits`.

        Parameters
        ----------
        muscles, delay
            As of `courses`.
        width : float
            How far below and above limits are, in [0, 1].

        Returns
        -------
        dict of str to ControlLimits

        Raises
        ------
        ParameterError
            As `courses`, or `width` is outside [0, 1].
        """
        number_within("width", width, 0.0, 1.0)
        return {
            muscle: ControlLimits(
                (t, np.maximum(x - width, 0.0)),
                (t, np.minimum(x + width, 1.0)),
            )
            for muscle, (t, x) in self.courses(muscles, delay=delay).items()
        }

    def _of(self, name: str) -> np.ndarray:
        """The values (k,) of one muscle."""
        if name not in self.names:
            raise ParameterError(f"EMG: there is no '{name}', only {', '.join(self.names)}")
        return self.values[:, self.names.index(name)]

    def _step(self) -> float:
        steps = np.diff(self.time)
        if steps.size < 15 or steps.max() - steps.min() > 1e-3 * steps.mean():
            raise ParameterError(
                "EMG: filters need at least 16 samples in equal steps; got "
                + (f"steps from {steps.min():g} to {steps.max():g} s" if steps.size else "none")
            )
        return float(steps.mean())


class Agreement(NamedTuple):
    """How well an excitation agrees with a measured one, both over their largest value.

    Attributes
    ----------
    rms : float
        Root mean square of the difference.
    correlation : float
        Pearson's; NaN if one of them is constant.
    onset : float
        By how much later [s] the excitation first rises above 20 % of its largest value; NaN if
        one of them is above it from the start.
    """

    rms: float
    correlation: float
    onset: float


def compare_emg(
    result: Trajectory, emg: EMG, muscles: Mapping[str, str], *, delay: float = DELAY
) -> dict[str, Agreement]:
    """Excitations of a result beside envelopes, where both are known.

    Parameters
    ----------
    result : Trajectory
    emg : EMG
        Envelopes.
    muscles : mapping
        Muscle of the result -> name of the EMG; several muscles may share one.
    delay : float
        What lies between the signal and its effect [s], by which the envelopes are shifted.

    Returns
    -------
    dict of str to Agreement

    Raises
    ------
    ParameterError
        `muscles` is no mapping, a muscle or EMG is not there, or the two have no ten windows in
        common.
    """
    _check_names(muscles)
    shifted, t = emg.delayed(delay), 0.5 * (result.window_time[:-1] + result.window_time[1:])
    found = {}
    for muscle, name in muscles.items():
        if muscle not in result.muscle_names:
            raise ParameterError(f"the result has no muscle '{muscle}'")
        measured = shifted.at(name, t)
        known = np.isfinite(measured)
        if np.count_nonzero(known) < 10:
            raise ParameterError(
                f"EMG of '{name}' from {shifted.time[0]:g} to {shifted.time[-1]:g} s covers "
                f"{np.count_nonzero(known)} windows of the result, which has "
                f"{t[0]:g} to {t[-1]:g} s; 10 are needed"
            )
        mine = result.excitation_values[known, result.muscle_names.index(muscle)]
        found[muscle] = _agreement(t[known], mine, measured[known])
    return found


def _check_names(muscles: Mapping[str, str]) -> None:
    if not isinstance(muscles, Mapping):
        raise ParameterError(f"muscles: muscle -> name of its EMG was expected, got {muscles!r}")


def _agreement(t: np.ndarray, mine: np.ndarray, measured: np.ndarray) -> Agreement:
    x, y = (values / max(values.max(), np.finfo(float).tiny) for values in (mine, measured))
    varies = np.ptp(x) > 0.0 and np.ptp(y) > 0.0
    correlation = float(np.corrcoef(x, y)[0, 1]) if varies else np.nan
    rise = [t[np.argmax(z > ONSET)] if z[0] <= ONSET else np.nan for z in (x, y)]
    return Agreement(float(np.sqrt(np.mean((x - y) ** 2))), correlation, float(rise[0] - rise[1]))


def measured_beside(
    emg: EMG, measured: Mapping[str, str], muscles: Sequence[str], t: np.ndarray
) -> dict[str, np.ndarray]:
    """The envelopes (k,) at times `t` (k,) of `muscles` by their names, NaN where none is known.

    Raises
    ------
    ParameterError
        There is no such muscle or EMG.
    """
    for muscle in measured:
        if muscle not in muscles:
            raise ParameterError(f"measured: the result has no muscle '{muscle}'")
    return {muscle: emg.at(name, t) for muscle, name in measured.items()}
