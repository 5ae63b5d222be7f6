//! Sampled designs: points that fill a box evenly.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A kind of joint sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// A Sobol sequence with Owen scrambling (Burley, JCGT 2020): any first `2^n` points fill the box evenly. Values have 24 bits.
    Sobol,
    /// A Latin hypercube: of `n` points one lies in each of the `n` equal parts of every axis.
    LatinHypercube,
}

impl Design {
    /// Its key in a spec.
    pub fn name(self) -> &'static str {
        match self {
            Design::Sobol => "sobol",
            Design::LatinHypercube => "lhs",
        }
    }

    /// Its greatest number of points.
    pub fn most(self) -> u64 {
        match self {
            Design::Sobol => 1 << 16,
            Design::LatinHypercube => 1 << 20,
        }
    }

    /// `count` values between 0 and 1 for axis number `axis` of a joint sample, the same on every machine.
    pub fn values(self, axis: u32, count: u64, seed: u32) -> Vec<f64> {
        match self {
            Design::Sobol => {
                (0..count).map(|point| f64::from(sobol_burley::sample(point as u32, axis, seed))).collect()
            }
            Design::LatinHypercube => {
                let mut random = Pcg64::seed_from_u64(u64::from(axis) << 32 | u64::from(seed));
                let mut parts: Vec<u32> = (0..count as u32).collect();
                for last in (1..parts.len()).rev() {
                    parts.swap(last, below(&mut random, last as u64 + 1));
                }
                let inside = |random: &mut Pcg64| (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
                parts.into_iter().map(|part| (f64::from(part) + inside(&mut random)) / count as f64).collect()
            }
        }
    }
}

/// A random integer below `end`, by multiplication (Lemire, TOMACS 2019) without rejection: uniform up to a fraction of `end/2^64`.
fn below(random: &mut Pcg64, end: u64) -> usize {
    ((u128::from(random.next_u64()) * u128::from(end)) >> 64) as usize
}
