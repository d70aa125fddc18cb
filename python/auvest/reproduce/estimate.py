"""A mean over Monte Carlo runs with its standard error."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isnan
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A mean over runs with its standard error, NaN for one run."""

    value: float
    standard_error: float

    @property
    def below_zero(self) -> bool:
        """Whether it is, by more than two standard errors."""
        return self.value < -2 * self.standard_error

    def text(self, decimals: int, unit: str = "", sign: str = "-") -> str:
        """Give both with so many decimals; "+" as sign shows it in any case."""
        value = f"{self.value:{sign}.{decimals}f}{unit}"
        error = self.standard_error
        return value if isnan(error) else f"{value} ± {error:.{decimals}f}{unit}"


def all_below_zero(estimates: Iterable[Estimate]) -> bool:
    """Whether all are, each by more than two standard errors."""
    return all(one.below_zero for one in estimates)
