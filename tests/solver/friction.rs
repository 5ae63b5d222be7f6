//! Negative friction: the status of every protocol agrees with friction sampled along its path.

use slipsweep::model::{Law, Transition};
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};
use slipsweep::protocol::shortcut::{Case, FAMILIES};
use slipsweep::protocol::{Motion, SolverStats, SpringBlock, Status, best_cubic, compliant, optimal, regularised};

use super::stress::random::Random;

/// Friction closer to 0 than this may round to either side of it.
const UNSURE: f64 = 1e-9;

/// The least friction along a motion, at 200 places between each two landmarks.
fn sampled(motion: &dyn Motion) -> f64 {
    let landmarks = motion.landmarks();
    let places =
        landmarks.windows(2).flat_map(|pair| (0..=200).map(|k| pair[0] + (pair[1] - pair[0]) * f64::from(k) / 200.0));
    places.map(|s| motion.at(s).friction).fold(f64::INFINITY, f64::min)
}

/// How a status compares with the least friction of its path, which sampling may miss by a little.
fn compare(status: Status, least: f64, what: &dyn std::fmt::Debug) {
    if least < -UNSURE {
        assert_eq!(status, Status::NegativeFriction, "friction {least} in {what:?}");
    } else if least > 1e-3 {
        assert_ne!(status, Status::NegativeFriction, "friction {least} in {what:?}");
    }
}

/// A transition whose friction may well fall below 0, and a time.
fn draw(random: &mut Random) -> (Transition, f64) {
    let a = random.between(5e-3, 0.2);
    let law = Law { a, b: a * random.between(0.05, 6.0) };
    let (v_i, v_f) = (1.0 + random.between(1e-2, 1e4), 1.0 + random.between(1e-2, 1e4));
    let transition = Transition { law, v_i, v_f };
    let t_f = transition.min_duration().max(0.0) * 1.001 + random.between(1e-2, 1e2) / v_i.max(v_f);
    (transition, t_f)
}

/// The least friction of a cubic over 5,000 equal steps of time and 500 at either end.
pub fn of_cubic(transition: &Transition, t_f: f64, a_2: f64, a_3: f64) -> f64 {
    let Transition { law, v_i, v_f } = *transition;
    let c = [1.0 / v_i, a_2, a_3, (v_i - v_f) / (v_i * v_f) - a_2 - a_3];
    let friction = |x: f64| {
        let theta = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
        let u = 1.0 - (c[1] + x * (2.0 * c[2] + x * 3.0 * c[3])) / t_f;
        1.0 + law.a * u.ln() + (law.b - law.a) * theta.ln()
    };
    let inner = (0..=5_000).map(|k| f64::from(k) / 5_000.0);
    let ends = (1..=500).map(|k| (-f64::from(k) * 0.04).exp());
    let ends = ends.flat_map(|d| [d, 1.0 - d]);
    inner.chain(ends).map(friction).fold(f64::INFINITY, f64::min)
}

#[test]
fn regress_a_shortcut_that_nearly_touches_theta_0_has_negative_friction() {
    let law = Law { a: 0.0716849648950757, b: 0.19038336715490253 };
    let transition = Transition { law, v_i: 3.7047250847351885, v_f: 84.0504534427937 };
    let t_f = 19.32972805754538;
    let (a_2, a_3) = (-0.02161332584291592 * t_f, -0.0003163286739292417 * t_f * t_f);
    let (mut work, mut v_min, mut status) = ([0.0], [0.0], [Status::Ok]);
    let out = LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status };
    Landscape::new(&transition, t_f, 1e-10).evaluate(&[a_2], &[a_3], out);
    assert_eq!(status, [Status::NegativeFriction]);
    assert!(work[0] < -3e8 && v_min[0] >= 1.0, "{work:?} {v_min:?}");
}

#[test]
fn shortcuts_of_a_landscape_have_the_friction_of_their_paths() {
    let mut random = Random::of("friction of shortcuts", 0);
    let (mut negative, mut positive) = (0, 0);
    for _ in 0..60 {
        let (transition, t_f) = draw(&mut random);
        let landscape = Landscape::new(&transition, t_f, 1e-6);
        let size = 1.0 / transition.v_i.min(transition.v_f);
        // A line of the plane, as a sweep has it, and scattered shortcuts.
        let first = (4.0 * random.uniform() - 2.0) * size;
        let line: Vec<[f64; 2]> = (0..512).map(|k| [first, (f64::from(k) / 128.0 - 2.0) * size]).collect();
        let scattered: Vec<[f64; 2]> =
            (0..40).map(|_| [(3.0 * random.uniform() - 2.0) * size, (4.0 * random.uniform() - 2.0) * size]).collect();
        for shortcuts in [line, scattered] {
            let [a_2, a_3] = [0, 1].map(|i| shortcuts.iter().map(|a| a[i]).collect::<Vec<f64>>());
            let mut status = vec![Status::NotConverged; a_2.len()];
            let out = LandscapeBuffers { work: &mut [], v_min: &mut [], status: &mut status };
            landscape.evaluate(&a_2, &a_3, out);
            for ((&a_2, &a_3), &status) in a_2.iter().zip(&a_3).zip(&status) {
                let mut alone = [Status::NotConverged];
                let out = LandscapeBuffers { work: &mut [], v_min: &mut [], status: &mut alone };
                landscape.evaluate(&[a_2], &[a_3], out);
                assert_eq!(alone, [status], "{transition:?} {t_f} {a_2} {a_3}");
                if status == Status::Infeasible {
                    continue;
                }
                compare(status, of_cubic(&transition, t_f, a_2, a_3), &(transition, t_f, a_2, a_3));
                if status == Status::NegativeFriction { negative += 1 } else { positive += 1 }
            }
        }
    }
    assert!(negative > 30 && positive > 300, "{negative} {positive}");
}

#[test]
fn protocols_have_the_friction_of_their_motions() {
    let mut random = Random::of("friction of protocols", 0);
    let mut seen = [[0; 2]; 5];
    let mut note = |place: usize, status: Status| seen[place][usize::from(status == Status::NegativeFriction)] += 1;
    for _ in 0..400 {
        let (transition, t_f) = draw(&mut random);
        let bounded = random.chance(0.5);
        let what = (transition, t_f, bounded);
        let (solved, motion) = optimal::motion(&transition, t_f, bounded, 1e-8);
        if let Some(motion) = motion {
            compare(solved.status, sampled(&*motion), &what);
            note(0, solved.status);
        }
        for family in FAMILIES {
            let case = Case { transition, t_f, tau_ceiling: f64::INFINITY };
            let Ok(found) = family.solve(&case, 1e-8, &mut SolverStats::default()) else { continue };
            let Ok(motion) = family.motion(&case, 1e-8) else { continue };
            compare(found.status(), sampled(&*motion), &(what, family.name));
            note(1, found.status());
        }
        let slider = SpringBlock { law: transition.law, k: 1.0, m: 0.0 };
        let solved = compliant::solve(&slider, (transition.v_i, transition.v_f), t_f, 1e-8);
        if let Ok(path) = compliant::path(&slider, (transition.v_i, transition.v_f), t_f, 1e-8) {
            compare(solved.status, sampled(&path), &what);
            note(2, solved.status);
        }
        let velocities = (transition.v_i, transition.v_f);
        let (solved, motion) = regularised::motion(&slider, velocities, t_f, 0.05 * t_f, bounded, 1e-8);
        if let Some(motion) = motion {
            compare(solved.status, sampled(&*motion), &what);
            note(3, solved.status);
        }
        if random.chance(0.1) {
            let solved = best_cubic::solve(&transition, t_f, bounded, 1e-8);
            if let Some(found) = solved.value.filter(|found| found.v_min > 0.0) {
                compare(solved.status, of_cubic(&transition, t_f, found.a_2, found.a_3), &what);
                note(4, solved.status);
            }
        }
    }
    for (counts, what) in seen.iter().zip(["optimal", "shortcut", "compliant", "regularised", "best_cubic"]) {
        assert!(counts[0] > 10 && (counts[1] > 3 || what == "best_cubic"), "{what}: {counts:?}");
    }
}

#[test]
fn regress_an_extremal_below_the_bound_has_no_numbers() {
    let law = Law { a: 0.06434975520182007, b: 0.25141359495891136 };
    let transition = Transition { law, v_i: 43.72895279391987, v_f: 105.95858837291729 };
    let solved = optimal::solve(&transition, 1.164793567258515, true, 1e-10);
    assert_eq!((solved.status, solved.value), (Status::Unproven, None));
    // Without the bound it is one.
    let free = optimal::solve(&transition, 1.164793567258515, false, 1e-10);
    assert!(free.value.is_some_and(|found| found.v_start < 1.0), "{free:?}");
}

#[test]
fn bounded_motions_keep_the_bound_whatever_their_status() {
    let mut random = Random::of("bounded motions", 0);
    let mut doubtful = 0;
    for _ in 0..600 {
        let (transition, t_f) = draw(&mut random);
        let (solved, motion) = optimal::motion(&transition, t_f, true, 1e-8);
        let (Some(found), Some(motion)) = (solved.value, motion) else { continue };
        assert!(found.v_start >= 1.0 && found.v_end >= 1.0, "{transition:?} {t_f} {found:?}");
        let landmarks = motion.landmarks();
        let places =
            landmarks.windows(2).flat_map(|pair| (0..=50).map(|k| pair[0] + (pair[1] - pair[0]) * f64::from(k) / 50.0));
        let least = places.map(|s| motion.at(s).v).fold(f64::INFINITY, f64::min);
        assert!(least > 1.0 - 1e-7, "{transition:?} {t_f} {least} {solved:?}");
        doubtful += usize::from(solved.status != Status::Ok);
    }
    assert!(doubtful > 10, "{doubtful}");
}
