//! Peaks of the velocity, counted and located on dense output. The driver of CVODE does the same in C.

/// Peaks seen so far: maxima above `v_f` that `v` has risen to and fallen from by more than [`FALL`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Peaks {
    pub count: u32,
    /// `ln(v/v_f)` at the first.
    pub first: Option<f64>,
    /// Last extreme value, and whether it is being risen from.
    extreme: Option<f64>,
    falls: bool,
}

/// Change of `ln v` that separates peaks.
const FALL: f64 = 0.01;

/// Parts that a step is looked through in.
const PARTS: u32 = 8;

/// `(sqrt(5) - 1)/2`.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl Peaks {
    /// As counted elsewhere.
    pub fn of(count: u32, first: f64) -> Peaks {
        Peaks { count, first: (count > 0).then_some(first), ..Peaks::default() }
    }

    /// Looks through a step, of which `x` gives `ln(v/v_f)` at the fraction of it.
    pub fn look(&mut self, mut x: impl FnMut(f64) -> f64) {
        let part = 1.0 / f64::from(PARTS);
        let (mut at, mut highest) = (0.0, f64::NEG_INFINITY);
        let samples: [f64; PARTS as usize + 1] = std::array::from_fn(|i| {
            let value = x(i as f64 * part);
            if value > highest {
                (at, highest) = (i as f64 * part, value);
            }
            value
        });
        let top = (highest > 0.0).then(|| maximum(&mut x, (at - part).max(0.0), (at + part).min(1.0)));
        for (i, sample) in samples.into_iter().enumerate() {
            self.pass(sample);
            if let Some(top) = top.filter(|_| i as f64 * part == at) {
                self.pass(top);
            }
        }
    }

    fn pass(&mut self, x: f64) {
        let extreme = *self.extreme.get_or_insert(x);
        let change = if self.falls { extreme - x } else { x - extreme };
        if change >= 0.0 {
            self.extreme = Some(x);
        } else if change < -FALL {
            if !self.falls && extreme > 0.0 {
                self.count += 1;
                self.first.get_or_insert(extreme);
            }
            (self.falls, self.extreme) = (!self.falls, Some(x));
        }
    }
}

/// Greatest value between `from` and `to`, by golden section.
fn maximum(x: &mut impl FnMut(f64) -> f64, from: f64, to: f64) -> f64 {
    let (mut from, mut to) = (from, to);
    let mut inner = [to - GOLDEN * (to - from), from + GOLDEN * (to - from)];
    let mut value = inner.map(&mut *x);
    for _ in 0..60 {
        if value[0] > value[1] {
            (to, inner[1], value[1]) = (inner[1], inner[0], value[0]);
            inner[0] = to - GOLDEN * (to - from);
            value[0] = x(inner[0]);
        } else {
            (from, inner[0], value[0]) = (inner[0], inner[1], value[1]);
            inner[1] = from + GOLDEN * (to - from);
            value[1] = x(inner[1]);
        }
    }
    value[0].max(value[1])
}
