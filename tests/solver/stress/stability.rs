//! `stability`: decided as in exact arithmetic, also within units in the last place of the critical stiffness.

use slipsweep::model::{Law, StateLaw};
use slipsweep::protocol::{SpringBlock, Status};
use slipsweep::stability::{Eigenvalues, SteadySliding, critical_velocity, lyapunov_coefficient};

use super::random::Random;
use super::{POINTS, sample};

#[derive(Debug)]
struct Point {
    slider: SpringBlock,
    v: f64,
}

fn draw(random: &mut Random) -> Point {
    let (law, v) = (random.law(), random.velocity());
    Point { slider: random.slider(law, v), v }
}

fn modes(law: Law, k: f64, m: f64, v: f64) -> (bool, Option<Eigenvalues>) {
    let sliding = SteadySliding::new(law, k, m, v);
    (sliding.is_stable(), sliding.eigenvalues())
}

/// A sum of doubles that do not overlap, the least first: exact arithmetic (Shewchuk, Discrete Comput. Geom. 18, 305, 1997).
struct Expansion(Vec<f64>);

impl Expansion {
    fn plus(mut self, mut x: f64) -> Expansion {
        for term in &mut self.0 {
            let sum = x + *term;
            let part = sum - x;
            *term = (x - (sum - part)) + (*term - part);
            x = sum;
        }
        self.0.push(x);
        self
    }

    fn times(&self, factor: f64) -> Expansion {
        let product = |x: f64, y: f64| {
            let high = x * y;
            [x.mul_add(y, -high), high]
        };
        self.0.iter().flat_map(|&term| product(term, factor)).fold(Expansion(Vec::new()), Expansion::plus)
    }

    fn minus(self, other: &Expansion) -> Expansion {
        other.0.iter().fold(self, |sum, &term| sum.plus(-term))
    }

    /// The sign: that of the greatest term.
    fn is_positive(&self) -> bool {
        self.0.iter().rev().find(|&&term| term != 0.0).is_some_and(|&term| term > 0.0)
    }
}

/// `a k > (b - a)(m v^2 + a)`.
fn is_stable(Law { a, b }: Law, k: f64, m: f64, v: f64) -> bool {
    let sum = Expansion(vec![m]).times(v).times(v).plus(a);
    let push = sum.times(b).minus(&sum.times(a));
    Expansion(vec![a]).times(k).minus(&push).is_positive()
}

#[test]
fn every_steady_sliding_is_decided_and_scales() {
    sample("stability", POINTS, draw, |point, row| {
        let &Point { slider: SpringBlock { law, k, m }, v } = point;
        row.status(Status::Ok);
        let (stable, eigenvalues) = modes(law, k, m, v);
        row.fact("as in exact arithmetic", k == f64::INFINITY || stable == is_stable(law, k, m, v));
        row.fact("eigenvalues of an elastic spring", eigenvalues.is_none() == k.is_infinite());
        if let Some(Eigenvalues { growth_rate, frequency, decay_rate }) = eigenvalues {
            let numbers = [growth_rate, frequency, decay_rate.unwrap_or(-1.0)];
            row.fact("finite", numbers.iter().all(|number| number.is_finite()));
            row.fact("growth agrees with stability", (growth_rate < 0.0) == stable);
            row.fact("frequency and decay", frequency >= 0.0 && decay_rate.is_none_or(|rate| rate < 0.0));
            row.fact("three with mass", decay_rate.is_some() == (m > 0.0));
            if let (Some(decay), true) = (decay_rate, frequency > 0.0) {
                // Vieta: the sum and the product of the roots.
                let sum = 2.0 * growth_rate + decay;
                let size = 2.0 * growth_rate.abs() + decay.abs();
                row.at_most("sum of the roots", (sum + v + law.a / (m * v)).abs(), 1e-14 * (size + v));
                let product = (growth_rate * growth_rate + frequency * frequency) * -decay;
                row.agree("product of the roots", product, k * v / m, 1e-14);
            }
        }
        let v_crit = critical_velocity(law, k, m);
        row.fact("v_crit is a velocity", v_crit.is_none_or(|v_crit| v_crit > 0.0 && v_crit.is_finite()));
        if let Some(v_crit) = v_crit.filter(|v_crit| (v / v_crit - 1.0).abs() > 1e-14) {
            row.fact("stable below v_crit", stable == (v < v_crit));
        }
        row.fact(
            "lyapunov is a number",
            lyapunov_coefficient(StateLaw::Ageing, law, m * v * v).is_none_or(f64::is_finite),
        );
        // Powers of two scale without rounding. Only m v^2 enters, and the unit of time is l/v.
        let times = |eigenvalues: Eigenvalues, factor: f64| Eigenvalues {
            growth_rate: factor * eigenvalues.growth_rate,
            frequency: factor * eigenvalues.frequency,
            decay_rate: eigenvalues.decay_rate.map(|rate| factor * rate),
        };
        let faster = (stable, eigenvalues.map(|eigenvalues| times(eigenvalues, 8.0)));
        row.fact("only m v^2 enters", modes(law, k, m / 64.0, 8.0 * v) == faster);
        let weaker = Law { a: 0.25 * law.a, b: 0.25 * law.b };
        row.fact("only ratios of forces enter", modes(weaker, 0.25 * k, 0.25 * m, v) == (stable, eigenvalues));
    });
}
