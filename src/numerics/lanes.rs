//! Eight numbers side by side: the unit of all kernels, for any vector width of the machine.
//!
//! Loops over [`LANES`] are unrolled into vector instructions by the compiler. Sums run lane by lane and are added in one fixed order, so a
//! result has the same bits at every vector width.

/// Number of lanes of a kernel. Chosen: the doubles of the widest vectors, 512 bits.
pub const LANES: usize = 8;

/// One value per lane.
pub type Lanes = [f64; LANES];

/// The value of a closure for the index of every lane, written out. Loops would be unrolled anyway, but thousands of them keep the compiler busy for
/// minutes.
macro_rules! lanes {
    ($of:expr) => {{
        let of = $of;
        [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)]
    }};
}

/// The sum of all lanes, pairwise and in a fixed order.
#[inline(always)]
pub fn fold(sum: &Lanes) -> f64 {
    ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]))
}

/// The least of all lanes.
#[inline(always)]
pub fn least(values: &Lanes) -> f64 {
    let lower = |x: f64, y: f64| if y < x { y } else { x };
    let pair = |i: usize| lower(values[i], values[i + 4]);
    lower(lower(pair(0), pair(2)), lower(pair(1), pair(3)))
}

/// `yes` in the lanes where `sign` is above 0, else `no`.
#[inline(always)]
pub fn choose(sign: Vector, yes: Vector, no: Vector) -> Vector {
    Vector(lanes!(|i: usize| if sign.0[i] > 0.0 { yes.0[i] } else { no.0[i] }))
}

/// The lesser of two numbers in each lane.
#[inline(always)]
pub fn lower(x: Vector, y: Vector) -> Vector {
    choose(y - x, x, y)
}

/// [`Lanes`] with arithmetic, lane by lane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub struct Vector(pub Lanes);

impl Vector {
    /// A vector with `value` in every lane.
    #[inline(always)]
    pub const fn splat(value: f64) -> Vector {
        Vector([value; LANES])
    }

    /// A function of every lane.
    #[inline(always)]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Vector {
        Vector(lanes!(|i: usize| f(self.0[i])))
    }

    /// A function of every pair of lanes.
    #[inline(always)]
    pub fn zip(self, other: Vector, f: impl Fn(f64, f64) -> f64) -> Vector {
        Vector(lanes!(|i: usize| f(self.0[i], other.0[i])))
    }
}

macro_rules! lanewise {
    ($($trait:ident $method:ident $operator:tt;)*) => {$(
        impl std::ops::$trait for Vector {
            type Output = Vector;
            #[inline(always)]
            fn $method(self, other: Vector) -> Vector {
                self.zip(other, |x, y| x $operator y)
            }
        }
        impl std::ops::$trait<Vector> for f64 {
            type Output = Vector;
            #[inline(always)]
            fn $method(self, other: Vector) -> Vector {
                other.map(|y| self $operator y)
            }
        }
    )*};
}

lanewise! { Add add +; Sub sub -; Mul mul *; Div div /; }
