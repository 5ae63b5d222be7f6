"""Settling times of step responses after many cycles, for tests/solver/step.rs.

Usage: generate_step_response_settling.py > step_response_settling.csv (scipy). The method is DOP853 with an error of 1e-13 a step: an explicit one, of another
kind than the solver's. The points are those of a random sample whose settling times version 0.1.0 gave wrong by 2e-3 and more.
"""

import math

from scipy.integrate import solve_ivp

# a, b, v_i/v_f, k, m v_f^2, and about when the response settles, in l/v_f.
POINTS = [
    (5.129742438023416e-2, 0.5, 1.8397714450399675e-2, 980.8734753479695, 2.2576257182401296, 399.5),
    (1.5249547541070125e-2, 0.19484268527866758, 5.9455583465394784e-6, 42.36718251442768, 1.064116166660739, 892.7),
    (1.9712284929767673e-2, 3.807250073190747e-2, 5.8985955444441255e-5, 22.259216170781436, 0.9433845186249702, 460.9),
    (0.1245137878107108, 0.4201119929572533, 1.1383213334545817e-3, 211.21303096383667, 5.33728020855668, 414.9),
]


def settling_time(a, b, ratio, k, inertia, about):
    def slope(_, state):
        z, y, x = state
        # Trial stages may go anywhere.
        v = math.exp(min(x, 50.0))
        return [k * (1.0 - v), math.exp(min(-y, 50.0)) - v, (z - a * x - b * y) / (inertia * v)]

    edges = [lambda _, state, edge=edge: state[2] - edge for edge in (math.log(0.99), math.log(1.01))]
    x = math.log(ratio)
    solved = solve_ivp(
        slope, [0.0, 1.02 * about], [(a - b) * x, -x, x], method="DOP853", rtol=1e-13, atol=1e-15, events=edges
    )
    assert solved.success, solved.message
    return max(time for times in solved.t_events for time in times)


def main():
    print("# Time after which |v/v_f - 1| stays below 0.01, in l/v_f; by generate_step_response_settling.py.")
    print("a,b,ratio,k,inertia,settling_time")
    for *point, about in POINTS:
        print(",".join(repr(number) for number in [*point, round(float(settling_time(*point, about)), 9)]))


main()
