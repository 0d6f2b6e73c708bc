"""FLIP: the difference that a viewer sees between two pictures shown in turn, by its authors' own package."""

import numpy as np
from numpy.typing import NDArray


def flip_error(
    reference: NDArray[np.uint8], picture: NDArray[np.uint8], region: NDArray[np.bool_]
) -> float | None:
    """Return the mean LDR-FLIP over a region, at the authors' 67 pixels a degree; None without flip-evaluator [1].

    Parameters
    ----------
    reference, picture : uint8 [H, W, 3] sRGB [1]
    region : bool [H, W] pixels that count, at least one [1]

    Source: Andersson et al. 2020, DOI 10.1145/3406183.
    """
    try:
        import flip_evaluator
    except ImportError:
        return None
    pair = (np.ascontiguousarray(p, np.float32) / 255 for p in (reference, picture))
    error, _, _ = flip_evaluator.evaluate(*pair, "LDR", applyMagma=False)
    return float(np.squeeze(error)[region].mean())
