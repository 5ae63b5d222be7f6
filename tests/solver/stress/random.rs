//! Points that every table draws: log-uniform over the legal domain, with extra weight on singular places and on the
//! boundaries between regimes.

use slipsweep::grid::Quantity;
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::SpringBlock;
use slipsweep::protocol::optimal::crossover::{self, CrossoverTimes, Wanted};
use slipsweep::protocol::optimal::shortest_time;
use slipsweep::stability::SteadySliding;

/// All special times.
pub const EVERY_TIME: Wanted = Wanted { cross: true, floor: true, cheapest: true, min: true, turn: true, free: true };

/// Units in the last place from a boundary.
const STEPS: [i64; 7] = [0, 1, -1, 10, -10, 1000, -1000];

/// Numbers by splitmix64, whose state is a mere counter: every point has a sequence of its own.
pub struct Random(u64);

impl Random {
    /// The sequence of point number `index` of a table.
    pub fn of(table: &str, index: u64) -> Random {
        let seed = table.bytes().fold(0, |seed, byte| mix(seed ^ u64::from(byte)));
        Random(mix(seed ^ mix(index)))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// A number in `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Whether something of this probability happens.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// Log-uniform.
    pub fn between(&mut self, least: f64, greatest: f64) -> f64 {
        // In two factors, since the ratio may overflow.
        let fraction = self.uniform();
        least.powf(1.0 - fraction) * greatest.powf(fraction)
    }

    /// Log-uniform over the legal domain.
    pub fn legal(&mut self, quantity: Quantity) -> f64 {
        let domain = quantity.domain();
        self.between(domain.least, domain.greatest)
    }

    /// One of them.
    pub fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[(self.uniform() * of.len() as f64) as usize]
    }

    /// Either sign.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { -1.0 } else { 1.0 }
    }

    /// A positive number 0, 1, 10 or 1000 units in the last place away from `x`.
    pub fn near(&mut self, x: f64) -> f64 {
        let steps = self.one(&STEPS);
        f64::from_bits(x.to_bits().saturating_add_signed(steps)).clamp(f64::from_bits(1), f64::MAX)
    }

    /// `x` changed by a fraction of 1e-15 to 1e-3.
    fn compared_with(&mut self, x: f64) -> f64 {
        x * (1.0 + self.sign() * self.between(1e-15, 1e-3))
    }

    /// `b` is 0, `a`, near it, less, or anything.
    pub fn law(&mut self) -> Law {
        let a = if self.chance(0.1) { self.between(1e-6, 1e-3) } else { self.legal(Quantity::A) };
        let b = match (self.uniform() * 8.0) as u32 {
            0 => 0.0,
            1 => a,
            2 => self.compared_with(a),
            3 | 4 => a * self.uniform(),
            5 => a * self.between(1.0, 10.0),
            _ => self.between(1e-6, 10.0),
        };
        Law { a, b: b.min(10.0) }
    }

    /// One in ten within 1e-12 of 1.
    pub fn velocity(&mut self) -> f64 {
        if self.chance(0.1) {
            1.0 + self.between(3e-16, 1e-12)
        } else {
            1.0 + self.between(1e-12, Quantity::InitialVelocity.domain().greatest - 1.0)
        }
    }

    /// One in five from a velocity to one near it, one in fifty to itself.
    pub fn velocities(&mut self) -> (f64, f64) {
        let v_i = self.velocity();
        let v_f = match self.uniform() {
            kind if kind < 0.02 => v_i,
            kind if kind < 0.12 => self.compared_with(v_i).max(1.0 + f64::EPSILON),
            kind if kind < 0.22 => 1.0 + self.compared_with(v_i - 1.0).max(f64::EPSILON),
            _ => self.velocity(),
        };
        (v_i, v_f)
    }

    /// A law and two velocities.
    pub fn transition(&mut self) -> Transition {
        let (law, (v_i, v_f)) = (self.law(), self.velocities());
        Transition { law, v_i, v_f }
    }

    /// A duration: on a boundary between regimes, beyond the least one, in proportion to the velocities, or anything.
    pub fn duration(&mut self, transition: &Transition, bounded: bool) -> f64 {
        let least = shortest_time(transition, bounded).expect("is in the domain");
        let fast = 1.0 / transition.v_i.max(transition.v_f);
        let t_f = match self.uniform() {
            kind if kind < 0.35 => {
                let (_, times, _) = crossover::solve(transition, bounded, 1e-13, EVERY_TIME);
                let CrossoverTimes { t_cross, t_floor, t_cheapest, t_turn, t_free_in, t_free_out, .. } = times;
                let special = [t_cross, t_floor, t_cheapest, Some(least), t_turn, t_free_in, t_free_out];
                let special: Vec<f64> = special.into_iter().flatten().filter(|&t| t > 0.0).collect();
                if special.is_empty() { self.between(1e-9, 1e9) * fast } else { self.one(&special) }
            }
            kind if kind < 0.55 => least + least.max(fast) * self.between(1e-15, 1e3),
            kind if kind < 0.8 => least + self.between(1e-9, 1e9) * fast,
            _ => self.legal(Quantity::Time),
        };
        self.near(t_f).clamp(Quantity::Time.domain().least, Quantity::Time.domain().greatest)
    }

    /// A block, one in ten without mass, on a spring, one in ten rigid; one in three at the critical stiffness of a
    /// velocity, or near it.
    pub fn slider(&mut self, law: Law, v: f64) -> SpringBlock {
        let m = if self.chance(0.1) { 0.0 } else { self.legal(Quantity::Mass) };
        let critical = SteadySliding::new(law, 1.0, m, v).critical_stiffness();
        let k = match self.uniform() {
            kind if kind < 0.1 => f64::INFINITY,
            kind if kind < 0.3 && critical > 0.0 => self.near(critical),
            kind if kind < 0.45 && critical > 0.0 => self.compared_with(critical),
            _ => self.legal(Quantity::Stiffness),
        };
        SpringBlock { law, k, m }
    }

    /// An accuracy that a spec may request.
    pub fn rtol(&mut self) -> f64 {
        self.between(1e-13, 1e-2)
    }
}

fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
