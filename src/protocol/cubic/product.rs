//! `theta v` and the numbers at a node for eight shortcuts at a time, under each evolution law of the state.

use crate::model::StateLaw;
use crate::numerics::lambert::{NEAR_END, far_branch, near_branches};
use crate::numerics::lanes::{Vector, choose, least, lower};

/// `theta v` as a function of the lack `n/t_f` in every lane, without branches: [`StateLaw::product`].
pub(super) trait Product {
    /// The law.
    const LAW: StateLaw;

    /// `theta v`.
    fn of(lack: Vector) -> Vector;

    /// Velocity and `tau'`, both times `theta n`, and `theta n`, from theta, `n`, `a n'` over the unit of `tau'`, and `1/t_f`.
    #[inline(always)]
    fn node(theta: Vector, n: Vector, slope: Vector, inverse_time: Vector) -> [Vector; 3] {
        let n = positive(n);
        let lack = n * inverse_time;
        [n * Self::of(lack), (n - n * lack) + slope * theta, theta * n]
    }
}

/// The ageing law, with velocities in units of `1/t_f` at the nodes.
pub(super) struct Ageing;

/// The law of Perrin, Rice and Zheng.
pub(super) struct Prz;

/// The slip law.
pub(super) struct Slip;

/// The slip law where the lack is at most [`NEAR_END`]: the same bits.
pub(super) struct NearSlip;

impl Product for Ageing {
    const LAW: StateLaw = StateLaw::Ageing;

    #[inline(always)]
    fn of(lack: Vector) -> Vector {
        lack
    }

    #[inline(always)]
    fn node(theta: Vector, n: Vector, slope: Vector, _: Vector) -> [Vector; 3] {
        // tau' lacks a multiple of the velocity, which the bilinear form does not see.
        [n * n, n + slope * theta, theta * n]
    }
}

impl Product for Prz {
    const LAW: StateLaw = StateLaw::Prz;

    #[inline(always)]
    fn of(lack: Vector) -> Vector {
        lack.map(f64::sqrt)
    }
}

impl Product for NearSlip {
    const LAW: StateLaw = StateLaw::Slip;

    #[inline(always)]
    fn of(lack: Vector) -> Vector {
        (1.0 / std::f64::consts::E) * near_branches(lack)
    }
}

impl Product for Slip {
    const LAW: StateLaw = StateLaw::Slip;

    #[inline(always)]
    fn of(lack: Vector) -> Vector {
        // Each lane has the formula of its own argument, whatever the others hold.
        let far = lack.map(|lack| (1.0 / std::f64::consts::E) * far_branch(lack));
        choose(lack - Vector::splat(NEAR_END), far, NearSlip::of(lack))
    }
}

impl NearSlip {
    /// Whether the lack of eight shortcuts, with coefficients of theta from the first power on, is nowhere near [`NEAR_END`] or beyond.
    #[inline(always)]
    pub fn holds(t_f: f64, [a_2, a_3, a_4]: [Vector; 3]) -> bool {
        // t_f - n in Bernstein's form.
        let second = a_2 + a_3;
        let falls = lower(lower(a_2, second), second + a_3 + 3.0 * a_4);
        least(&falls.0) >= t_f * (1.0 - BOUND_MARGIN * NEAR_END)
    }
}

/// Fraction of [`NEAR_END`] that the bound of the lack may reach. Chosen: rounding at the nodes stays below the end.
const BOUND_MARGIN: f64 = 0.999;

/// The lack or `n`, which rounding may make negative on the border.
#[inline(always)]
pub(super) fn positive(lack: Vector) -> Vector {
    lack.map(|lack| if lack > f64::MIN_POSITIVE { lack } else { f64::MIN_POSITIVE })
}
