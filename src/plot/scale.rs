//! Scales of axes and colours: linear or logarithmic, their ticks, and the choice between them.

use super::label;

/// Ratio of the greatest to the least value from which the scale is logarithmic. Chosen: a decade and a half.
const LOG_RATIO: f64 = 30.0;

/// Ratio of the positive values from which the scale is logarithmic although other values are zero and are not drawn. Chosen: many decades
/// matter more.
const LOG_RATIO_WITH_ZERO: f64 = 1e9;

/// Size, relative to the greatest value, below which values may be rounded zeros. Chosen: nine thousand roundings of 1.1e-16, a hundredth of the default `rtol`.
const ROUNDING_RTOL: f64 = 1e-12;

/// Range of values, relative to the greatest, below which they are constant. Chosen: the range is rounding.
pub const CONSTANT_RTOL: f64 = 1e-9;

/// Number of empty decades between such zeros and other values. Chosen: neighbouring points of a curve are closer.
const EMPTY_DECADES: usize = 6;

/// A range of values, and whether it is shown logarithmically.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// The value at the start.
    pub low: f64,
    /// The value at the end.
    pub high: f64,
    /// Whether the scale is logarithmic.
    pub log: bool,
}

/// A mark of a scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Its position: 0 at the start of the scale, 1 at the end.
    pub fraction: f64,
    /// Its text in markup; `None` for a small tick.
    pub label: Option<String>,
}

/// The ticks of a scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Ticks {
    /// The ticks in ascending order.
    pub ticks: Vec<Tick>,
    /// The common power of ten of the labels.
    pub power: i32,
}

impl Scale {
    /// The scale of `values`: logarithmic if they are positive and span a large ratio. Rounded zeros do not extend it. `None` without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Scale> {
        let finite: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        let (low, high) = range(finite.iter().copied());
        if low > high {
            return None;
        }
        let linear = Scale { low, high, log: false };
        if low < 0.0 || high <= 0.0 {
            return Some(linear);
        }
        let zero = rounding(&finite, high);
        let (least, _) = range(finite.iter().copied().filter(|value| *value > zero));
        let ratio = if low == 0.0 { LOG_RATIO_WITH_ZERO } else { LOG_RATIO };
        Some(if high / least >= ratio { Scale { low: least, high, log: true } } else { linear })
    }

    /// The scale with some space at both ends, also around a single value.
    pub fn with_room(self, fraction: f64) -> Scale {
        if self.log {
            let room = (self.high / self.low).ln().max(1e-3) * fraction;
            return Scale { low: self.low * (-room).exp(), high: self.high * room.exp(), log: true };
        }
        let span = self.high - self.low;
        let least = CONSTANT_RTOL * self.low.abs().max(self.high.abs());
        let room = if span > least {
            span * fraction
        } else if least > 0.0 {
            0.05 * self.high.abs().max(self.low.abs())
        } else {
            1.0
        };
        Scale { low: self.low - room, high: self.high + room, log: false }
    }

    /// The fraction of `value` along the scale; NaN beyond the scale.
    pub fn fraction(&self, value: f64) -> f64 {
        if self.log {
            if value > 0.0 { (value / self.low).ln() / (self.high / self.low).ln() } else { f64::NAN }
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// The value at a fraction.
    pub fn value(&self, fraction: f64) -> f64 {
        if self.log {
            self.low * ((self.high / self.low).ln() * fraction).exp()
        } else {
            self.low + (self.high - self.low) * fraction
        }
    }

    /// About `count` labelled ticks; logarithmic ticks are all decimals from 0.001 to 9999, else all powers of ten.
    pub fn ticks(&self, count: usize) -> Ticks {
        if self.log { self.powers(count) } else { self.steps(count) }
    }

    fn steps(&self, count: usize) -> Ticks {
        let span = self.high - self.low;
        if !(span > 0.0 && span.is_finite()) {
            return Ticks { ticks: Vec::new(), power: 0 };
        }
        let rough = span / count.max(1) as f64;
        let magnitude = 10f64.powi(rough.log10().floor() as i32);
        let step =
            [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * magnitude >= 0.8 * rough).unwrap_or(10.0) * magnitude;
        let greatest = self.low.abs().max(self.high.abs());
        let size = greatest.log10().floor() as i32;
        let power = if (-3..5).contains(&size) { 0 } else { size };
        let unit = 10f64.powi(power);
        let decimals = usize::try_from(-((step / unit * 1.000_001).log10().floor() as i32)).unwrap_or(0);
        let (first, last) = ((self.low / step - 1e-6).ceil() as i64, (self.high / step + 1e-6).floor() as i64);
        let ticks = (first..=last.min(first + 100)).map(|place| {
            let value = place as f64 * step;
            let text = format!("{:.decimals$}", (value / unit).abs());
            let minus = if place < 0 { "−" } else { "" };
            Tick { fraction: self.fraction(value), label: Some(format!("{minus}{text}")) }
        });
        Ticks { ticks: ticks.collect(), power }
    }

    fn powers(&self, count: usize) -> Ticks {
        // Decimals from 0.001 to 9999, with room for rounding.
        let as_powers = self.low < 0.999e-3 || self.high > 9999.0;
        let (first, last) = (self.low.log10() - 1e-6, self.high.log10() + 1e-6);
        let (lowest, highest) = (first.floor() as i32, last.ceil() as i32);
        let decades = (first.ceil() as i32..=last.floor() as i32).count();
        // With few powers of ten inside, other digits get labels too.
        let digits: &[u32] = match decades {
            0 | 1 if last - first < 0.55 => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
            0 | 1 => &[1, 2, 3, 5],
            2 if count > 3 => &[1, 3],
            _ => &[1],
        };
        let every = decades.div_ceil(count.max(1)).max(1) as i32;
        let mut ticks = Vec::new();
        for power in lowest..=highest {
            for digit in 1..=9_u32 {
                let value = f64::from(digit) * 10f64.powi(power);
                let place = value.log10();
                if place < first || place > last {
                    continue;
                }
                let is_labelled = digits.contains(&digit) && power.rem_euclid(every) == 0;
                if !is_labelled && (decades > 12 || (digit > 1 && every > 1)) {
                    continue;
                }
                let text = || {
                    if !as_powers {
                        label::number(value)
                    } else if digit == 1 {
                        format!("10^{{{}}}", label::signed(power))
                    } else {
                        format!("{digit}×10^{{{}}}", label::signed(power))
                    }
                };
                ticks.push(Tick { fraction: self.fraction(value), label: is_labelled.then(text) });
            }
        }
        Ticks { ticks, power: 0 }
    }
}

/// The least and the greatest value; `(inf, -inf)` without values.
pub fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// The greatest of the values that are rounded zeros; 0 if there are none.
fn rounding(values: &[f64], high: f64) -> f64 {
    // Decades below the greatest value; doubles have fewer than 640.
    let decade = |value: f64| (high.log10() - value.log10()).floor().clamp(0.0, 639.0) as usize;
    let mut used = [false; 640];
    values.iter().filter(|value| **value > 0.0).for_each(|value| used[decade(*value)] = true);
    let used: Vec<usize> = (0..used.len()).filter(|&decade| used[decade]).collect();
    let Some(gap) = used.windows(2).find(|pair| pair[1] - pair[0] > EMPTY_DECADES) else { return 0.0 };
    let zeros = values.iter().copied().filter(|value| *value <= ROUNDING_RTOL * high && decade(*value) >= gap[1]);
    zeros.fold(0.0, f64::max)
}

/// Whether ascending values are better shown on a logarithmic scale: their ratios are equal, or their range is large.
pub fn is_logarithmic(values: &[f64]) -> bool {
    let (Some(&low), Some(&high)) = (values.first(), values.last()) else { return false };
    if low <= 0.0 || values.len() < 2 {
        return false;
    }
    if values.len() >= 4 {
        let uneven = |steps: &[f64]| {
            let mean = steps.iter().sum::<f64>() / steps.len() as f64;
            steps.iter().fold(0.0_f64, |worst, step| worst.max((step / mean - 1.0).abs()))
        };
        let ratios: Vec<f64> = values.windows(2).map(|pair| (pair[1] / pair[0]).ln()).collect();
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if uneven(&steps) < 1e-3 {
            return false;
        }
        if uneven(&ratios) < 1e-3 {
            return high / low > 3.0;
        }
    }
    // For uneven values, such as samples, about half should be left of the middle. A linear axis would squeeze a quarter of
    // values that are far below the greatest.
    let scale = |log| Scale { low, high, log };
    let off = |log: bool| (scale(log).fraction(values[values.len() / 2]) - 0.5).abs();
    let are_squeezed = values[values.len() / 4] * LOG_RATIO <= high;
    high / low >= LOG_RATIO && (values.len() < 4 || are_squeezed || off(true) <= off(false))
}

#[cfg(test)]
mod tests {
    //! Ticks in their final form.

    use super::*;

    fn labels(scale: Scale, count: usize) -> Vec<String> {
        scale.ticks(count).ticks.into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        let scale = |low, high| Scale { low, high, log: false };
        assert_eq!(labels(scale(-0.5, 0.5), 5), ["−0.4", "−0.2", "0.0", "0.2", "0.4"]);
        assert_eq!(labels(scale(0.0, 100.0), 5), ["0", "20", "40", "60", "80", "100"]);
        let small = scale(0.0, 3.1e-6).ticks(4);
        assert_eq!(small.power, -6);
        assert_eq!(
            small.ticks.iter().filter_map(|tick| tick.label.as_deref()).collect::<Vec<_>>(),
            ["0", "1", "2", "3"]
        );
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        let scale = |low, high| Scale { low, high, log: true };
        assert_eq!(labels(scale(1e-7, 1.0), 4), ["10^{−6}", "10^{−4}", "10^{−2}", "10^{0}"]);
        assert_eq!(labels(scale(0.01, 10.0), 4), ["0.01", "0.1", "1", "10"]);
        assert_eq!(labels(scale(3.0, 7.0), 4), ["3", "4", "5", "6", "7"]);
        // One format for each scale: no 0.01 together with powers of ten.
        assert_eq!(labels(scale(1e-3, 1e3), 7), ["0.001", "0.01", "0.1", "1", "10", "100", "1000"]);
        assert_eq!(labels(scale(15.0, 200.0), 4), ["20", "30", "50", "100", "200"]);
        assert_eq!(labels(scale(100.0, 1e4), 4), ["10^{2}", "10^{3}", "10^{4}"]);
        assert_eq!(labels(scale(1e-4, 1.0), 5), ["10^{−4}", "10^{−3}", "10^{−2}", "10^{−1}", "10^{0}"]);
    }

    #[test]
    fn zeros_made_of_rounding_errors_do_not_stretch_a_logarithm() {
        let log = |low, high| Some(Scale { low, high, log: true });
        assert_eq!(Scale::of([1e-14, 3e-16, 0.02, 0.5, 3.0]), log(0.02, 3.0));
        // Without these zeros the scale is linear.
        assert_eq!(Scale::of([1e-14, 1.0, 3.0]), Some(Scale { low: 1e-14, high: 3.0, log: false }));
        // A curve that decreases step by step is not zero, and neither is a small number near a similar one.
        assert_eq!(Scale::of([1.0, 1e-5, 1e-10, 1e-15]), log(1e-15, 1.0));
        assert_eq!(Scale::of([1.0, 1e-8]), log(1e-8, 1.0));
        // With zeros, values over a few decades have a linear scale, values over many decades a logarithmic one.
        assert_eq!(Scale::of([0.0, 1e-3, 1.0, 10.0]), Some(Scale { low: 0.0, high: 10.0, log: false }));
        assert_eq!(Scale::of([0.0, 1e-10, 1e-4, 1.0]), log(1e-10, 1.0));
    }

    #[test]
    fn geometric_axes_are_logarithmic_and_linear_ones_are_not() {
        assert!(is_logarithmic(&[1.0, 2.0, 4.0, 8.0]));
        assert!(!is_logarithmic(&[1.0, 34.0, 67.0, 100.0]));
        assert!(!is_logarithmic(&[0.0, 1.0, 100.0]));
        assert!(is_logarithmic(&[1.0, 100.0]));
        assert!(is_logarithmic(&[1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]));
        assert!(!is_logarithmic(&[1.0, 20.0, 38.0, 52.0, 67.0, 83.0, 100.0]));
        // Materials whose values span decades, half of them near the greatest.
        assert!(is_logarithmic(&[1.0, 2.0, 3.0, 500.0, 600.0, 700.0, 1000.0]));
    }
}
