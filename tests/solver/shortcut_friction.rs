//! The family `bounded_friction` against a high-precision table, a library's ODE integrator and invariants.

use crate::reference;
use crate::support::relative;
use ode_solvers::dop_shared::OutputType;
use ode_solvers::{Dop853, SVector, System};
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::shortcut::{Case, Obstacle, Shortcut, find};
use slipsweep::protocol::{Motion, SolverStats, Status, error, optimal};

const PAPER: Law = Law { a: 0.03, b: 0.05 };

fn case(law: Law, v_i: f64, v_f: f64, t_f: f64, tau_ceiling: f64) -> Case {
    Case { transition: Transition { law, v_i, v_f }, t_f, tau_ceiling }
}

fn solve(case: &Case, rtol: f64) -> Result<Shortcut, Obstacle> {
    find("bounded_friction").expect("is a family").solve(case, rtol, &mut SolverStats::default())
}

fn motion(case: &Case) -> Box<dyn Motion> {
    find("bounded_friction").expect("is a family").motion(case, 1e-11).unwrap_or_else(|o| panic!("{case:?}: {o}"))
}

fn in_table(row: &reference::Row) -> Case {
    let law = Law { a: row.number("a"), b: row.number("b") };
    case(law, row.number("v_i"), row.number("v_f"), row.number("t_f"), row.number("tau_ceiling"))
}

/// What rounding makes of a number: that of the exponent `(tau - 1)/a`, which theta and v carry, that of `t_f` in the
/// time to spare, and the small rest that a great change of velocity leaves of theta.
fn rounding(case: &Case, row: &reference::Row) -> f64 {
    let Transition { law: Law { a, b }, v_i, v_f } = case.transition;
    let exponent = 64.0 * f64::EPSILON * (1.0 + (case.tau_ceiling.abs() + b) / a);
    let rest = f64::EPSILON * v_i / v_f + if (v_f / v_i).ln().abs() > 8.0 { 2e-11 } else { 0.0 };
    exponent + lost_in_time(case, row) + rest
}

/// What rounding of `t_f` makes of the time to spare.
fn lost_in_time(case: &Case, row: &reference::Row) -> f64 {
    4.0 * f64::EPSILON * case.t_f / (case.t_f - row.number("t_least"))
}

#[test]
fn reference_every_number_is_good_to_rtol() {
    let rows = reference::table("shortcut_friction");
    assert!(rows.len() >= 40, "{} rows", rows.len());
    let mut faults = Vec::new();
    for rtol in [1e-6, 1e-10, 1e-12] {
        for row in &rows {
            let case = in_table(row);
            if row.text("status") == "infeasible" {
                assert_eq!(solve(&case, rtol).map_err(|o| o.status()), Err(Status::Infeasible), "{row:?}");
                continue;
            }
            let shortcut = match solve(&case, rtol) {
                Ok(shortcut) => shortcut,
                // The time cannot determine it to the requested accuracy.
                Err(Obstacle::NotConverged) if lost_in_time(&case, row) > 100.0 * rtol => continue,
                Err(obstacle) => {
                    faults.push(format!("{rtol} {obstacle:?} in {row:?}"));
                    continue;
                }
            };
            for (name, found) in [
                ("alpha", shortcut.alpha.unwrap_or(f64::NAN)),
                ("work", shortcut.work),
                ("v_min", shortcut.v_min),
                ("v_max", shortcut.v_max),
                ("friction_max", shortcut.friction_max),
            ] {
                let error = relative(found, row.number(name));
                // A velocity of near nothing carries the rounding of its exponent.
                let exponent = if name == "v_min" { 1.0 + row.number(name).max(1e-308).ln().abs() } else { 1.0 };
                let budget = (rtol + rounding(&case, row)) * exponent;
                if error.is_nan() || error > budget {
                    faults.push(format!("{name} at {rtol}: {found} off by {error:.1e} > {budget:.1e} in {row:?}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// From fast to slow: the member may stand still in between, and steady sliding before that may last for thousands of
/// contact lifetimes.
#[test]
fn reference_every_number_of_a_slowing_block_is_good_to_rtol_and_its_error_is_bounded() {
    let family = find("bounded_friction").expect("is a family");
    let rows = reference::table("shortcut_friction_slowing");
    assert!(rows.len() >= 20, "{} rows", rows.len());
    for row in &rows {
        let case = in_table(row);
        let status = if row.text("status") == "ok" { Status::Ok } else { Status::BelowBound };
        for rtol in [1e-6, 1e-8, 1e-10, 1e-12] {
            let shortcut = solve(&case, rtol).unwrap_or_else(|o| panic!("{o} at {rtol} in {row:?}"));
            assert_eq!(shortcut.status(), status.with_friction(shortcut.friction_min), "{row:?}");
            let work = row.number("work");
            let bound = error::of_member(family, &case, &shortcut, &mut SolverStats::default()).expect("has a bound");
            assert!((shortcut.work - work).abs() <= bound, "{rtol}: off by {:e} > {bound:e}", shortcut.work - work);
            let budget = rtol.max(1e-10) + lost_in_time(&case, row);
            let mut numbers = vec![
                ("alpha", shortcut.alpha.unwrap_or(f64::NAN), row.number("alpha"), 1.0),
                ("work", shortcut.work, work, 1.0),
                // A velocity of near nothing carries the rounding of its exponent.
                ("v_min", shortcut.v_min, row.number("v_min"), 1.0 + row.number("v_min").max(1e-308).ln().abs()),
                ("v_max", shortcut.v_max, row.number("v_max"), 1.0),
                ("friction_max", shortcut.friction_max, row.number("friction_max"), 1.0),
            ];
            if let Some(least) = row.optional("work_optimal") {
                let optimum = optimal::solve(&case.transition, case.t_f, row.number("bounded") == 1.0, rtol);
                let found = optimum.value.expect("has an optimum").work;
                // The gap is good to rtol of 1 + gap.
                numbers.push(("1 + gap", shortcut.work / found, work / least, 2.0));
            }
            for (name, found, exact, terms) in numbers {
                let error = relative(found, exact);
                assert!(error <= budget * terms, "{name} at {rtol}: {found} off by {error:.1e} in {row:?}");
            }
        }
    }
}

/// `ln theta`, work and `x`, along the formula for tau; without a ceiling that is a parabola in time.
#[derive(Clone, Copy)]
struct Sliding {
    case: Case,
    alpha: f64,
    sign: f64,
}

impl Sliding {
    fn friction(&self, x: f64) -> f64 {
        let Transition { law, v_i, v_f } = self.case.transition;
        let steady = |v: f64| 1.0 + (law.a - law.b) * v.ln();
        let (ceiling, bend) = (self.case.tau_ceiling, self.alpha * x * (1.0 - x));
        if ceiling.is_infinite() {
            return steady(v_i) + (steady(v_f) - steady(v_i)) * x + bend;
        }
        let (gap_i, gap_f) = (ceiling - steady(v_i), ceiling - steady(v_f));
        ceiling - gap_i * (x * (gap_f / gap_i).ln() + bend).exp()
    }
}

impl System<f64, SVector<f64, 3>> for Sliding {
    fn system(&self, _: f64, y: &SVector<f64, 3>, dy: &mut SVector<f64, 3>) {
        let law = self.case.transition.law;
        let tau = self.friction(y[2]);
        let v = ((tau - 1.0 - law.b * y[0]) / law.a).exp();
        dy[0] = self.sign * self.case.t_f * ((-y[0]).exp() - v);
        dy[1] = self.case.t_f * tau * v;
        dy[2] = self.sign;
    }
}

/// Distance in `ln theta` from the target, and the work, by an integrator of a library, in the direction in which theta contracts.
fn slide(case: Case, alpha: f64) -> (f64, f64) {
    let Transition { law, v_i, v_f } = case.transition;
    let forward = law.b <= law.a;
    let (first, last) = if forward { (v_i, v_f) } else { (v_f, v_i) };
    let (x, sign) = if forward { (0.0, 1.0) } else { (1.0, -1.0) };
    let start = SVector::<f64, 3>::new(-f64::ln(first), 0.0, x);
    let mut stepper = Dop853::from_param(
        Sliding { case, alpha, sign },
        0.0,
        1.0,
        1.0,
        start,
        1e-13,
        1e-14,
        0.9,
        0.0,
        0.333,
        6.0,
        1.0,
        0.0,
        1_000_000,
        u32::MAX,
        OutputType::Sparse,
    );
    stepper.integrate().expect("integrates");
    let end = stepper.y_out().last().expect("has an end");
    (end[0] + last.ln(), end[1])
}

const LAWS_AND_CHANGES: [(Law, f64, f64, f64, f64); 4] = [
    (PAPER, 3.0, 100.0, 0.05, 1.6),
    (PAPER, 50.0, 4.0, 1.0, 2.0),
    (Law { a: 0.05, b: 0.03 }, 3.0, 100.0, 0.05, 1.6),
    (Law { a: 0.05, b: 0.05 }, 3.0, 10.0, 0.5, 1.6),
];

#[test]
fn a_librarys_integrator_arrives_with_the_same_work() {
    for (law, v_i, v_f, t_f, tau_ceiling) in LAWS_AND_CHANGES {
        let case = case(law, v_i, v_f, t_f, tau_ceiling);
        let shortcut = solve(&case, 1e-11).unwrap_or_else(|o| panic!("{case:?}: {o}"));
        let (missed, work) = slide(case, shortcut.alpha.expect("has a parameter"));
        assert!(missed.abs() < 1e-10, "{case:?}: {missed}");
        assert!(relative(shortcut.work, work) < 1e-10, "{case:?}: {} {work}", shortcut.work);
    }
}

/// Without a ceiling friction is a parabola in time, whose bend is found here by regula falsi. The bound of the work's error was infinite.
#[test]
fn regress_without_a_ceiling_the_work_is_that_of_a_parabola_and_its_error_is_bounded() {
    let family = find("bounded_friction").expect("is a family");
    let brackets = [(0.2, 0.5), (-0.2, -0.05), (0.2, 0.5), (0.05, 0.13)];
    for ((law, v_i, v_f, t_f, _), bracket) in LAWS_AND_CHANGES.into_iter().zip(brackets) {
        let case = case(law, v_i, v_f, t_f, f64::INFINITY);
        let shortcut = solve(&case, 1e-10).unwrap_or_else(|o| panic!("{case:?}: {o}"));
        assert_eq!(shortcut.alpha, Some(0.0));
        let [mut low, mut high] = [bracket.0, bracket.1].map(|bend| (bend, slide(case, bend).0));
        assert!(low.1 * high.1 < 0.0, "{case:?}: {low:?} {high:?}");
        let mut bend = 0.0;
        for _ in 0..200 {
            bend = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let missed = slide(case, bend).0;
            if missed.abs() < 1e-13 {
                break;
            }
            // The Illinois method: an end that stays counts half.
            if missed * high.1 < 0.0 {
                low = high
            } else {
                low.1 *= 0.5
            }
            high = (bend, missed);
        }
        let work = slide(case, bend).1;
        assert!(relative(shortcut.work, work) < 2e-11, "{case:?}: {} {work}", shortcut.work);
        let sliding = Sliding { case, alpha: bend, sign: 1.0 };
        let highest = (0..=1000).map(|k| sliding.friction(f64::from(k) / 1000.0)).fold(f64::NEG_INFINITY, f64::max);
        assert!(relative(shortcut.friction_max, highest) < 1e-6, "{case:?}: {} {highest}", shortcut.friction_max);
        let bound = error::of_member(family, &case, &shortcut, &mut SolverStats::default()).expect("has a bound");
        let error = (shortcut.work - work).abs();
        assert!(bound < 1e-10 * shortcut.work && error <= bound + 1e-11 * work, "{case:?}: {error:e} {bound:e}");
    }
}

#[test]
fn equal_ends_give_steady_sliding() {
    for (v, tau_ceiling) in [(3.0, 1.5), (1e8, 100.0), (1.001, 1.0 + 1e-4)] {
        let shortcut = solve(&case(PAPER, v, v, 2.0 / v, tau_ceiling), 1e-10).expect("has a member");
        assert_eq!(shortcut.alpha, Some(0.0));
        let friction = 1.0 - 0.02 * f64::ln(v);
        assert!(relative(shortcut.work, friction * 2.0) < 1e-12, "{shortcut:?}");
        assert!(relative(shortcut.v_min, v) < 1e-12 && relative(shortcut.v_max, v) < 1e-12, "{shortcut:?}");
    }
}

#[test]
fn what_has_no_member_states_why() {
    let law = Law { a: 0.05, b: 0.03 };
    let ends = solve(&case(law, 3.0, 100.0, 0.1, 1.05), 1e-10).expect_err("is below tau_f");
    assert!(
        matches!(ends, Obstacle::FrictionAtEnds { friction } if relative(friction, 1.0 + 0.02 * 100f64.ln()) < 1e-14)
    );
    assert_eq!(solve(&case(law, 3.0, 100.0, 1e-4, 1.1), 1e-10), Err(Obstacle::Friction));
    assert_eq!(solve(&case(PAPER, 100.0, 3.0, 0.1, 1.6), 1e-10), Err(Obstacle::Velocity));
    for bad in [
        case(Law { a: 0.0, b: 0.1 }, 3.0, 9.0, 1.0, 2.0),
        case(PAPER, 0.5, 9.0, 1.0, 2.0),
        case(PAPER, 3.0, 9.0, 0.0, 2.0),
        case(PAPER, 3.0, 9.0, 1.0, f64::NAN),
    ] {
        assert_eq!(solve(&bad, 1e-10), Err(Obstacle::Domain), "{bad:?}");
    }
}

#[test]
fn motion_starts_and_ends_at_steady_sliding() {
    for law in [PAPER, Law { a: 0.05, b: 0.03 }] {
        let case = case(law, 3.0, 100.0, 0.05, 1.6);
        let motion = motion(&case);
        for (s, v, t) in [(0.0, 3.0, 0.0), (1.0, 100.0, 0.05)] {
            let moment = motion.at(s);
            assert!(relative(moment.v, v) < 1e-8 && relative(moment.theta, 1.0 / v) < 1e-9, "{moment:?}");
            assert!((moment.t - t).abs() < 1e-17, "{moment:?}");
        }
        for k in 0..=100 {
            let moment = motion.at(k as f64 / 100.0);
            let friction = 1.0 + law.a * moment.v.ln() + law.b * moment.theta.ln();
            assert!(relative(moment.friction, friction) < 1e-12, "{moment:?}");
            assert!(moment.friction < 1.6, "{moment:?}");
        }
        let marks = motion.landmarks();
        assert!(marks.first() == Some(&0.0) && marks.last() == Some(&1.0) && marks.is_sorted());
    }
}

/// Points of the whole legal domain that were not converged, or had wrong digits: `a`, `b`, `v_i`, `v_f`, `t_f`,
/// `tau_ceiling`. Steady sliding that is followed for up to 1e22 contact lifetimes, a bound near the friction of an end, a
/// small change of velocity, `b` near `a`, `b/a` of 1e5, velocities of 1e12.
#[rustfmt::skip]
const WHOLE_DOMAIN: &[(f64, f64, f64, f64, f64, f64)] = &[
    (0.0002643118732845748, 0.001140772466982514, 819523465.4015598, 1.0000000006872276, 21.098355570687147, 1.0000001251304178),
    (2.5736898926613416e-05, 2.5736898911962277e-05, 1.0000000000000848, 856599933.9279665, 3.3296809415301965e+18, 1.0000000000003035),
    (0.0010716359087989686, 0.0, 419.1035354632836, 100924817666.28091, 1.1211593978278644e-17, 91672.9016633806),
    (1.0956950438011273e-05, 0.004608825146213324, 222.2537726812475, 6489758706.243728, 5.3633990535266594e-14, 1429420889589.0454),
    (0.00014462445741626837, 0.00014462445739441346, 5.76193054601147, 5.761930546631457, 6.603360470307441e-07, 1.0000000088069954),
    (3.170480005544722e-06, 1.1320173229164732e-06, 1.0000000000000298, 15102.311750969708, 159.27074535820856, 1.0000196311529737),
    (0.030871451064306485, 0.030871451064306485, 1.0000018112714435, 1.0000434535038407, 883.9286593995046, 1.0000000303237973),
    (1.4966628790772265e-06, 0.12763976184261586, 1.0000275827089808, 559900771689.3647, 2.9889230560871255e-06, 40677.78675229332),
    (6.655820388095209e-05, 6.656015408100906e-05, 64855456554.223976, 1.000000000001842, 133696756686.15253, 2255.5855572706682),
    (0.008241646562715886, 0.008241646562715886, 140.74349777544384, 140.71452678575315, 0.0009990684787014436, 1.000000000000222),
    (0.005017169203715716, 0.0012888350552985432, 1543.6370757233274, 1543.637075723312, 9.568205852478583e-12, 1.02737304650353),
    (9.313357790263526e-06, 2.4311136330112077e-05, 5738896.458591967, 1.0000000000071032, 25.67047458193115, 1.000003020362366),
    (0.2007693937761701, 0.0002768396574305859, 2.7446172196442706, 3146005.5686108144, 36465159.22342368, 1.3179321018504634e+19),
    (0.000303382636291962, 9.554425250460217e-06, 73406573.74913915, 1.000000000000884, 125955164109907.28, 1.0053216767109023),
    (0.701536931503323, 1.2102197734384044, 1.000000000000012, 1.0000000000075513, 16598131.96175698, 1.0000000003321048),
    (0.0002471955645749998, 0.001499967297004088, 1.0000005780002392, 1.000000000000042, 0.0017911719244838122, 1.0000000052701123),
    (2.1978036898233575e-05, 0.06976147479786257, 673842773.6947727, 673842773.6947618, 9.692886948025483e-12, f64::INFINITY),
    (4.086816093804187e-05, 1.1262763893158727, 1020.9957052840892, 1.0000000000012144, 27.435822409761364, 74.92265677650262),
    (0.0008983741201644856, 0.006100417478807731, 3457291473.207694, 3458086038.6032352, 1.3051043418818087e-07, 0.8857436366073692),
    (0.0006310405344707148, 0.000631040536365258, 1.000000000000035, 1.000000000096822, 0.003996774413177426, 1.0000000003563652),
    (0.5187979978056795, 0.5187989294263624, 1.0233992252494999, 1.0000000000003213, 24.988277692590433, 1.000000000000222),
    (0.038606101733102006, 0.0, 620.3969696823267, 17.19404372902645, 2.328819747946176e+17, 1.2482522073680022),
    (3.485733859292249e-05, 0.4442812984358615, 1.0000000000494558, 1594786.929419872, 52.45698838150952, 0.9999999999780295),
    (0.7736861724646084, 0.012659025979440259, 1.0005776682313399, 1061060.268879614, 0.6446693560600942, 11.55908369504056),
    (0.3970602100346146, 0.3970602100346146, 1.0000008681021546, 10857208615.220617, 0.6514972041969654, 176934738.63541722),
    (2.0403330813888104e-06, 0.0003884745851069101, 58649668929.6069, 1.4873380581774882, 0.6723424194581948, 0.9998466148523295),
    (3.892378011955254e-06, 0.11702327363610415, 1.0000000000000044, 856469.7334704275, 0.007057857791662251, 1.0000000210939666),
    (0.00018527715898745514, 0.00018527715898745514, 501886184.39879453, 4.279067100596075, 1.4509172842641234e+19, 104556535016955.16),
    (8.040577648071077e-06, 2.5766851713060695e-07, 1.0000000000280056, 1.000000022363017, 37565.71721030831, 1.000000000000174),
    (1.0332029833208288e-05, 0.07722807280187909, 8.615165459357723, 4111582556.8370504, 156895468502377.06, 7974.210498505151),
    (1.4188307204088794e-05, 0.0, 230.72770785478048, 1.0000002554029999, 1163902595707587.0, 1.0157977172707515),
    (1.971206987001438e-06, 1.53663608521815, 718524.9703601167, 2224984.753231725, 3.059013891535796e-09, -19.673797145962443),
    (0.1154648374227729, 0.2156173164849257, 1.4304525990939783, 1.430452847663703, 0.06377659401518636, 0.9650634137236686),
    (0.16114796608480916, 0.13666217333344627, 1.0000003899662768, 107287073586.92545, 4.078422624988316e-19, 318.61382596840957),
    (3.77431452617129e-05, 0.13869070911454068, 1.000000000000998, 1.0000000000000002, 0.059101170720825935, 1.0000059740483007),
    (0.00014372864358557855, 0.00014372864358557855, 1.0000000000000682, 24384750326.083923, 1.9926351643039206e-05, 1.717930240511635),
];

/// Points of the whole legal domain that were not converged, or had wrong digits, most of them for the sake of the
/// standstill in a deceleration over many decades: theta comes to it from one end alike for every `alpha_3`, or with
/// digits lost; steady sliding is left only just; friction is low enough for a standstill on one side of the middle
/// alone. Others are accelerations with a bound near the friction of an end, or with `b/a` of 1e4.
#[rustfmt::skip]
const STANDSTILLS: &[(f64, f64, f64, f64, f64, f64)] = &[
    (0.00010302577752102117, 0.021530280115075306, 805868141.2491411, 4.892666289791259, 0.22864306281460942, 0.9659791467391248),
    (0.07920989379540053, 0.06063257461712911, 489969864857.1321, 1.2460994270122128, 1.6286505698672598, 1.5000570273936005),
    (6.256237018857053e-06, 6.989519599061535, 10661300799.443342, 1.0000000000104299, 25.28634643054882, 19341969.703050442),
    (9.55779108801704e-05, 4.453540035956496, 109747002623.63274, 5.2155453905030145, 0.21286468824020421, f64::INFINITY),
    (2.576405168830251e-06, 0.0018175065543367282, 324129120.57445776, 3.706728971889441, 0.26977965850450425, 1.3671967328735815),
    (0.08932240720299241, 0.008055010141534766, 291165805864.0075, 1.1449428779357171, 2.071507381165641, 3.145228379110933),
    (0.17190218395442425, 5.492752148707617, 4502083286.721833, 1.228183076398781, 1.6831429089779184, -0.09362562048796574),
    (0.08770732405004564, 0.6989302957033948, 421467238536.0225, 1.000000732208309, 1.0001979063442308, 225091.045618457),
    (1.7072175347703566e-05, 0.3922916476565621, 47849723.43562624, 1.00031387110158, 0.9996862645534776, 3426139925248.304),
    (0.0226271477550868, 0.0, 1349266130.0439773, 1.246934650860744, 1.619319808273299, 1.4756866053870192),
    (0.055654027580651806, 8.503714155663861, 1112275754.6421218, 7.601044010260089, 0.14290112361397633, -16.13507677856873),
    (5.264257194070609e-06, 2.71159274432495, 19895.164519028123, 1.0049769867108824, 5.3078450269360005, 0.9865379379625121),
    (0.8169050970803056, 0.001250234925256382, 1.0000082491202664, 104.66303588103361, 0.6522608167674298, 4.793403593750186),
    (5.648953682282024e-06, 0.9902795772126962, 365.84025408819156, 1.6376311338879754, 0.9405089138368813, 1563.9537026565306),
    (1.0039263760658278e-06, 0.12220971237233717, 27953713.716496915, 573559.6601972054, 1.7078296755534278e-06, 1431205655.9233828),
    (2.332449473229101e-05, 1.7383406071725584, 398243889784.422, 1.000000025069659, 17.501607551236717, 652550972767686.0),
    (0.00021872394870492884, 0.3017542788182288, 834478.954188882, 1.58081701385816, 1.0073183447395662, 0.861917646759181),
    (8.899315642401371e-05, 2.1721487716696797, 1.0000000000206521, 107462381.22357585, 2.9671140473548963e-08, 257336947848.1579),
    (9.529892792693937, 4.658971799866731, 28415515.767066225, 6.624836785692362, 0.2329062361996287, 84.59931525379214),
    (5.938207414689674e-06, 0.16001918783562144, 70879655.96358085, 4.712999680704801, 0.2384844838168326, 0.7519961674507287),
    (1.5502427345571141e-6, 0.5445743065831894, 4474447671.865851, 971133166.7539362, 8.079374570660832e-10, 5446629926.069793),
    (5.534197383053905e-6, 6.611110694825728, 277973.1354571624, 9557.49549032812, 0.000101088695484269, f64::INFINITY),
];

/// Points of the whole legal domain that were `not_converged` at 1e-12 alone: `alpha_3` is near `-ln R`, so that steady
/// sliding at the start is left only just, and `b/a` of 1e6 magnifies the rounding of the friction that is left of both.
#[rustfmt::skip]
const LEFT_ONLY_JUST: &[(f64, f64, f64, f64, f64, f64)] = &[
    (2.946846505263005e-6, 4.161123553335814, 46908246640.89516, 1.000000000004479, 26.13160260590015, 1.0000000000273217),
    (1.372473872407973e-6, 1.348811217683763, 3630371611.826745, 1.0000000000092228, 25.40933761858282, 0.9999999999875603),
];

/// Points with the accuracy at which works or velocities were off by more than that: changes of velocity within a layer too
/// thin to change theta; a protocol of no velocity at all in the place of an acceleration.
#[rustfmt::skip]
const OFF_AT_ONE_ACCURACY: &[([f64; 6], f64)] = &[
    ([1.1180227087666295e-5, 2.25683691049984, 1.000001161955397, 30.744548440737248, 697752.5196888542, 40553.360235469154], 1e-9),
    ([1.1180227087666295e-5, 2.25683691049984, 1.000001161955397, 30.744548440737248, 697752.5196888542, 40553.360235469154], 1.1212059240887716e-11),
    ([2.500657931511109e-6, 6.686515605788409, 88070.9685524763, 1.0000144815980871, 11.14263493891144, 1.0058344272204451], 9.285634700577529e-11),
    ([0.4867812489120679, 0.39073539054655687, 2.4182984472397457, 42928643072.775505, 0.0871398077931722, 3.3514720320605376], 3.3728616869066194e-10),
    ([0.383871713803012, 0.28588415751237367, 1.0000000000004179, 17337165312.864532, 0.21934224372281394, 5.177720461883859], 1.0073459987466845e-12),
];

#[test]
fn regress_steady_sliding_that_is_left_only_just_is_solved_at_every_accuracy() {
    solved_alike_at_every_accuracy(LEFT_ONLY_JUST);
}

#[test]
fn regress_extremes_of_the_velocity_are_good_to_rtol_where_theta_does_not_show_them() {
    for &([a, b, v_i, v_f, t_f, tau_ceiling], rtol) in OFF_AT_ONE_ACCURACY {
        let case = case(Law { a, b }, v_i, v_f, t_f, tau_ceiling);
        let [rough, fine] = [rtol, 1e-13].map(|rtol| solve(&case, rtol).unwrap_or_else(|o| panic!("{case:?}: {o}")));
        let logarithms = fine.v_max.ln() + v_i.max(v_f).ln();
        let allowed = (2.0 * rtol + 2e-13) * (1.0 + (a + b) * logarithms);
        assert!(relative(rough.work, fine.work) <= allowed, "{rtol}: {rough:?} {fine:?} in {case:?}");
        // A velocity carries the rounding of `ln theta` `b/a` times.
        let allowed = allowed + 2.0 * f64::EPSILON * b / a * logarithms;
        assert!(relative(rough.v_min, fine.v_min) <= allowed, "{rtol}: {rough:?} {fine:?} in {case:?}");
        assert!(relative(rough.v_max, fine.v_max) <= allowed, "{rtol}: {rough:?} {fine:?} in {case:?}");
    }
}

/// `b` near `a`: forwards errors grow, which the rough search need not show; the other way they do not.
#[test]
fn regress_the_way_with_less_rounding_is_taken() {
    let (a, b) = (0.01108753783806471, 0.010272328997133002);
    let (v_i, v_f, t_f, tau_ceiling) =
        (1.0000000002120268, 201167632.34941387, 0.010545479120931709, 7246699126003.738);
    // With v_0 eight times less, as for the optimum.
    let s = 1.0 + (b - a) * 8f64.ln();
    let scaled = case(Law { a: a / s, b: b / s }, 8.0 * v_i, 8.0 * v_f, 0.125 * t_f, tau_ceiling / s);
    let case = case(Law { a, b }, v_i, v_f, t_f, tau_ceiling);
    let [found, scaled] = [&case, &scaled].map(|case| solve(case, 1e-12).unwrap_or_else(|o| panic!("{case:?}: {o}")));
    assert!(relative(s * scaled.work, found.work) <= 4e-12, "{found:?} {scaled:?}");
}

#[test]
fn regress_standstills_between_both_ends_are_solved_alike_at_every_accuracy() {
    solved_alike_at_every_accuracy(STANDSTILLS);
}

#[test]
fn regress_points_of_the_whole_domain_are_solved_alike_at_every_accuracy() {
    solved_alike_at_every_accuracy(WHOLE_DOMAIN);
}

/// These points lie outside the physical domain, where a member need not be found; a member that is found is right.
fn solved_alike_at_every_accuracy(points: &[(f64, f64, f64, f64, f64, f64)]) {
    let mut compared = 0;
    for &(a, b, v_i, v_f, t_f, tau_ceiling) in points {
        let case = case(Law { a, b }, v_i, v_f, t_f, tau_ceiling);
        let found = |rtol: f64| match solve(&case, rtol) {
            Err(Obstacle::NotConverged) => None,
            found => Some(found.unwrap_or_else(|o| panic!("{case:?} at {rtol}: {o}"))),
        };
        let Some(fine) = found(1e-12) else { continue };
        // The rounding of the time may be spent at the greatest velocity.
        let slip = f64::EPSILON * t_f * fine.v_max * fine.friction_max.abs() / fine.work.abs();
        // Friction is a sum of terms of this size.
        let terms = 1.0 + (a + b) * (fine.v_max.ln() + v_i.max(v_f).ln());
        for rtol in [1e-4, 1e-7, 1e-11] {
            let Some(rough) = found(rtol) else { continue };
            compared += 1;
            let allowed = 2.0 * rtol * terms + 8.0 * slip;
            assert!(relative(rough.work, fine.work) <= allowed, "{rtol}: {rough:?} {fine:?} in {case:?}");
            // A velocity carries the rounding of `ln theta` `b/a` times.
            let allowed = allowed + 5e-12 * (1.0 + b / a);
            assert!(relative(rough.v_max, fine.v_max) <= allowed, "{rtol}: {rough:?} {fine:?} in {case:?}");
        }
    }
    assert!(3 * compared > 8 * points.len(), "{compared} of {}", 3 * points.len());
}

/// A fast block that slides steadily for 18 % of the time and then stands still: `alpha_3` that made slips add up to the
/// time to spare was off by 2e-10 at every accuracy, and `work` by up to 1.4 rtol.
#[test]
fn regress_slips_known_to_the_rounding_of_the_time_to_spare_are_not_the_last_word() {
    let law = Law { a: 0.0791568165593238, b: 0.17585334461193852 };
    let transition = Transition { law, v_i: 12580.311800324214, v_f: 3.002349387942489 };
    let family = slipsweep::protocol::shortcut::find("bounded_friction").expect("is a family");
    for tau_ceiling in [1.5, 3.0] {
        let case = Case { transition, t_f: 0.4055424603833174, tau_ceiling };
        let work = |rtol| family.solve(&case, rtol, &mut SolverStats::default()).expect("has a member").work;
        let fine = work(1e-13);
        for rtol in [1e-8, 1e-10, 1e-12] {
            let error = (work(rtol) / fine - 1.0).abs();
            assert!(error <= rtol, "tau_ceiling {tau_ceiling}, rtol {rtol}: {error:e}");
        }
    }
}

/// At a loose tolerance no search found this deceleration.
#[test]
fn regress_a_long_deceleration_is_solved_at_a_loose_tolerance() {
    let law = Law { a: 0.013110174481221705, b: 0.0028126792925256263 };
    let case = case(law, 392545106.0018382, 160.44390292355547, 0.008992591807774248, 1.2039566420114345);
    let exact = solve(&case, 1e-10).expect("is solved");
    for rtol in [1e-2, 1e-3, 1e-4] {
        let found = solve(&case, rtol).expect("is solved");
        assert!(
            relative(found.work, exact.work) < rtol && relative(found.v_max, exact.v_max) < rtol,
            "{rtol}: {found:?}"
        );
    }
}

/// Blocks that nearly stop: at a tighter accuracy one residual is rounding, and another is well-conditioned. By Taylor series of 140 bits.
#[test]
fn regress_a_tighter_accuracy_is_no_worse_where_a_block_nearly_stops() {
    for (a, b, v_i, v_f, t_f, tau_ceiling, work) in [
        (
            0.016823764435690804,
            0.2466214434299296,
            178548.67564548462,
            19.101189131049615,
            0.06266619931652229,
            0.32882717974327824,
            -594.5720902953263,
        ),
        (
            0.014260080208009498,
            0.2727757766518028,
            7622719.808597807,
            2.211457727570559,
            0.6019137951007844,
            0.7948410601324355,
            -1.52781054125573,
        ),
    ] {
        let case = case(Law { a, b }, v_i, v_f, t_f, tau_ceiling);
        for rtol in [1e-10, 1e-11, 1e-12, 1e-13] {
            let found = solve(&case, rtol).expect("exists");
            assert!(relative(found.work, work) < 2e-13, "{rtol}: {found:?}");
        }
    }
}

/// A long slide close to steady states: the time lost hardly depends on `alpha_3`, theta at the end does. By collocation with 80 bits.
#[test]
fn regress_a_sum_that_hardly_depends_on_alpha_does_not_determine_it() {
    let law = Law { a: 0.0020042931191504576, b: 0.0014182778377131453 };
    let case = case(law, 42.77668643753129, 1793170878.289351, 0.0006472650162062959, 1.036450087797746);
    for rtol in [1e-6, 1e-10, 1e-12, 1e-13] {
        let found = solve(&case, rtol).expect("exists");
        let alpha = found.alpha.expect("has one");
        assert!(relative(alpha, -0.3571192837457) < 1e-9, "{rtol}: {found:?}");
        assert!(relative(found.work, 121883.917766) < 1e-10, "{rtol}: {found:?}");
    }
}
