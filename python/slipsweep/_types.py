"""Types of arguments."""

from collections.abc import Mapping
from typing import TypeAlias

import numpy.typing as npt

#: A number or word, or anything that NumPy makes an array of: lists, arrays, pandas and polars Series.
Values: TypeAlias = npt.ArrayLike
#: The axes of a product, the last one fastest.
Grid: TypeAlias = Mapping[str, Values]
