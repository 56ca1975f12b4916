"""How long the flat atom should be: what separates "flat within its error" from "slightly curved".

On a plane the curvature fields tend to 0, and the direction of their signature to that of noise: a plane is
then as similar to a large cylinder as to another plane. One more coordinate, the same for every surface, is
as good as nothing beside a signature that noise cannot explain, and outweighs one that it can.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig._surfsig import Frame
from surfsig.errors import InvalidInputError

if TYPE_CHECKING:
    from surfsig.extraction import Extraction

MEDIAN_TO_STD = 1.4826
"""Standard deviations of a normal error for each median of its size."""


def mean_curvature_noise(noise: ArrayLike, radius: ArrayLike, count: ArrayLike) -> NDArray[np.float64]:
    """Return the standard deviation of H that noise alone gives: 6.9 s / (r^2 sqrt N).

    Parameters
    ----------
    noise
        Standard deviation s of a point's distance to the surface.
    radius
        Radius r of the ball, in the same unit.
    count
        Points N in the ball, spread over a disc.

    Returns
    -------
    Per unit of length, of the shape that the arguments have together.
    """
    return np.asarray(6.9 * np.asarray(noise) / (np.square(radius) * np.sqrt(count)), np.float64)


def flat_atom_length(*extractions: Extraction, flat: bool = False, frame: Frame | None = None) -> float:
    """Return the flat atom's length for extractions that are to be compared with each other.

    It follows the noise that the fits report, `Extraction.mean_curvature_std`: so many signatures of pure
    noise that two planes stay alike (zeta 0.9 or more) in 99 of 100 pairs. Of an extraction, the median of
    all its places counts; of several, the noisiest, as signatures can only be compared with flat atoms of
    one length. It is a statistic of the scan: an extraction of a part may give another length.

    Signatures do not grow with curvature for ever: curved and flat come apart at 0.9 only while the error of
    the mean curvature times the patch's side, 2 r, is below some 0.07. Larger balls make it smaller.

    Standard errors presume that each point errs for itself. Where neighbours err together, as stereo
    cameras' do, planes bend by more, and only places that are known to be flat tell by how much.

    Parameters
    ----------
    extractions
        One or more, of any radius. In the sensor's axes, where no standard errors are given, the noise,
        radius and count of the places serve.
    flat
        Whether all places lie on surfaces known to be flat: their mean curvature is then the noise.
    frame
        The vocabulary; `Frame.default()` by default.

    Returns
    -------
    The length, for `Extraction.signatures(flat_atom=...)`.

    Raises
    ------
    InvalidInputError
        If there is no extraction; if one has no place whose noise is known (more than six points are
        needed); or if the noise alone is beyond the vocabulary's end.
    """
    if not extractions:
        raise InvalidInputError("the length of the flat atom follows the noise of one extraction or more")
    noise = max(_noise_in_patch_units(extraction, flat) for extraction in extractions)
    frame = Frame.default() if frame is None else frame
    length = frame.flat_atom_length(noise)
    if length is None:
        raise InvalidInputError("the noise is beyond the vocabulary: take a larger radius")
    return length


def length_asked_for(
    flat_atom: float | Literal["auto"] | None, extraction: Extraction, frame: Frame
) -> float | None:
    """Return the length that an argument `flat_atom` asks for; None where it asks for no flat atom.

    Raises
    ------
    InvalidInputError
        If it is neither "auto" nor a finite number above 0, or as `flat_atom_length`.
    """
    if flat_atom is None:
        return None
    if flat_atom == "auto":
        return flat_atom_length(extraction, frame=frame)
    if isinstance(flat_atom, str) or not (np.isfinite(flat_atom) and flat_atom > 0):
        raise InvalidInputError(f'flat_atom must be a finite number above 0 or "auto", not {flat_atom!r}')
    return flat_atom


def _noise_in_patch_units(extraction: Extraction, flat: bool) -> float:
    """Return the typical error of the mean curvature where the patch's side, 2 r, is 1."""
    radius = np.asarray(extraction.radius)
    std: NDArray[np.floating] = extraction.mean_curvature_std
    if flat:
        std = MEDIAN_TO_STD * np.abs(extraction.mean_curvature)
    elif extraction.axes == "sensor":
        with np.errstate(divide="ignore", invalid="ignore"):
            std = mean_curvature_noise(extraction.noise, radius, extraction.count.astype(np.float32))
    noise = 2.0 * radius * std
    known = np.isfinite(noise)
    if not known.any():
        raise InvalidInputError("no place has more than six points, so that the noise is not known")
    return float(np.median(noise[known]))
