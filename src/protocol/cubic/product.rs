//! `theta v` and the numbers at a node for eight shortcuts at a time, under each evolution law of the state.

use crate::model::StateLaw;
use crate::numerics::lambert::{NEAR_END, far_branch, near_branches};
use crate::numerics::lanes::{Vector, choose, least};

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

impl Product for Slip {
    const LAW: StateLaw = StateLaw::Slip;

    #[inline(always)]
    fn of(lack: Vector) -> Vector {
        let near = (1.0 / std::f64::consts::E) * near_branches(lack);
        let rest = Vector::splat(NEAR_END) - lack;
        if least(&rest.0) >= 0.0 {
            return near;
        }
        // Each lane has the formula of its own argument, whatever the others hold.
        choose(Vector::splat(0.0) - rest, lack.map(|lack| (1.0 / std::f64::consts::E) * far_branch(lack)), near)
    }
}

/// The lack or `n`, which rounding may make negative on the border.
#[inline(always)]
pub(super) fn positive(lack: Vector) -> Vector {
    lack.map(|lack| if lack > f64::MIN_POSITIVE { lack } else { f64::MIN_POSITIVE })
}
