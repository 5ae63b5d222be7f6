//! Traces against the equations of motion, against the work and the costate that they must carry, and against their own
//! promise that straight lines between few rows are enough.

use crate::extent::quick_or_long;
use crate::support::{Random, relative};
use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Friction, Law, StateLaw, Transition};
use slipsweep::numerics::double_double::DoubleDouble;
use slipsweep::protocol::optimal::Bounds;
use slipsweep::protocol::shortcut::{self, Case};
use slipsweep::protocol::{Moment, Motion, SolverStats, Status, optimal};
use slipsweep::trace::{Absence, Protocol, RANGE_RTOL, Times, Trace, TracedPath};

const PAPER: Transition = Transition { law: Law { a: 0.03, b: 0.05 }, v_i: 3.0, v_f: 100.0 };
const BACK: Transition = Transition { v_i: 100.0, v_f: 3.0, ..PAPER };
const BEST_CUBIC: Protocol = Protocol::BestCubic {
    law: StateLaw::Ageing,
    bounds: Bounds { floor: true, v_ceiling: f64::INFINITY, tau_ceiling: f64::INFINITY },
};

fn case(transition: Transition, t_f: f64) -> Case {
    Case { transition, t_f, tau_ceiling: 1.6 }
}

fn path(protocol: Protocol, case: Case) -> TracedPath {
    protocol.path(&case, 1e-10).unwrap_or_else(|absence| panic!("{case:?}: {absence}"))
}

fn optimum(transition: Transition, t_f: f64) -> TracedPath {
    path(Protocol::Optimal { bounds: true.into() }, case(transition, t_f))
}

fn fewest(path: &TracedPath, transition: Transition) -> Trace {
    Trace::of(&*path.motion, &transition, Times::Fewest).expect("can be resolved")
}

/// Optimal protocols of every kind: fast, slow, with and without a hold, up and down, on both sides of `a = b`.
fn optima() -> Vec<(Transition, f64)> {
    let law = |a, b, v_i, v_f| Transition { law: Law { a, b }, v_i, v_f };
    let mut cases: Vec<(Transition, f64)> =
        [1e-6, 0.02, 0.037, 0.049, 0.05, 0.5, 20.0].map(|t_f| (PAPER, t_f)).to_vec();
    cases.extend([0.3955, 0.4, 0.41, 0.5, 20.0].map(|t_f| (BACK, t_f)));
    for t_f in [1e-4, 0.1, 3.0] {
        cases.push((law(0.03, 0.03, 3.0, 100.0), t_f));
        cases.push((law(0.05, 0.0, 1.5, 40.0), t_f));
        cases.push((law(1e-3, 2e-3, 3.0, 1e4), t_f));
        cases.push((law(0.03, 0.05, 7.0, 7.0), t_f));
    }
    cases
}

/// Protocols of every other kind.
fn shortcuts() -> Vec<(Protocol, Case)> {
    let mut cases = Vec::new();
    for (transition, t_f) in [(PAPER, 0.02), (PAPER, 0.5), (PAPER, 20.0), (BACK, 0.5), (BACK, 20.0)] {
        for family in shortcut::FAMILIES {
            let case = case(transition, t_f);
            if !matches!(family.solve(&case, 1e-10, &mut SolverStats::default()), Err(shortcut::Obstacle::Friction)) {
                cases.push((Protocol::Family(family), case));
            }
        }
    }
    cases.extend([0.02, 0.037, 0.049].map(|t_f| (BEST_CUBIC, case(PAPER, t_f))));
    for friction in Friction::ALL {
        let point = Protocol::CubicPoint { law: StateLaw::Ageing, friction, place: place(0.01, -0.5) };
        cases.push((point, case(PAPER, 0.02)));
    }
    cases
}

/// Optima of regularised friction: up, down, past the turning point and without, and near rest.
fn regularised() -> Vec<(Protocol, Case)> {
    let strong = Law { a: 0.1, b: 0.12 };
    let cases =
        [(50.0, 200.0, 0.5), (50.0, 200.0, 1e-3), (200.0, 50.0, 0.5), (200.0, 50.0, 0.0152), (100.0, 3.0, 40.0)];
    let of = |(v_i, v_f, t_f)| (Protocol::OptimalRegularised, case(Transition { law: strong, v_i, v_f }, t_f));
    let mut cases = cases.map(of).to_vec();
    cases.extend(
        [(PAPER, 0.02), (BACK, 0.5)].map(|(transition, t_f)| (Protocol::OptimalRegularised, case(transition, t_f))),
    );
    cases
}

/// Every course with the transition that it leads through.
fn paths() -> Vec<(TracedPath, Transition)> {
    let mut paths: Vec<(TracedPath, Transition)> =
        optima().into_iter().map(|(transition, t_f)| (optimum(transition, t_f), transition)).collect();
    for (protocol, case) in shortcuts().into_iter().chain(regularised()) {
        paths.push((path(protocol, case), case.transition));
    }
    paths
}

/// `int f dt` between two places of a motion: the trapezium with 32, 64, 128 and 256 steps, extrapolated (Romberg).
fn integral(motion: &dyn Motion, from: f64, to: f64, f: impl Fn(&Moment) -> f64) -> f64 {
    let moments: Vec<Moment> = (0..=256).map(|i| motion.at(from + (to - from) * f64::from(i) / 256.0)).collect();
    let trapezium = |stride: usize| -> f64 {
        let coarse: Vec<&Moment> = moments.iter().step_by(stride).collect();
        coarse.windows(2).map(|pair| 0.5 * (f(pair[0]) + f(pair[1])) * (pair[1].t - pair[0].t)).sum()
    };
    let mut row = [8, 4, 2, 1].map(trapezium).to_vec();
    for power in [4.0, 16.0, 64.0] {
        row = row.windows(2).map(|pair| pair[1] + (pair[1] - pair[0]) / (power - 1.0)).collect();
    }
    row[0]
}

fn place(a_2: f64, a_3: f64) -> [DoubleDouble; 2] {
    [a_2, a_3].map(DoubleDouble::new)
}

#[test]
fn the_contact_lifetime_obeys_its_equation_and_friction_its_law() {
    for (path, Transition { law, v_i, v_f }) in paths() {
        let motion = &*path.motion;
        for pair in motion.landmarks().windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|s| motion.at(s));
            let lag = integral(motion, pair[0], pair[1], |moment| moment.theta * moment.v);
            let error = (to.theta - from.theta) - ((to.t - from.t) - lag);
            let size = from.theta.max(to.theta);
            assert!(error.abs() < 1e-9 * size, "{v_i} {v_f} {} {pair:?}: {error:.1e} of {size}", motion.duration());
            let friction = match motion.friction() {
                Friction::Log => 1.0 + law.a * to.v.ln() + law.b * to.theta.ln(),
                Friction::Regularised => law.a * (0.5 * to.v * ((1.0 + law.b * to.theta.ln()) / law.a).exp()).asinh(),
            };
            assert!(relative(to.friction, friction) < 1e-13, "{to:?}");
        }
        let (start, end) = (motion.at(0.0), motion.at(1.0));
        assert!(relative(start.theta, 1.0 / v_i) < 1e-12, "{start:?}");
        assert_eq!((start.t, end.t), (0.0, motion.duration()));
    }
}

/// `int tau v dt` along a motion, to 1e-11 of `size` in every interval: one that takes more is halved up to six times.
fn work_of(motion: &dyn Motion, size: f64) -> f64 {
    fn between(motion: &dyn Motion, [from, to]: [f64; 2], error: f64, splits: u32) -> f64 {
        let power = |moment: &Moment| moment.friction * moment.v;
        let halves = [[from, 0.5 * (from + to)], [0.5 * (from + to), to]];
        let work: f64 = halves.map(|[from, to]| integral(motion, from, to, power)).into_iter().sum();
        if splits == 0 || (work - integral(motion, from, to, power)).abs() <= error {
            return work;
        }
        halves.map(|half| between(motion, half, error, splits - 1)).into_iter().sum()
    }
    // A landmark with a jump belongs to the interval that ends there.
    let after = |[from, to]: [f64; 2]| [from + 1e-12 * (to - from), to];
    motion.landmarks().windows(2).map(|pair| between(motion, after([pair[0], pair[1]]), 1e-11 * size.abs(), 6)).sum()
}

/// A transition of the physical domain between velocities that may be equal, and its duration.
fn random_case(random: &mut Random) -> Case {
    let a = random.between(1e-3, 0.3);
    let b = [0.0, a, a * random.between(0.05, 20.0)][(3.0 * random.next()) as usize].min(0.5);
    let v_i = 1.0 + random.between(1e-3, 1e10);
    let v_f = [v_i, 1.0 + random.between(1e-3, 1e10)][(2.0 * random.next()) as usize];
    let t_f = (random.between(1e-3, 1e7) / v_i.max(v_f)).min(1e4);
    case(Transition { law: Law { a, b }, v_i, v_f }, t_f)
}

/// Optimal protocols for a case: each law, both forms of friction, with and without bounds.
fn random_protocols(random: &mut Random, case: &Case) -> [Protocol; 6] {
    let Transition { law, v_i, v_f } = case.transition;
    let fast = v_i.max(v_f);
    let steady = [v_i, v_f].map(|v| 1.0 + (law.a - law.b) * v.ln());
    let tau_ceiling = steady[0].max(steady[1]) + 3.0 * law.a * random.between(1e-7, 1.0);
    let v_ceiling = fast * (1.0 + random.between(1e-3, 1e3));
    let optimal = |floor| Protocol::Optimal { bounds: Bounds::new(floor) };
    let bounds = Bounds::new(random.next() < 0.8).with_tau_ceiling(tau_ceiling);
    let ceiling = [v_ceiling, f64::INFINITY][(2.0 * random.next()) as usize];
    [
        optimal(true),
        optimal(false),
        Protocol::Optimal { bounds: bounds.with_v_ceiling(ceiling) },
        Protocol::OptimalRegularised,
        Protocol::Relaxed { law: StateLaw::Slip, v_ceiling },
        Protocol::Relaxed { law: StateLaw::Prz, v_ceiling },
    ]
}

#[test]
fn random_optima_are_traced_with_their_work() {
    let (mut random, mut traced) = (Random(11), [0; 6]);
    for _ in 0..quick_or_long(25, 2_000) {
        let case = random_case(&mut random);
        let Case { transition, t_f, .. } = case;
        for (kind, protocol) in random_protocols(&mut random, &case).into_iter().enumerate() {
            let path = match protocol.path(&case, 1e-10) {
                Ok(path) if matches!(path.status, Status::Ok | Status::Unproven) => path,
                Ok(_) => continue,
                Err(absence) => {
                    assert!(!absence.is_defect(), "{kind} {case:?}: {absence}");
                    continue;
                }
            };
            let trace = Trace::of(&*path.motion, &transition, Times::Fewest);
            assert!(trace.is_some(), "{kind} {case:?}");
            let end = path.motion.at(1.0);
            assert!(relative(end.theta, 1.0 / transition.v_f) < 1e-11 && end.t == t_f, "{kind} {case:?} {end:?}");
            // Pulses stand for chattering, whose work is their limit.
            if path.parameters.iter().all(|parameter| parameter.name != "chatter_time") {
                let (motion, work) = (&*path.motion, path.work);
                let powers = motion.landmarks().into_iter().map(|s| motion.at(s)).map(|at| (at.friction * at.v).abs());
                // Times are doubles.
                let noise = f64::EPSILON * t_f * powers.fold(0.0, f64::max);
                let found = work_of(motion, work);
                assert!((found - work).abs() < 1e-9 * work.abs() + noise, "{kind} {case:?}: {found} {work}");
            }
            traced[kind] += 1;
        }
    }
    assert!(traced.iter().all(|&count| count > 5), "{traced:?}");
}

#[test]
fn work_along_the_motion_is_the_work_that_the_solver_states() {
    for (path, transition) in paths() {
        let (motion, work) = (&*path.motion, work_of(&*path.motion, path.work));
        assert!(relative(work, path.work) < 1e-9, "{transition:?} {}: {work} {}", motion.duration(), path.work);
    }
}

#[test]
fn optimal_protocols_arrive_and_keep_their_hamiltonian() {
    for (transition, t_f) in optima() {
        let (solved, motion) = optimal::motion(&transition, t_f, true, 1e-10);
        let (value, motion) = (solved.value.expect("exists"), motion.expect("exists"));
        let (start, end) = (motion.at(0.0), motion.at(1.0));
        assert!(relative(end.theta, 1.0 / transition.v_f) < 1e-13, "{end:?}");
        assert!(relative(start.v, value.v_start) < 1e-11 && relative(end.v, value.v_end) < 1e-11, "{value:?}");
        for i in 0..=1000 {
            let moment = motion.at(f64::from(i) / 1000.0);
            // H = tau v - beta theta', on the hold and on the arc.
            let terms =
                [moment.friction * moment.v, -moment.beta.expect("is an extremal") * (1.0 - moment.theta * moment.v)];
            let error = (terms[0] + terms[1] - value.hamiltonian).abs() / terms[0].abs().max(terms[1].abs());
            assert!(error < 1e-12, "{transition:?} {t_f} {i}: {error:.1e}");
        }
    }
}

#[test]
fn regularised_optima_keep_their_hamiltonian_and_end_in_steady_sliding() {
    for (protocol, case) in regularised() {
        let path = path(protocol, case);
        let hamiltonian = path.parameters[0].value;
        for i in 0..=1000 {
            let moment = path.motion.at(f64::from(i) / 1000.0);
            let terms =
                [moment.friction * moment.v, -moment.beta.expect("is an extremal") * (1.0 - moment.theta * moment.v)];
            let error = (terms[0] + terms[1] - hamiltonian).abs() / terms[0].abs().max(terms[1].abs());
            assert!(error < 1e-13, "{case:?} {i}: {error:.1e}");
        }
        let trace = fewest(&path, case.transition);
        let (first, last) = (trace.moments[0], trace.moments[trace.moments.len() - 1]);
        for (moment, v) in [(first, case.transition.v_i), (last, case.transition.v_f)] {
            let law = case.transition.law;
            let steady = law.a * (0.5 * v * ((1.0 - law.b * v.ln()) / law.a).exp()).asinh();
            assert!(relative(moment.v, v) < 1e-13 && relative(moment.friction, steady) < 1e-13, "{case:?} {moment:?}");
        }
    }
}

#[test]
fn the_costate_is_minus_the_derivative_of_the_work_by_the_contact_lifetime() {
    for (transition, t_f) in [(PAPER, 0.02), (PAPER, 0.049), (PAPER, 0.5), (BACK, 0.41), (BACK, 2.0)] {
        let step = 1e-4 * transition.v_i;
        let work = |steps: f64| {
            let moved = Transition { v_i: transition.v_i + steps * step, ..transition };
            optimal::solve(&moved, t_f, true, 1e-13).value.expect("exists").work
        };
        // Fourth-order difference; dtheta = -dv/v^2.
        let slope = (work(-2.0) - 8.0 * work(-1.0) + 8.0 * work(1.0) - work(2.0)) / (12.0 * step);
        let beta = optimum(transition, t_f).motion.at(0.0).beta.expect("is an extremal");
        let expected = transition.v_i * transition.v_i * slope;
        assert!(relative(beta, expected) < 1e-7, "{transition:?} {t_f}: {beta} {expected}");
    }
}

/// The paper's equations: `theta' = 1 - theta v`, `beta' = v (b/theta + beta)`, `v' = -(v/a) (b/theta + beta)`; and on
/// the hold the same without the last.
struct Paper(Law, bool);

impl System<f64, SVector<f64, 3>> for Paper {
    fn system(&self, _: f64, y: &SVector<f64, 3>, dy: &mut SVector<f64, 3>) {
        let Paper(Law { a, b }, held) = *self;
        let (theta, beta, v) = (y[0], y[1], y[2]);
        let pull = b / theta + beta;
        dy[0] = 1.0 - theta * v;
        dy[1] = v * pull;
        dy[2] = if held { 0.0 } else { -v / a * pull };
    }
}

#[test]
fn paper_equations_integrated_from_row_to_row_give_the_next_row() {
    for (transition, t_f) in optima() {
        let path = optimum(transition, t_f);
        let motion = &*path.motion;
        let held = motion.at(0.0).v == 1.0;
        // Where the hold ends: the last place where v = 1.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if held && motion.at(middle).v == 1.0 { low = middle } else { high = middle }
        }
        let leaving = if held { low } else { 0.0 };
        let mut places: Vec<f64> = motion.landmarks();
        places.push(leaving);
        places.sort_by(f64::total_cmp);
        places.dedup();
        for pair in places.windows(2) {
            for i in 0..4 {
                let [from, to] = [i, i + 1].map(|i| motion.at(pair[0] + (pair[1] - pair[0]) * f64::from(i) / 4.0));
                // t is a double: shorter steps are not known to ten digits.
                if to.t - from.t < 1e-5 * from.t {
                    continue;
                }
                let beta = |moment: &Moment| moment.beta.expect("is an extremal");
                let start = SVector::<f64, 3>::new(from.theta, beta(&from), from.v);
                let step = to.t - from.t;
                let mut integrator = Dop853::from_param(
                    Paper(transition.law, pair[1] <= leaving),
                    0.0,
                    step,
                    step,
                    start,
                    1e-13,
                    1e-300,
                    0.9,
                    0.0,
                    0.333,
                    6.0,
                    step,
                    0.0,
                    100_000,
                    1_000,
                    OutputType::Sparse,
                );
                integrator.integrate().expect("is smooth");
                let end = integrator.y_out().last().expect("has an end");
                for (found, expected) in [(to.theta, end[0]), (beta(&to), end[1]), (to.v, end[2])] {
                    assert!(
                        relative(found, expected) < 1e-9,
                        "{transition:?} {t_f} at {}: {found} {expected} {}",
                        to.t,
                        relative(found, expected)
                    );
                }
            }
        }
    }
}

fn columns(moment: &Moment) -> [f64; 4] {
    [moment.v, moment.theta, moment.friction, moment.beta.unwrap_or(f64::NAN)]
}

/// Ranges of the columns over a trace; NaN counts nowhere.
fn ranges(trace: &Trace) -> [f64; 4] {
    let mut ranges = [(f64::INFINITY, f64::NEG_INFINITY); 4];
    for moment in &trace.moments {
        for (value, (least, greatest)) in columns(moment).into_iter().zip(&mut ranges) {
            (*least, *greatest) = (least.min(value), greatest.max(value));
        }
    }
    ranges.map(|(least, greatest)| greatest - least)
}

/// The rows between the jumps.
fn inside(trace: &Trace) -> &[Moment] {
    let rows = &trace.moments;
    let jump = |pair: [usize; 2]| rows[pair[0]].t == rows[pair[1]].t;
    let first = usize::from(jump([0, 1]));
    let last = rows.len() - usize::from(jump([rows.len() - 2, rows.len() - 1]));
    &rows[first..last]
}

#[test]
fn straight_lines_between_rows_are_good_to_1e_4_of_the_range_everywhere() {
    for (path, transition) in paths() {
        let motion = &*path.motion;
        let trace = fewest(&path, transition);
        let (rows, ranges) = (inside(&trace), ranges(&trace));
        let mut row = 0;
        for pair in motion.landmarks().windows(2) {
            for i in 0..2000 {
                let here = motion.at(pair[0] + (pair[1] - pair[0]) * (f64::from(i) + 0.37) / 2000.0);
                while row + 2 < rows.len() && rows[row + 1].t < here.t {
                    row += 1;
                }
                let (from, to) = (&rows[row], &rows[row + 1]);
                let fraction = (here.t - from.t) / (to.t - from.t);
                let (start, end, value) = (columns(from), columns(to), columns(&here));
                for column in 0..4 {
                    let error = (start[column] + fraction * (end[column] - start[column]) - value[column]).abs();
                    assert!(
                        error.is_nan() || error <= RANGE_RTOL * ranges[column],
                        "{transition:?} {}: column {column} off by {:.2e} at {}",
                        motion.duration(),
                        error / ranges[column],
                        here.t
                    );
                }
            }
        }
    }
}

/// A straight line over a step `h` is off by `h^2 |f''|/8`, so it takes `int sqrt(|f''|/(8 tolerance)) dt` rows; second
/// differences of an equally spaced trace give that for the worst of the columns.
fn least_rows(path: &TracedPath, transition: Transition) -> f64 {
    let trace = fewest(path, transition);
    let tolerance = ranges(&trace).map(|range| RANGE_RTOL * range);
    let fine = Trace::of(&*path.motion, &transition, Times::Spaced(100_001)).expect("can be resolved");
    let bend = |three: &[Moment]| {
        let [before, here, after] = [0, 1, 2].map(|i| columns(&three[i]));
        (0..4).fold(0.0_f64, |most, i| most.max((before[i] - 2.0 * here[i] + after[i]).abs() / (8.0 * tolerance[i])))
    };
    inside(&fine).windows(3).map(|three| bend(three).sqrt()).sum()
}

#[test]
fn rows_are_few() {
    let step = Protocol::Family(shortcut::find("step").expect("exists"));
    let cubic = Protocol::Family(shortcut::find("cubic").expect("exists"));
    let best = BEST_CUBIC;
    let optimal = Protocol::Optimal { bounds: true.into() };
    let known = [
        (optimal, PAPER, 0.02, 117),
        (optimal, PAPER, 0.037, 134),
        (optimal, PAPER, 0.049, 140),
        (optimal, PAPER, 0.5, 162),
        (optimal, BACK, 0.41, 87),
        (optimal, BACK, 0.5, 109),
        (best, PAPER, 0.02, 117),
        (cubic, PAPER, 0.02, 173),
        (step, PAPER, 0.02, 53),
    ];
    for (protocol, transition, t_f, rows) in known {
        let path = path(protocol, case(transition, t_f));
        let found = fewest(&path, transition).moments.len();
        let least = least_rows(&path, transition);
        assert_eq!(found, rows, "{transition:?} {t_f}, least {least}");
        // Two rows more for the jumps.
        assert!((found as f64) < 1.1 * least + 3.0, "{transition:?} {t_f}: {found} of {least}");
    }
}

#[test]
fn a_constant_protocol_has_two_rows() {
    let still = Transition { v_f: 3.0, ..PAPER };
    let cubic = Protocol::Family(shortcut::find("cubic").expect("exists"));
    let path = path(cubic, case(still, 0.1));
    let trace = fewest(&path, still);
    let rows: Vec<(f64, f64)> = trace.moments.iter().map(|moment| (moment.t, moment.v)).collect();
    assert_eq!(rows, [(0.0, 3.0), (0.1, 3.0)]);
}

#[test]
fn jumps_are_two_rows_at_the_same_time() {
    let trace = fewest(&optimum(PAPER, 0.02), PAPER);
    let rows = &trace.moments;
    let (first, second, last) = (rows[0], rows[1], rows[rows.len() - 1]);
    let tau = |v: f64| 1.0 + (PAPER.law.a - PAPER.law.b) * v.ln();
    assert_eq!((first.t, first.v, first.beta), (0.0, 3.0, None));
    assert!(relative(first.friction, tau(3.0)) < 1e-15 && first.theta == second.theta);
    assert!((second.t, second.beta.is_some()) == (0.0, true) && relative(second.v, 19.9230) < 1e-5);
    assert_eq!((last.t, last.v, last.beta), (0.02, 100.0, None));
    assert!(relative(last.friction, tau(100.0)) < 1e-14);
    assert!(rows[rows.len() - 2].t == 0.02 && relative(rows[rows.len() - 2].v, 3392.17) < 1e-5);
    // The bounded velocity starts and ends without a jump: one row each.
    let family = Protocol::Family(shortcut::find("bounded_velocity").expect("exists"));
    let smooth = fewest(&path(family, case(PAPER, 0.02)), PAPER);
    assert!(smooth.moments[1].t > 0.0 && smooth.moments[smooth.moments.len() - 2].t < 0.02);
    assert_eq!(smooth.columns().len(), 4);
}

#[test]
fn equally_spaced_times_are_exact_and_meet_the_motion() {
    for (path, transition) in paths() {
        let motion = &*path.motion;
        let t_f = motion.duration();
        let spaced = Trace::of(motion, &transition, Times::Spaced(101)).expect("can be resolved");
        let rows = inside(&spaced);
        assert_eq!(rows.len(), 101);
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(row.t, t_f * (i as f64 / 100.0));
            // Where the motion is at that time, by bisection.
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if motion.at(middle).t < row.t { low = middle } else { high = middle }
            }
            let found = motion.at(high);
            if i > 0 && i < 100 {
                assert!(relative(row.theta, found.theta) < 1e-11, "{transition:?} {t_f} {i}: {row:?} {found:?}");
                assert!(relative(row.v, found.v) < 1e-9, "{transition:?} {t_f} {i}: {row:?} {found:?}");
            }
        }
    }
    let ends = Trace::of(&*optimum(PAPER, 0.02).motion, &PAPER, Times::Spaced(2)).expect("can be resolved");
    assert_eq!(ends.moments.iter().map(|row| row.t).collect::<Vec<_>>(), [0.0, 0.0, 0.02, 0.02]);
}

#[test]
fn extreme_protocols_have_rising_times_finite_numbers_and_few_rows() {
    let t_cross = 0.0374184120524;
    let mut cases = vec![(PAPER, 1e-9 * t_cross), (PAPER, 1e3), (BACK, 1e3), (BACK, 0.395415)];
    for (a, b) in [(0.03, 0.05), (0.03, 0.03), (0.05, 0.0), (1e-3, 2e-3), (1e-4, 0.0)] {
        for t_f in [1e-9, 1e-3, 1.0, 1e3] {
            cases.push((Transition { law: Law { a, b }, v_i: 3.0, v_f: 3e6 }, t_f));
            cases.push((Transition { law: Law { a, b }, v_i: 1.001, v_f: 1e6 }, t_f));
        }
        for t_f in [7.0, 1e3] {
            cases.push((Transition { law: Law { a, b }, v_i: 1e6, v_f: 1.001 }, t_f));
        }
    }
    for (transition, t_f) in cases {
        let trace = fewest(&optimum(transition, t_f), transition);
        let rows = &trace.moments;
        assert!(rows.len() < 400, "{transition:?} {t_f}: {} rows", rows.len());
        assert!(rows[0].t == 0.0 && rows[rows.len() - 1].t == t_f, "{transition:?} {t_f}");
        let inner = inside(&trace);
        assert!(inner.windows(2).all(|pair| pair[0].t < pair[1].t), "{transition:?} {t_f}");
        assert!(inner.iter().all(|row| columns(row).iter().all(|value| value.is_finite())), "{transition:?} {t_f}");
        assert!(inner.iter().all(|row| row.v >= 1.0 && row.theta > 0.0 && row.theta <= 1.0), "{transition:?} {t_f}");
    }
}

#[test]
fn extrema_of_the_velocity_are_those_of_the_solvers() {
    for (transition, t_f) in optima() {
        let trace = fewest(&optimum(transition, t_f), transition);
        let value = optimal::solve(&transition, t_f, true, 1e-12).value.expect("exists");
        assert!(
            relative(trace.v_min, value.v_start) < 1e-10 && relative(trace.v_max, value.v_end) < 1e-10,
            "{trace:?}"
        );
    }
    for (protocol, case) in shortcuts() {
        let Protocol::Family(family) = protocol else { continue };
        let shortcut = family.solve(&case, 1e-10, &mut SolverStats::default()).expect("exists");
        let trace = fewest(&path(protocol, case), case.transition);
        for (found, expected) in [(trace.v_min, shortcut.v_min), (trace.v_max, shortcut.v_max)] {
            assert!(relative(found, expected) < 1e-9, "{} {case:?}: {found} {expected}", family.name);
        }
    }
}

#[test]
fn what_does_not_exist_states_which_bound() {
    let absent = |protocol: Protocol, transition, t_f| match protocol.path(&case(transition, t_f), 1e-10) {
        Ok(_) => panic!("{transition:?} {t_f} exists"),
        Err(absence) => absence,
    };
    let optimal = |floor: bool| Protocol::Optimal { bounds: floor.into() };
    let Absence::Time { t_min, bounded: true, .. } = absent(optimal(true), BACK, 0.39) else { panic!("too short") };
    assert!(relative(t_min, 0.395414772254663) < 1e-14);
    let free = absent(optimal(false), BACK, 0.3);
    assert_eq!(free.to_string(), "t_f = 0.3 is too short for v > 0: the least is t_min = 0.3233333333333333");
    assert_eq!(absent(BEST_CUBIC, BACK, 0.3955), Absence::Cubic { bounded: true });
    let steep = Protocol::CubicPoint { law: StateLaw::Ageing, friction: Friction::Log, place: place(3.0, 0.0) };
    assert_eq!(absent(steep, PAPER, 0.02).to_string(), "v or theta would not stay positive");
    // Without the bound the optimum may leave the model, as its status reports.
    let below = path(optimal(false), case(PAPER, 0.06));
    assert_eq!(below.status, Status::BelowBound);
    assert!(fewest(&below, PAPER).v_min < 1.0);
}
