//! The sampling of a motion: the fewest points for linear interpolation, or equally spaced points.

use crate::numerics::golden_section::least;
use crate::numerics::root::crossing;
use crate::protocol::{Moment, Motion};

/// Error of linear interpolation between neighbouring moments, relative to the range of the column. Chosen: invisible in a picture.
pub const RANGE_RTOL: f64 = 1e-4;

/// Interpolation error relative to `v` or `theta`. Chosen: smooth on logarithmic axes.
pub const VALUE_RTOL: f64 = 0.01;

/// Number of columns with this tolerance: velocity and theta.
const POSITIVE_COLUMNS: usize = 2;

/// Fraction of both tolerances at the samples. Chosen: the rest is a margin between samples.
const SAMPLES_FRACTION: f64 = 0.98;

/// Change, relative to the greatest value of a column, that counts as rounding. Chosen: nine thousand roundings of 1.1e-16, a hundredth of the default `rtol`.
const ROUNDING_RTOL: f64 = 1e-12;

/// Relative difference of times up to which they are equal. Chosen: eight units in the last place, more than a sum of a few terms loses.
const SAME_TIME_RTOL: f64 = 8.0 * f64::EPSILON;

/// Steps of an interval of the motion; a chord is compared with the motion between them. Chosen: half an interval keeps its samples.
const STEPS: usize = 8;

/// Least length of an interval that is halved, relative to its end. Chosen: its samples are still apart.
const MIN_INTERVAL: f64 = 64.0 * f64::EPSILON;

/// Greatest time, relative to the duration, of an interval that cannot be halved: there the pieces of a motion meet with the errors of their
/// durations. Chosen: the default `rtol`.
const MAX_GAP: f64 = 1e-10;

/// Greatest number of moments; a motion with more cannot be resolved. Chosen: a few hundred megabytes.
const MAX_MOMENTS: usize = 1 << 21;

/// A moment and its position on the curve.
#[derive(Debug, Clone, Copy)]
struct CurvePoint {
    s: f64,
    moment: Moment,
}

/// The samples of a motion, of which a trace shows some.
#[derive(Debug)]
pub struct Samples {
    samples: Vec<CurvePoint>,
    /// Absolute tolerance of linear interpolation of each column, from its range.
    tolerance: [f64; COLUMNS],
}

/// Columns that are interpolated.
const COLUMNS: usize = 5;

fn columns(moment: &Moment) -> [Option<f64>; COLUMNS] {
    [Some(moment.v), Some(moment.theta), Some(moment.friction), moment.v_c, moment.beta]
}

impl Samples {
    /// Halves the intervals between the landmarks of `motion` until linear interpolation is within the tolerance. The states `steady` before and
    /// after count in the range of a column. `None` if a moment is NaN, or if the motion cannot be resolved.
    pub fn of(motion: &dyn Motion, steady: &[Moment]) -> Option<Samples> {
        let landmarks = motion.landmarks();
        let mut pieces = Vec::with_capacity(landmarks.len());
        for pair in landmarks.windows(2) {
            let mut piece = Vec::with_capacity(STEPS + 1);
            for step in 0..=STEPS {
                piece.push(look(motion, pair[0] + (pair[1] - pair[0]) * step as f64 / STEPS as f64)?);
            }
            pieces.push(piece);
        }
        let tolerance = tolerance(pieces.iter().flatten().map(|sample| &sample.moment).chain(steady));
        let mut samples: Vec<CurvePoint> = vec![*pieces.first()?.first()?];
        // The next interval is the last of the list.
        pieces.reverse();
        while let Some(piece) = pieces.pop() {
            let (first, last) = (piece[0], piece[STEPS]);
            if is_even(&piece) && is_straight(&first, &last, &piece[1..STEPS], &tolerance) {
                samples.extend(&piece[1..]);
                if samples.len() > MAX_MOMENTS {
                    return None;
                }
                continue;
            }
            if last.s - first.s < MIN_INTERVAL * last.s {
                if last.moment.t - first.moment.t > MAX_GAP * motion.duration() {
                    return None;
                }
                samples.push(last);
                continue;
            }
            let halve = |half: &[CurvePoint]| {
                let mut finer = vec![half[0]];
                for pair in half.windows(2) {
                    finer.push(look(motion, 0.5 * (pair[0].s + pair[1].s))?);
                    finer.push(pair[1]);
                }
                Some(finer)
            };
            let halves = (halve(&piece[..=STEPS / 2])?, halve(&piece[STEPS / 2..])?);
            pieces.extend([halves.1, halves.0]);
        }
        // Rounding may decrease a time by some units in the last place.
        let mut latest = 0.0_f64;
        for sample in &mut samples {
            latest = latest.max(sample.moment.t).min(motion.duration());
            sample.moment.t = latest;
        }
        samples.first_mut()?.moment.t = 0.0;
        samples.last_mut()?.moment.t = motion.duration();
        Some(Samples { samples, tolerance })
    }

    /// The fewest samples within the tolerance.
    pub fn fewest(&self) -> Vec<Moment> {
        let samples = &self.samples;
        let mut rows = vec![samples[0].moment];
        let mut here = 0;
        while here + 1 < samples.len() {
            let mut next = here + 1;
            while next + 1 < samples.len()
                && is_straight(&samples[here], &samples[next + 1], &samples[here + 1..=next], &self.tolerance)
            {
                next += 1;
            }
            let moment = samples[next].moment;
            // Of moments with equal times the last one is kept.
            if rows.len() > 1 && rows[rows.len() - 1].t == moment.t {
                rows.pop();
            }
            rows.push(moment);
            here = next;
        }
        rows
    }

    /// The least and the greatest velocity of the motion.
    pub fn velocities(&self, motion: &dyn Motion) -> (f64, f64) {
        (-self.greatest(motion, |moment| -moment.v), self.greatest(motion, |moment| moment.v))
    }

    /// The greatest value, by golden section between the neighbours of the greatest sample.
    fn greatest(&self, motion: &dyn Motion, of: impl Fn(&Moment) -> f64) -> f64 {
        let order = |i: &usize, j: &usize| of(&self.samples[*i].moment).total_cmp(&of(&self.samples[*j].moment));
        let top = (0..self.samples.len()).max_by(order).unwrap_or(0);
        let ends = (self.samples[top.saturating_sub(1)].s, self.samples[(top + 1).min(self.samples.len() - 1)].s);
        (-least(|s| -of(&motion.at(s)), ends).1).max(of(&self.samples[top].moment))
    }
}

/// The moments at `count >= 2` equally spaced times from 0 to `t_f`. `None` as for [`Samples::of`].
pub fn spaced(motion: &dyn Motion, count: usize) -> Option<Vec<Moment>> {
    let (t_f, marks) = (motion.duration(), marks(motion)?);
    let mut rows = Vec::with_capacity(count);
    rows.push(Moment { t: 0.0, ..marks.first()?.moment });
    for i in 1..count.saturating_sub(1) {
        let t = t_f * (i as f64 / (count - 1) as f64);
        rows.push(Moment { t, ..meet(motion, t, &marks)?.moment });
    }
    rows.push(Moment { t: t_f, ..marks.last()?.moment });
    Some(rows)
}

/// The place and the moment of `motion` at time `t`. `None` as for [`Samples::of`].
pub fn at_time(motion: &dyn Motion, t: f64) -> Option<(f64, Moment)> {
    let CurvePoint { s, moment } = meet(motion, t, &marks(motion)?)?;
    Some((s, moment))
}

/// The moments at the landmarks.
fn marks(motion: &dyn Motion) -> Option<Vec<CurvePoint>> {
    motion.landmarks().into_iter().map(|s| look(motion, s)).collect()
}

/// The moment at time `t` between two of the `marks`. `None` as for [`Samples::of`].
fn meet(motion: &dyn Motion, t: f64, marks: &[CurvePoint]) -> Option<CurvePoint> {
    let after = marks.partition_point(|mark| mark.moment.t <= t).clamp(1, marks.len().max(2) - 1);
    let (low, high) = (marks.get(after - 1)?, marks.get(after)?);
    let off = |sample: &CurvePoint| sample.moment.t - t;
    let ends = [off(low), off(high)];
    let mut nearest = if -ends[0] < ends[1] { *low } else { *high };
    let mut is_number = true;
    let distance = |s| {
        let Some(sample) = look(motion, s) else {
            is_number = false;
            return 0.0;
        };
        if off(&sample).abs() < off(&nearest).abs() {
            nearest = sample;
        }
        if off(&sample).abs() <= f64::EPSILON * t { 0.0 } else { off(&sample) }
    };
    crossing(distance, [low.s, high.s], ends, f64::EPSILON * high.s);
    is_number.then_some(nearest)
}

fn look(motion: &dyn Motion, s: f64) -> Option<CurvePoint> {
    let moment = motion.at(s);
    let is_number = moment.t.is_finite() && columns(&moment).iter().flatten().all(|value| value.is_finite());
    is_number.then_some(CurvePoint { s, moment })
}

fn tolerance<'a>(moments: impl Iterator<Item = &'a Moment>) -> [f64; COLUMNS] {
    let mut ranges = [(f64::INFINITY, f64::NEG_INFINITY); COLUMNS];
    for moment in moments {
        for (value, (least, greatest)) in columns(moment).into_iter().zip(&mut ranges) {
            if let Some(value) = value {
                (*least, *greatest) = (least.min(value), greatest.max(value));
            }
        }
    }
    let of_range = |(least, greatest): (f64, f64)| {
        (SAMPLES_FRACTION * RANGE_RTOL * (greatest - least)).max(ROUNDING_RTOL * least.abs().max(greatest.abs()))
    };
    ranges.map(of_range)
}

/// Whether no step takes most of the time of an interval, so that points between its ends can be compared.
fn is_even(piece: &[CurvePoint]) -> bool {
    let time = |from: &CurvePoint, to: &CurvePoint| to.moment.t - from.moment.t;
    let whole = time(&piece[0], &piece[STEPS]);
    whole <= SAME_TIME_RTOL * piece[STEPS].moment.t
        || piece.windows(2).all(|pair| time(&pair[0], &pair[1]) <= 0.5 * whole)
}

/// Whether the straight line in time from `from` to `to` is within `tolerance` of the motion at all places `between`.
fn is_straight(from: &CurvePoint, to: &CurvePoint, between: &[CurvePoint], tolerance: &[f64; COLUMNS]) -> bool {
    let time = to.moment.t - from.moment.t;
    if time <= SAME_TIME_RTOL * to.moment.t {
        return true;
    }
    let values = |sample: &CurvePoint| columns(&sample.moment).map(|value| value.unwrap_or(0.0));
    let (start, end) = (values(from), values(to));
    let within = |column: usize, value: f64| match column {
        // Velocity and theta have a relative accuracy at every size.
        0..POSITIVE_COLUMNS => {
            tolerance[column].min((SAMPLES_FRACTION * VALUE_RTOL * value.abs()).max(f64::MIN_POSITIVE))
        }
        _ => tolerance[column],
    };
    between.iter().all(|sample| {
        let fraction = (sample.moment.t - from.moment.t) / time;
        let here = values(sample);
        (0..COLUMNS).all(|i| (start[i] + fraction * (end[i] - start[i]) - here[i]).abs() <= within(i, here[i]))
    })
}
