"""Random arguments, written as Python: plausible ones, and those that a caller should not give."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args, get_origin, get_type_hints

#: In the place of a number.
ODD_NUMBERS = (
    "nan", "inf", "-inf", "5e-324", "1e-45", "1e-38", "1e-30", "-0.0", "0.0", "1e9", "-1e9", "1e38",
    "-1e38", "3.4e38", "1e39", "1e200", "1e308", "2**63", "-2**63", "10**400",
)  # fmt: skip
#: Around a matrix.
ODD_SCALES = ("nan", "inf", "1e-45", "1e-38", "1e-30", "1e38", "1e39", "1e300", "1e-300", "0.0")
#: In the place of anything.
ODD_OBJECTS = (
    "True", "None", "'1'", "b'1'", "1j", "[]", "{}", "()", "np.float16(1)", "np.float32(3)",
    "np.int8(-3)", "np.array(2.0)", "np.array([2.0])", "np.datetime64('2020')",
    "np.timedelta64(1, 's')", "object()", "float",
)  # fmt: skip
#: Around an array, which is `a`.
ODD_ARRAYS = (
    "np.array({a}, 'f2')", "np.array({a}).astype('i8')", "np.array({a}).astype('c8')",
    "np.array({a}, object)", "np.array({a}).astype(str)", "np.array({a}, '>f8')",
    "np.repeat({a}, 2)[::2]", "np.array({a})[:0]", "np.array({a})[None]", "np.array({a})[::-1]",
    "np.ma.masked_array({a}, np.array({a}) > 0)", "[{a}, 3]", "np.resize({a}, 7)", "{a}[:-1]",
    "np.broadcast_to(1.0, np.shape({a}))",
)  # fmt: skip


class Values:
    """Makes arguments. `odd` is how often one is such that a caller should not give."""

    def __init__(self, rng: random.Random, odd: float = 0.06) -> None:
        self.rng, self.odd = rng, odd

    def is_odd(self) -> bool:
        return self.rng.random() < self.odd

    def choice(self, options: Sequence[Any]) -> Any:
        return self.rng.choice(options)

    def any_object(self) -> str:
        return self.choice(ODD_NUMBERS if self.rng.random() < 0.6 else ODD_OBJECTS)

    def number(self, scale: float = 10.0) -> str:
        return self.any_object() if self.is_odd() else self.plain(-scale, scale)

    def positive(self, scale: float = 10.0) -> str:
        return self.any_object() if self.is_odd() else self.plain(0, scale)

    def plain(self, low: float, high: float) -> str:
        return f"{self.rng.uniform(low, high):.4g}"

    def vector(self, size: int, scale: float = 10.0) -> str:
        numbers = [self.plain(-scale, scale) for _ in range(size)]
        return self.array(numbers)

    def rows(self, count: int, size: int, scale: float = 10.0) -> str:
        rows = [
            f"[{', '.join(self.plain(-scale, scale) for _ in range(size))}]" for _ in range(count)
        ]
        if rows and self.rng.random() < 0.2:
            rows[self.rng.randrange(count)] = f"[{', '.join(['nan'] * size)}]"
        return self.array(rows)

    def array(self, items: list[str]) -> str:
        if not self.is_odd():
            return f"[{', '.join(items)}]"
        kind = self.rng.random()
        if kind < 0.3 and items:
            items[self.rng.randrange(len(items))] = self.choice(ODD_NUMBERS)
            return f"[{', '.join(items)}]"
        if kind < 0.4:
            return self.any_object()
        return self.choice(ODD_ARRAYS).replace("{a}", f"[{', '.join(items)}]")

    def covariance(self, size: int, scale: float = 1.0) -> str:
        if self.rng.random() < 0.2:
            scale *= 10 ** self.rng.uniform(-6, 6)
        diagonal = [f"{scale * self.rng.uniform(0.01, 1):.3g}" for _ in range(size)]
        matrix = f"np.diag([{', '.join(diagonal)}])"
        kind = self.rng.random()
        if kind < 0.4:
            seed = self.rng.randrange(1000)
            matrix = f"spread({size}, {scale:.3g}, {seed})"
        if not self.is_odd():
            return matrix
        odd = (
            f"-{matrix}", f"np.zeros(({size}, {size}))", f"np.ones(({size}, {size}))",
            f"{matrix} + np.eye({size}, k=1)", f"np.asfortranarray({matrix})", f"{matrix}[:-1]",
            f"np.array({matrix}, 'f2')", f"np.array({matrix}, 'c16')",
            f"np.diag(np.logspace(-37, 37, {size}))", f"{matrix} * {self.choice(ODD_SCALES)}",
            f"np.eye({size}) * {self.choice(ODD_SCALES)}", self.any_object(),
        )  # fmt: skip
        return str(self.choice(odd))

    def dtype(self) -> str:
        if self.rng.random() < 0.97:
            return str(self.choice(("'float32'", "'float64'")))
        return str(self.choice(("'float16'", "None", "int", "3", "'f4'", "object()")))

    def made(self, cls: type[Any], given: dict[str, str] | None = None) -> str:
        """An object of a dataclass: each field left out, plausible for its type, or odd."""
        hints = get_type_hints(cls)
        fields = dict(given or {})
        for entry in dataclasses.fields(cls):
            if entry.name in fields or not entry.init or self.rng.random() < 0.6:
                continue
            text = self._of_type(hints[entry.name], getattr(entry, "default", None))
            if text is not None:
                fields[entry.name] = text
        return f"{cls.__name__}({', '.join(f'{k}={v}' for k, v in fields.items())})"

    def _of_type(self, hint: Any, default: Any) -> str | None:
        if self.is_odd():
            return self.any_object()
        size = abs(default) if isinstance(default, (int, float)) and default else 1.0
        if hint is bool:
            return str(self.choice((True, False)))
        if hint is float:
            return self.plain(0, 3 * size)
        if hint is int:
            return str(self.rng.randrange(1, 8))
        if get_origin(hint) is Literal:
            return repr(self.choice(get_args(hint)))
        if get_origin(hint) is tuple:
            return self.vector(len(get_args(hint)), 100.0)
        return None

    def one_of(self, *makers: Callable[[], str]) -> str:
        """The text of one of several."""
        made: str = self.choice(makers)()
        return made
