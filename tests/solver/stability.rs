//! Linear stability: the eigenvalues against the characteristic equation with 32 digits.

use crate::support::Random;
use slipsweep::model::Law;
use slipsweep::numerics::double_double::DoubleDouble;
use slipsweep::stability::{Eigenvalues, SteadySliding};

/// `(x^3 M + (M + a) x^2 + c x + k)` and the sum of the sizes of its terms at a complex `x`, in double-double.
fn residual(law: Law, k: f64, m: f64, v: f64, (re, im): (f64, f64)) -> f64 {
    let double = DoubleDouble::new;
    let inertia = double(m) * double(v) * double(v);
    let coefficients = [inertia, inertia + double(law.a), double(k) + double(law.a) - double(law.b), double(k)];
    let (mut x, mut y, mut size) = (double(0.0), double(0.0), 0.0);
    for coefficient in coefficients {
        (x, y) = (x * double(re) - y * double(im) + coefficient, x * double(im) + y * double(re));
        size = size * re.hypot(im) + coefficient.high.abs();
    }
    x.high.hypot(y.high) / size
}

fn scaled(eigenvalues: &Eigenvalues, v: f64) -> [(f64, f64); 2] {
    [(eigenvalues.growth_rate / v, eigenvalues.frequency / v), (eigenvalues.decay_rate.unwrap_or(0.0) / v, 0.0)]
}

#[test]
fn roots_solve_the_characteristic_equation() {
    let mut random = Random(1);
    for _ in 0..200_000 {
        let a = random.between(1e-4, 0.3);
        let law = Law { a, b: 10.0 * a * random.next() };
        let (k, v) = (random.between(1e-6, 1e3), random.between(1.001, 1e9));
        let m = random.between(1e-20, 1e3);
        let sliding = SteadySliding::new(law, k, m, v);
        let eigenvalues = sliding.eigenvalues().expect("is elastic");
        for root in scaled(&eigenvalues, v) {
            let residual = residual(law, k, m, v, root);
            assert!(residual <= 4e-15, "{law:?} {k} {m} {v} {eigenvalues:?} {residual}");
        }
        assert!(eigenvalues.decay_rate.is_some_and(|decay| decay < 0.0));
        assert_eq!(eigenvalues.growth_rate < 0.0, sliding.is_stable(), "{law:?} {k} {m} {v}");
    }
}

#[test]
fn regress_two_equal_roots_far_from_the_third() {
    let cases = [
        (
            Law { a: 0.19086204474307833, b: 2.2434371767818206e-5 },
            1.1408613468454599e-36,
            0.19506509378437617,
            1.0000000013126165,
        ),
        (
            Law { a: 0.029836586823087336, b: 0.011314424028958483 },
            2.864919705106888e21,
            7.77143814637104e-26,
            1.0000000000024418,
        ),
        (Law { a: 9.573661630788803e-6, b: 0.0 }, 2.5530113256544154e-38, 9.286204574305586e-6, 1.0000000000000049),
    ];
    for (law, k, m, v) in cases {
        let eigenvalues = SteadySliding::new(law, k, m, v).eigenvalues().expect("is elastic");
        for root in scaled(&eigenvalues, v) {
            let residual = residual(law, k, m, v, root);
            assert!(residual <= 4e-15, "{law:?} {k} {m} {v} {eigenvalues:?} {residual}");
        }
    }
}
