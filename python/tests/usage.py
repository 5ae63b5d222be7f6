"""What type checkers accept and refuse; `mypy tests/usage.py` and pyright check it, and nothing runs it."""

import numpy as np
import numpy.typing as npt

import slipsweep as ss

times: npt.NDArray[np.float64] = np.geomspace(0.01, 0.1, 10)
table: ss.Table = ss.optimal(t_f=times, a=0.03, b=[0.05, 0.06], v_i=3, v_f=100.0, columns=["work", "dwork_da"])
shortcuts = ss.shortcut(t_f=0.02, a=0.03, b=0.05, v_i=3.0, v_f=100.0, family=["step", "cubic"])
landscape = ss.gap(t_f=0.02, a=0.03, b=0.05, v_i=3.0, v_f=100.0, grid={"alpha_2": times, "alpha_3": [0.0]}, unit="1/t_f")
names: list[str] = table.columns
picture: str = landscape.plot(x="alpha_2", where=["t_f=0.02"])
audit: int = ss.open("results/granite").verify(sample=10).errors
dataset: ss.Dataset = ss.run({"name": "x", "axes": {}, "tables": {}}, out="results", progress=lambda phase, done, rows: None)

ss.optimal(t_f=times, columns=["wrok"])  # type: ignore[list-item]  # pyright: ignore[reportArgumentType]  # codespell:ignore wrok
ss.optimal(tf=times)  # type: ignore[call-arg]  # pyright: ignore[reportCallIssue]
ss.optimal(t_f=times, unit="1/t_f")  # type: ignore[call-arg]  # pyright: ignore[reportCallIssue]
ss.gap(t_f=times, units="cgs")  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
ss.optimum(t_f=times)  # type: ignore[attr-defined]  # pyright: ignore[reportAttributeAccessIssue]
