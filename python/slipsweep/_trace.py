"""One protocol over time."""

from typing import Any

from . import _core
from ._table import Columns, Picture


# The axes of all tables, and what else the command takes.
_FLAGS = dict.fromkeys([axis["name"] for table in _core.tables() for axis in table["axes"]] + ["friction", "from", "disturb", "loop", "rtol"])


class Trace(Columns):
    """A protocol over time: columns `t`, `v`, `theta`, `tau`, and `v_c` of a spring or `beta` of an optimum."""

    def __init__(self, trace: _core.Trace, name: str, arguments: list[str]) -> None:
        self._trace, self.name, self._arguments = trace, name, arguments
        self.__rows = trace.rows()
        self.shape = (len(self.__rows),)

    @property
    def _rows(self) -> _core.Rows:
        return self.__rows

    def __reduce__(self) -> tuple[Any, ...]:
        return of_arguments, (self._arguments, self.name, None)

    @property
    def facts(self) -> dict[str, float | str]:
        """Parameters and results of the protocol, such as `work` and `status`."""
        return {key: _number(value) for key, value in self._trace.facts}

    @property
    def header(self) -> str:
        """The protocol in a few lines, as the command line prints them."""
        return self._trace.header

    def plot(self, *others: "Trace", x: str | None = None, y: str | None = None, width: float | None = None) -> Picture:
        """The picture that `slipsweep plot` draws of this trace, and of `others` over it: over time, or column `y` over `x`."""
        return Picture(_core.plot_traces([self._trace, *(other._trace for other in others)], x, y, width))

    def __repr__(self) -> str:
        return f"{self.header}\n{super().__repr__()}"

    def _repr_html_(self) -> str:
        return str(self.plot())


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def trace(
    protocol: str,
    *,
    points: int | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    disturb: str | None = None,
    loop: str | None = None,
    friction: str | None = None,
    **axes: float | str,
) -> Trace:
    """One protocol over time, such as `trace("optimal", t_f=0.02, a=0.03, b=0.05, v_i=3.0, v_f=100.0)`.

    Protocols and axes are those of `slipsweep trace --help`, in dimensionless units. An optimum can start on the way: `theta` and `t_left` take the
    place of `v_i` and `t_f`. `points` is the number of equally spaced times; by default the fewest that show every detail. `disturb`, such as
    "theta=+10% at 0.25", changes the state suddenly; `loop` ("closed", "open") is what follows. `friction` is "log" or "regularised".
    """
    known = [name for name, _ in _core.protocols()]
    if protocol not in known:
        raise ValueError(f'unknown protocol "{protocol}"\n  expected: {", ".join(known)}\n  help: correct the name')
    arguments = [protocol]
    if "theta" in axes and "t_left" in axes:
        axes["from"] = f"theta={_text('theta', axes.pop('theta'))},t_left={_text('t_left', axes.pop('t_left'))}"
    options = {"rtol": rtol, "disturb": disturb, "loop": loop, "friction": friction}
    for name, value in (axes | {name: value for name, value in options.items() if value is not None}).items():
        if name not in _FLAGS:
            raise TypeError(f"trace() got an unexpected keyword argument {name!r}; expected {', '.join(_FLAGS)}")
        # A negative number is no flag.
        arguments.append(f"--{name.replace('_', '-')}={_text(name, value)}")
    if not velocity_bound:
        arguments.append("--unbounded")
    return of_arguments(arguments, protocol, points)


def _text(name: str, value: Any) -> str:
    """The text of a number, or a word."""
    if isinstance(value, str):
        return value
    try:
        return repr(float(value))
    except (TypeError, ValueError):
        raise ValueError(f"{name}: found {type(value).__name__}\n  expected: a number\n  help: trace one protocol at a time") from None


def of_arguments(arguments: list[str], name: str, points: int | None) -> Trace:
    """The trace that the arguments of `slipsweep trace` name."""
    if points is not None:
        arguments = [*arguments, "--points", str(points)]
    return Trace(_core.trace(arguments), name, arguments)
