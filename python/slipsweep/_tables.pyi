"""A function for each table. Written by `python -m slipsweep._stubs`."""

from collections.abc import Sequence
from typing import Literal

from ._table import Table
from ._types import Grid, Values

__all__ = ["gap", "best_cubic", "optimal", "feedback", "crossover", "shortcut", "stability", "step_response", "compliant", "regularised"]

def gap(
    *,
    t_f: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    alpha_2: Values | None = ...,
    alpha_3: Values | None = ...,
    grid: Grid | None = None,
    unit: Literal["1/t_f", "1"] | None = None,
    columns: Sequence[Literal["work", "work_optimal", "gap", "v_min", "work_error", "gap_error"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The work of a cubic shortcut and its gap to the optimum: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    t_f : array_like, in l/v_0
        duration of the protocol; 1e-20 <= t_f <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    alpha_2 : array_like, in 1
        coefficient of t in theta of the cubic shortcut; -1e100 <= alpha_2 <= 1e100
    alpha_3 : array_like, in v_0/l
        coefficient of t^2 in theta of the cubic shortcut; -1e100 <= alpha_3 <= 1e100
    unit : '1/t_f' or '1', optional
        Unit of alpha_2 and alpha_3: relative to the duration, 1/t_f and 1/t_f^2, or that of the model.
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        work, in mu_0 sigma l
            work of friction W_s of the shortcut
        work_optimal, in mu_0 sigma l
            least work of friction W* of any protocol
        gap, in 1
            (W_s - W*)/W*, good to rtol of 1 + gap
        v_min, in v_0
            least velocity of the shortcut
        work_error, in mu_0 sigma l (only if `columns` names it)
            bound of the error of work, by a second quadrature
        gap_error, in 1 (only if `columns` names it)
            bound of the error of gap, by a second quadrature and a second optimum
        status
            outcome of the row; a number that does not exist is null
    """

def best_cubic(
    *,
    t_f: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["alpha_2", "alpha_3", "work", "work_optimal", "gap", "v_min", "work_error"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The cubic shortcut of least work, over the whole (alpha_2, alpha_3) plane: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    t_f : array_like, in l/v_0
        duration of the protocol; 1e-20 <= t_f <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        alpha_2, in 1/t_f
            coefficient of t in theta; in the unit of alpha_2 in the spec, 1/t_f by default
        alpha_3, in 1/t_f^2
            coefficient of t^2 in theta; in the unit of alpha_3 in the spec, 1/t_f^2 by default
        work, in mu_0 sigma l
            work of friction W_s of the best shortcut
        work_optimal, in mu_0 sigma l
            least work of friction W* of any protocol
        gap, in 1
            (W_s - W*)/W*, computed without cancellation: good to a relative 1e-7, or to 1e-20
        v_min, in v_0
            least velocity of the best shortcut
        work_error, in mu_0 sigma l (only if `columns` names it)
            bound of the error of work, by a second search
        status
            outcome of the row; a number that does not exist is null
    """

def optimal(
    *,
    t_f: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    v_ceiling: Values | None = ...,
    tau_ceiling: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["work", "v_start", "v_end", "time_at_floor", "time_at_v_ceiling", "time_at_tau_ceiling", "hamiltonian", "theta_max", "strategy", "work_error", "friction_max", "binding", "t_least", "v_ceiling_least", "tau_ceiling_least", "bound", "dwork_da", "dwork_db", "dwork_dv_i", "dwork_dv_f", "dwork_dv_ceiling", "dwork_dtau_ceiling"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The protocol of least work: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    t_f : array_like, in l/v_0
        duration of the protocol; 1e-20 <= t_f <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    v_ceiling : array_like, in v_0, default inf
        velocity ceiling between the ends; inf: none; 1 < v_ceiling <= 1e12, or inf: no ceiling
    tau_ceiling : array_like, in mu_0 sigma, default inf
        friction ceiling between the ends; inf: none; 1e-20 <= tau_ceiling <= 1e20, or inf: no ceiling
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        work, in mu_0 sigma l
            least work of friction W*
        v_start, in v_0
            velocity just after the start, v(0+)
        v_end, in v_0
            velocity just before the end, v(t_f-)
        time_at_floor, in l/v_0
            time spent on the velocity floor v = 1
        time_at_v_ceiling, in l/v_0
            time spent on the velocity ceiling
        time_at_tau_ceiling, in l/v_0
            time spent on the friction ceiling
        hamiltonian, in mu_0 sigma v_0
            dW*/dt_f
        theta_max, in l/v_0
            greatest state variable theta on the path
        strategy
            start of the protocol: speed_up v(0+) > v_i, slow_down 1 < v(0+) <= v_i, floor v(0+) = 1
        work_error, in mu_0 sigma l (only if `columns` names it)
            bound of the error of work, by a second solve
        friction_max, in mu_0 sigma (only if `columns` names it)
            greatest friction between the ends
        binding (only if `columns` names it)
            the ceilings on which the protocol spends time
        t_least, in l/v_0 (only if `columns` names it)
            least feasible duration under the floor and the ceilings
        v_ceiling_least, in v_0 (only if `columns` names it)
            least feasible velocity ceiling for t_f and tau_ceiling
        tau_ceiling_least, in mu_0 sigma (only if `columns` names it)
            least feasible friction ceiling for t_f and v_ceiling
        bound (only if `columns` names it)
            the bound that makes the row infeasible; too_fast: t_f < t_least, too_slow: theta cannot wait so long
        dwork_da, in sigma l (only if `columns` names it)
            derivative of work with respect to a
        dwork_db, in sigma l (only if `columns` names it)
            derivative of work with respect to b
        dwork_dv_i, in mu_0 sigma l/v_0 (only if `columns` names it)
            derivative of work with respect to v_i
        dwork_dv_f, in mu_0 sigma l/v_0 (only if `columns` names it)
            derivative of work with respect to v_f
        dwork_dv_ceiling, in mu_0 sigma l/v_0 (only if `columns` names it)
            shadow price of v_ceiling; 0 if it does not bind
        dwork_dtau_ceiling, in l (only if `columns` names it)
            shadow price of tau_ceiling; 0 if it does not bind
        status
            outcome of the row; a number that does not exist is null
    """

def feedback(
    *,
    theta: Values | None = ...,
    t_left: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_f: Values | None = ...,
    v_ceiling: Values | None = ...,
    tau_ceiling: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["v", "work_to_go", "costate", "gain", "arc"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The optimal velocity now, by the state variable and the time left: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    theta : array_like, in l/v_0
        state variable now, on the way to steady sliding at v_f; 1e-20 <= theta <= 1e20
    t_left : array_like, in l/v_0
        time left of the protocol; 1e-20 <= t_left <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    v_ceiling : array_like, in v_0, default inf
        velocity ceiling between the ends; inf: none; 1 < v_ceiling <= 1e12, or inf: no ceiling
    tau_ceiling : array_like, in mu_0 sigma, default inf
        friction ceiling between the ends; inf: none; 1e-20 <= tau_ceiling <= 1e20, or inf: no ceiling
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        v, in v_0
            velocity of the optimal protocol now
        work_to_go, in mu_0 sigma l
            least work of friction in the time left
        costate, in mu_0 sigma v_0
            d work_to_go/d theta; -beta of a trace
        gain, in v_0^2/l
            dv/dtheta at fixed t_left
        arc
            the bound on which the protocol is now, or free if on none
        status
            outcome of the row; a number that does not exist is null
    """

def crossover(
    *,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["t_cross", "t_floor", "t_cheapest", "t_min", "t_turn", "t_free_in", "t_free_out", "work_at_t_cross", "work_at_t_floor", "work_at_t_cheapest", "work_at_t_min", "work_at_t_turn"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The durations at which the optimal strategy changes: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        t_cross, in l/v_0
            acceleration: duration at which v(0+) = v_i
        t_floor, in l/v_0
            acceleration: duration at which v(0+) reaches the floor 1
        t_cheapest, in l/v_0
            acceleration: duration of least W*
        t_min, in l/v_0
            deceleration: shortest possible duration
        t_turn, in l/v_0
            deceleration: duration at which v(t_f-) = v_f
        t_free_in, in l/v_0
            deceleration: start of the window of durations that never reach the floor
        t_free_out, in l/v_0
            deceleration: end of the window of durations that never reach the floor
        work_at_t_cross, in mu_0 sigma l
            W* at t_cross
        work_at_t_floor, in mu_0 sigma l
            W* at t_floor
        work_at_t_cheapest, in mu_0 sigma l
            W* at t_cheapest
        work_at_t_min, in mu_0 sigma l
            W* at t_min
        work_at_t_turn, in mu_0 sigma l
            W* at t_turn
        status
            outcome of the row; a number that does not exist is null
    """

def shortcut(
    *,
    t_f: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    family: Values | None = ...,
    tau_ceiling: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["alpha", "work", "work_optimal", "gap", "v_min", "v_max", "friction_max", "terminal_error", "bound", "work_error", "gap_error"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The shortcut of a family: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    t_f : array_like, in l/v_0
        duration of the protocol; 1e-20 <= t_f <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    family : str or sequence of str
        family of shortcuts; one of step, cubic, bounded_velocity, bounded_friction; by default all
    tau_ceiling : array_like, in mu_0 sigma, default inf
        friction ceiling between the ends; inf: none; 1e-20 <= tau_ceiling <= 1e20, or inf: no ceiling
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        alpha, in 1; (v_0/l)^2 for bounded_velocity
            parameter of the family (alpha_3 in the paper); null for step and cubic, 0 for tau_ceiling = inf
        work, in mu_0 sigma l
            work of friction W_s
        work_optimal, in mu_0 sigma l
            least work of friction W* of any protocol; for bounded_friction under its tau_ceiling
        gap, in 1
            (W_s - W*)/W*, good to rtol of 1 + gap; negative for a step that does not arrive
        v_min, in v_0
            least velocity between the ends; 0 if it underflows
        v_max, in v_0
            greatest velocity between the ends
        friction_max, in mu_0 sigma
            greatest friction between the ends
        terminal_error, in 1 (only if `columns` names it)
            theta(t_f) v_f - 1, the miss of a step; 0 for the other families
        bound (only if `columns` names it)
            the bound that makes the row infeasible
        work_error, in mu_0 sigma l (only if `columns` names it)
            bound of the error of work, by a second solve
        gap_error, in 1 (only if `columns` names it)
            bound of the error of gap, by a second solve of both works
        status
            outcome of the row; a number that does not exist is null
    """

def stability(
    *,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    k: Values | None = ...,
    m: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["k_od", "k_c_i", "k_c_f", "stable_i", "stable_f", "v_crit", "growth_rate", "frequency", "decay_rate", "hopf_type"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """Linear stability of steady sliding at both velocities: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    k : array_like, in mu_0 sigma/l, default inf
        stiffness of the spring; 1e-40 <= k <= 1e40, or inf: rigid
    m : array_like, in mu_0 sigma l/v_0^2, default 0.0
        mass of the block; 1e-40 <= m <= 1e40, or 0
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        k_od, in mu_0 sigma/l
            overdamped critical stiffness b - a; if not positive, steady sliding is stable at any stiffness
        k_c_i, in mu_0 sigma/l
            critical stiffness at v_i, (b - a)(1 + m v_i^2/a)
        k_c_f, in mu_0 sigma/l
            critical stiffness at v_f, (b - a)(1 + m v_f^2/a)
        stable_i
            whether steady sliding at v_i is stable, k > k_c_i; decided exactly
        stable_f
            whether steady sliding at v_f is stable, k > k_c_f; decided exactly
        v_crit, in v_0
            velocity above which steady sliding is unstable; null if there is none
        growth_rate, in v_0/l
            real part of the leading pair of eigenvalues at v_f; null for a rigid spring
        frequency, in v_0/l
            imaginary part of that pair (angular frequency); 0 if all three are real
        decay_rate, in v_0/l
            the third eigenvalue at v_f, real; null for m = 0, which has two
        hopf_type (only if `columns` names it)
            supercritical: small limit cycles exist below k_c_f; subcritical: above it; null for m = 0 or b <= a
        status
            outcome of the row; a number that does not exist is null
    """

def step_response(
    *,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    k: Values | None = ...,
    m: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["v_peak", "v_trough", "t_peak", "outcome", "stick_slip", "settling_time", "period", "cycle_peak", "cycle_trough", "t_end", "first_lyapunov_coefficient"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The response to an abrupt step of the control velocity: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    k : array_like, in mu_0 sigma/l, default inf
        stiffness of the spring; 1e-40 <= k <= 1e40, or inf: rigid
    m : array_like, in mu_0 sigma l/v_0^2, default 0.0
        mass of the block; 1e-40 <= m <= 1e40, or 0
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-06.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        v_peak, in v_0
            greatest velocity after v first reaches v_f, at least v_f; null if undecided
        v_trough, in v_0
            least velocity after v first reaches v_f, at most v_f; 0 if it underflows; null if undecided or not known to rtol
        t_peak, in l/v_0
            time of v_peak, to a relative rtol over the overshoot v_peak/v_f - 1; null if the peak is only approached, if undecided, or if not known to that accuracy
        outcome
            long-term behaviour of the response
        stick_slip
            whether the oscillation is sustained; null if undecided
        settling_time, in l/v_0
            time after which v stays within 1 % of v_f; null unless settled, or if not known to rtol
        period, in l/v_0
            duration of the limit cycle; null without one
        cycle_peak, in v_0 (only if `columns` names it)
            greatest velocity on the limit cycle; null without one
        cycle_trough, in v_0 (only if `columns` names it)
            least velocity on the limit cycle; null without one, or if not known to rtol
        t_end, in l/v_0 (only if `columns` names it)
            time up to which the response was integrated
        first_lyapunov_coefficient, in 1 (only if `columns` names it)
            first Lyapunov coefficient at the critical stiffness for this mass and v_f: negative if the Hopf point is supercritical, positive if a limit cycle may be met above it; null for b <= a and for m = 0
        status
            outcome of the row; a number that does not exist is null
    """

def compliant(
    *,
    t_f: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    k: Values | None = ...,
    m: Values | None = ...,
    dt: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["alpha", "work", "work_optimal", "gap", "v_min", "v_max", "v_c_min", "v_c_max", "amplification", "sampling_error", "stiffness_ratio", "open_loop_error", "work_error", "gap_error"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The smooth shortcut at finite stiffness: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    t_f : array_like, in l/v_0
        duration of the protocol; 1e-20 <= t_f <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    k : array_like, in mu_0 sigma/l, default inf
        stiffness of the spring; 1e-40 <= k <= 1e40, or inf: rigid
    m : array_like, in mu_0 sigma l/v_0^2, default 0.0
        mass of the block; 1e-40 <= m <= 1e40, or 0
    dt : array_like, in l/v_0, default 0.0
        time between samples of the control velocity, each held until the next; 0: not sampled; 1e-20 <= dt <= 1e20, or 0: not sampled
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        alpha, in 1
            coefficient of x^3 (1 - x)^3 in ln(v - 1), x = t/t_f
        work, in mu_0 sigma l
            work of friction W_s
        work_optimal, in mu_0 sigma l
            least work of friction W* of any protocol
        gap, in 1
            (W_s - W*)/W*, good to rtol of 1 + gap
        v_min, in v_0
            least velocity of the block
        v_max, in v_0
            greatest velocity of the block
        v_c_min, in v_0
            least control velocity; both good to rtol of the greater of the two
        v_c_max, in v_0
            greatest control velocity
        amplification, in 1
            greatest factor by which a small error grows from start to end, in the norm of (ln v, ln theta, k s/a); 0 below 1e-30, where only rounding is left of the error; null beyond 3000 steps of its integration and beyond the range of doubles
        sampling_error, in 1
            distance from the target in that norm if v_c is sampled every dt and held, to rtol of 1; null for dt = 0, beyond 100000 samples, and where the motion does not last
        stiffness_ratio, in 1
            k t_f^2/m: a large one makes the spring rigid; inf for m = 0
        open_loop_error, in 1 (only if `columns` names it)
            distance from the target in that norm if v_c is simulated as it is, at rtol: what that and rounding leave, amplified; null where the motion does not last
        work_error, in mu_0 sigma l (only if `columns` names it)
            bound of the error of work, by a second solve
        gap_error, in 1 (only if `columns` names it)
            bound of the error of gap, by a second solve of both works
        status
            outcome of the row; a number that does not exist is null
    """

def regularised(
    *,
    t_f: Values | None = ...,
    a: Values | None = ...,
    b: Values | None = ...,
    v_i: Values | None = ...,
    v_f: Values | None = ...,
    k: Values | None = ...,
    m: Values | None = ...,
    delta_t: Values | None = ...,
    grid: Grid | None = None,
    columns: Sequence[Literal["work", "work_optimal", "gap", "v_min", "v_max", "v_c_min", "v_c_max", "work_error", "gap_error"]] | None = None,
    rtol: float | None = None,
    velocity_bound: bool = True,
    units: Literal["dimensionless", "si"] = "dimensionless",
    mu_0: float | None = None,
    l: float | None = None,
    v_0: float | None = None,
    normal_stress: float | None = None,
) -> Table:
    """The optimal protocol with its jumps replaced by smooth pieces: a row for each point.

    Arguments broadcast as in NumPy. A row that has no answer has a status that states why.

    Parameters
    ----------
    t_f : array_like, in l/v_0
        duration of the protocol; 1e-20 <= t_f <= 1e20
    a : array_like, in mu_0
        direct effect: coefficient of ln v in friction; 1e-6 <= a <= 10
    b : array_like, in mu_0
        evolution effect: coefficient of ln theta in friction; 0 <= b <= 10
    v_i : array_like, in v_0
        velocity of the initial steady state; 1 < v_i <= 1e12
    v_f : array_like, in v_0
        velocity of the final steady state; 1 < v_f <= 1e12
    k : array_like, in mu_0 sigma/l, default inf
        stiffness of the spring; 1e-40 <= k <= 1e40, or inf: rigid
    m : array_like, in mu_0 sigma l/v_0^2, default 0.0
        mass of the block; 1e-40 <= m <= 1e40, or 0
    delta_t : array_like, in l/v_0
        length of the smooth pieces that replace the jumps of the optimum; 1e-20 <= delta_t <= 1e20
    grid : mapping of axis to values, optional
        Axes of a product, the last one fastest; they multiply the points of the other arguments.
    columns : sequence of str, optional
        The columns to compute; by default all but the optional ones.
    rtol : float, optional
        Relative accuracy, 1e-13 <= rtol <= 1e-2; by default 1e-10.
    velocity_bound : bool
        Whether optimal protocols obey v >= 1.
    units : 'dimensionless' or 'si'
        'si' takes and gives SI values; it needs mu_0, l in m, v_0 in m/s and normal_stress in Pa.

    Returns
    -------
    Table
        The axes, and these columns:

        work, in mu_0 sigma l
            work of friction
        work_optimal, in mu_0 sigma l
            least work of friction W* of any protocol
        gap, in 1
            (work - W*)/W*, good to a relative rtol
        v_min, in v_0
            least velocity of the block; fewer digits far below 1
        v_max, in v_0
            greatest velocity of the block
        v_c_min, in v_0
            least control velocity; both good to rtol of the greater of the two
        v_c_max, in v_0
            greatest control velocity
        work_error, in mu_0 sigma l (only if `columns` names it)
            bound of the error of work, by a second solve
        gap_error, in 1 (only if `columns` names it)
            bound of the error of gap, by a second solve
        status
            outcome of the row; a number that does not exist is null
    """
