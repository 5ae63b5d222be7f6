//! An axis: a finite sequence of values of one quantity. Each value is computed from its index.

use super::quantity::{Quantity, Scale};

/// The values of an axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// A list of values.
    List(Vec<f64>),
    /// `first + i step` with `step = (last - first)/(count - 1)`, both ends exact: the doubles of `numpy.linspace`.
    Linspace {
        /// Value at index 0.
        first: f64,
        /// Value at index `count - 1`.
        last: f64,
        /// Number of values, at least 2.
        count: u64,
    },
    /// `first (last/first)^(i/(count - 1))`, both ends exact.
    Geomspace {
        /// Value at index 0, not 0.
        first: f64,
        /// Value at index `count - 1`, of the same sign.
        last: f64,
        /// Number of values, at least 2.
        count: u64,
    },
}

impl Values {
    /// Number of values.
    pub fn len(&self) -> u64 {
        match self {
            Values::List(values) => values.len() as u64,
            Values::Linspace { count, .. } | Values::Geomspace { count, .. } => *count,
        }
    }

    /// Whether the axis has no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at `index < len()`.
    pub fn at(&self, index: u64) -> f64 {
        match *self {
            Values::List(ref values) => values[index as usize],
            Values::Linspace { last, count, .. } | Values::Geomspace { last, count, .. } if index + 1 >= count => last,
            Values::Linspace { first, last, count } => first + index as f64 * ((last - first) / (count - 1) as f64),
            Values::Geomspace { first, last, count } => {
                // Base 10 keeps the decades exact, as in 10, 100, 1000.
                let value = first * libm::exp10(libm::log10(last / first) * (index as f64 / (count - 1) as f64));
                // Rounding must not leave the range.
                value.clamp(first.min(last), first.max(last))
            }
        }
    }
}

/// One quantity and the values it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity.
    pub quantity: Quantity,
    /// The unit of the values.
    pub scale: Scale,
    /// The values.
    pub values: Values,
}

#[cfg(test)]
mod tests {
    //! Ranges contain both ends exactly and do not drift.

    use super::*;

    #[test]
    fn linspace_is_start_plus_i_steps() {
        let axis = Values::Linspace { first: -0.5, last: 0.5, count: 401 };
        assert_eq!(axis.len(), 401);
        assert_eq!(axis.at(0), -0.5);
        assert_eq!(axis.at(400), 0.5);
        assert_eq!(axis.at(200), 0.0);
        for i in 0..401 {
            assert!((axis.at(i) - (i as f64 - 200.0) / 400.0).abs() <= 1.2e-16, "{i}");
        }
    }

    #[test]
    fn geomspace_keeps_decades_and_ends() {
        let axis = Values::Geomspace { first: 10.0, last: 1000.0, count: 31 };
        assert_eq!([axis.at(0), axis.at(15), axis.at(30)], [10.0, 100.0, 1000.0]);
        let odd = Values::Geomspace { first: 3.7, last: 2900.1, count: 7 };
        assert_eq!([odd.at(0), odd.at(6)], [3.7, 2900.1]);
        let negative = Values::Geomspace { first: -100.0, last: -1.0, count: 3 };
        assert_eq!(negative.at(1), -10.0);
    }

    #[test]
    fn regress_geomspace_stays_between_its_ends() {
        let next = |x: f64| f64::from_bits(x.to_bits() + 1);
        for (first, last) in [(1.0, next(1.0)), (next(1.0), 1.0), (3.7, next(next(3.7)))] {
            let axis = Values::Geomspace { first, last, count: 7 };
            for index in 0..7 {
                assert!((first.min(last)..=first.max(last)).contains(&axis.at(index)), "{first} {last} {index}");
            }
        }
    }

    #[test]
    fn geomspace_has_equal_ratios() {
        let axis = Values::Geomspace { first: 1e-3, last: 2.0, count: 1001 };
        let ratio = axis.at(1) / axis.at(0);
        for i in 1..1000 {
            assert!((axis.at(i + 1) / axis.at(i) / ratio - 1.0).abs() <= 4e-15, "{i}");
        }
    }
}
