"""One protocol over time."""

from . import _core
from ._table import Columns, Picture


class Trace(Columns):
    """A protocol over time: columns `t`, `v`, `theta`, `tau`, and `v_c` of a spring or `beta` of an optimum."""

    def __init__(self, trace: _core.Trace, name: str) -> None:
        self._trace, self.name = trace, name
        self.__rows = trace.rows()
        self.shape = (len(self.__rows),)

    @property
    def _rows(self) -> _core.Rows:
        return self.__rows

    @property
    def facts(self) -> dict[str, float | str]:
        """Parameters and results of the protocol, such as `work` and `status`."""
        return {key: _number(value) for key, value in self._trace.facts}

    @property
    def header(self) -> str:
        """The protocol in a few lines, as the command line prints them."""
        return self._trace.header

    def plot(self, *others: "Trace", width: float | None = None) -> Picture:
        """The picture that `slipsweep plot` draws of this trace, and of `others` over it."""
        return Picture(_core.plot_traces([self._trace, *(other._trace for other in others)], width))

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
    **axes: float,
) -> Trace:
    """One protocol over time, such as `trace("optimal", t_f=0.02, a=0.03, b=0.05, v_i=3.0, v_f=100.0)`.

    Protocols and axes are those of `slipsweep trace --help`. `points` is the number of equally spaced times; by default the fewest that show every detail.
    """
    arguments = [protocol]
    for name, value in axes.items():
        arguments += [f"--{name.replace('_', '-')}", repr(float(value))]
    if rtol is not None:
        arguments += ["--rtol", repr(float(rtol))]
    if not velocity_bound:
        arguments.append("--unbounded")
    return of_arguments(arguments, protocol, points)


def of_arguments(arguments: list[str], name: str, points: int | None) -> Trace:
    """The trace that the arguments of `slipsweep trace` name."""
    if points is not None:
        arguments = [*arguments, "--points", str(points)]
    return Trace(_core.trace(arguments), name)
