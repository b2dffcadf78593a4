"""What this core can do at best: a codebook of four dimensions passed through once for each input, in and out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit

Array = NDArray[Any]


@jit
def bound(codes: Array, samples: Array, rate: Any) -> None:
    """Read and write all codes (4, units) once for each sample (n, 4), with a distance and a square root a unit."""
    a, b, c, d = codes[0], codes[1], codes[2], codes[3]
    for t in range(samples.shape[0]):
        x0, x1, x2, x3 = samples[t, 0], samples[t, 1], samples[t, 2], samples[t, 3]
        for i in range(a.size):
            d0, d1, d2, d3 = x0 - a[i], x1 - b[i], x2 - c[i], x3 - d[i]
            gain = rate * np.sqrt(d0 * d0 + d1 * d1 + d2 * d2 + d3 * d3)
            a[i] += gain * d0
            b[i] += gain * d1
            c[i] += gain * d2
            d[i] += gain * d3
