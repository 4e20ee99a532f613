"""Types of arrays, as every package writes them in its annotations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # real or complex, as the docstring says
Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Places = NDArray[np.intp]  # indices
