//! The long-term behaviour of a block after a step: integration cycle by cycle, and the closed cycle.

use super::block_motion::{Block, BlockState, Event};

/// `ln(v/v_f)` at the edges of the band of settled velocities, 1 % about `v_f`.
fn band() -> [f64; 2] {
    [(-0.01f64).ln_1p(), 0.01f64.ln_1p()]
}

/// An extremum.
#[derive(Debug, Clone, Copy)]
pub struct Extremum {
    /// `ln(v/v_f)`.
    pub x: f64,
    pub t: f64,
    /// Time over which it cannot be distinguished from its neighbours.
    pub flatness: f64,
}

/// A limit cycle.
#[derive(Debug, Clone, Copy)]
pub struct Cycle {
    pub period: f64,
    pub high: f64,
    pub low: f64,
    /// The Floquet multiplier of the cycle.
    pub fraction: f64,
    /// `ln p` and `y` on the section.
    section: [f64; 2],
}

/// The long-term behaviour.
#[derive(Debug, Clone, Copy)]
pub enum LongTermBehaviour {
    /// Time since which it is settled, rate of change of `ln v` then, and least distance of an earlier turn from the edge of the band.
    Settled {
        time: f64,
        speed: f64,
        margin: f64,
    },
    Cycle(Cycle),
    /// The velocity grows without bound.
    Infinite,
}

/// A response as far as it was integrated.
#[derive(Debug, Clone, Copy)]
pub struct Simulation {
    pub long_term: Result<LongTermBehaviour, &'static str>,
    /// Extremes since `v` first reached `v_f`.
    pub high: Option<Extremum>,
    pub low: Option<Extremum>,
    /// Time at which integration ended.
    pub t: f64,
}

/// Legs of one cycle.
const MOST_LEGS: u32 = 5_000;

/// `ln(v/v_f)` beyond which the velocity of a block without mass counts as infinite.
const MAX_LN_VELOCITY_RATIO: f64 = 60.0;

/// Distance from stable steady sliding within which a response has settled, and the same as a fraction of `rtol`.
const SETTLED_DISTANCE: f64 = 1e-5;
const SETTLED_RTOLS: f64 = 0.1;

/// Fraction of the band of settled velocities in which a response stays once it is there.
const BAND_FRACTION: f64 = 0.3;

/// Distance from the section of the limit cycle, in `ln p` and `y`, within which a response has reached it; greatest number of
/// cycles left; and ratio of successive distances above which a response approaches it from one side.
const CYCLE_DISTANCE: f64 = 1e-7;
const MAX_CYCLES_LEFT: usize = 60;
const MAX_CONVERGENCE_RATIO: f64 = 0.8;

const TOO_LONG: &str = "responses too long or too stiff for an explicit integrator";

/// Follows the response from `e^x v_f` to its end, whose numbers are to be known to `rtol`.
pub fn follow(block: &Block, stable: bool, x: f64, rtol: f64) -> Simulation {
    let quiet = SETTLED_DISTANCE.min(SETTLED_RTOLS * rtol);
    let mut watch = Watch {
        simulation: Simulation { long_term: Err(TOO_LONG), high: None, low: None, t: 0.0 },
        since: None,
        edge: 1.0,
    };
    let edges = band();
    let inside = |x: f64| x > edges[0] && x < edges[1];
    let levels = [edges[0], 0.0, edges[1]];
    let mut here = block.steady(x);
    watch.since = inside(x).then_some((0.0, f64::INFINITY));
    let mut met = false;
    let mut sections: Vec<BlockState> = Vec::new();
    // Extremes since the last section.
    let (mut high, mut low) = (0.0f64, 0.0f64);
    let mut last_range = f64::INFINITY;
    let mut next_try = 2;
    let mut found: Option<(Cycle, usize)> = None;
    loop {
        let Some((end, events)) = block.leg(here, &levels) else { return watch.simulation };
        here = end;
        watch.simulation.t = here.t;
        if block.mu == 0.0 && here.x > MAX_LN_VELOCITY_RATIO {
            watch.simulation.long_term = Ok(LongTermBehaviour::Infinite);
            return watch.simulation;
        }
        for event in events {
            match event {
                Event::Turn { here, top } => {
                    let distance = edges.iter().map(|edge| (here.x - edge).abs()).fold(f64::INFINITY, f64::min);
                    watch.edge = watch.edge.min(distance);
                    (high, low) = (high.max(here.x), low.min(here.x));
                    let kept = if top { &mut watch.simulation.high } else { &mut watch.simulation.low };
                    let further = |kept: &Extremum| if top { here.x > kept.x } else { here.x < kept.x };
                    if met && kept.as_ref().is_none_or(further) {
                        let flatness = if top { block.flatness(&here).unwrap_or(f64::INFINITY) } else { 0.0 };
                        *kept = Some(Extremum { x: here.x, t: here.t, flatness });
                    }
                }
                Event::Pass { here, level: 0.0, up } => {
                    met = true;
                    if up {
                        sections.push(here);
                        let range = high - low;
                        let small = high < BAND_FRACTION * edges[1] && low > BAND_FRACTION * edges[0];
                        if stable && sections.len() > 1 && small && range < last_range {
                            return watch.settled();
                        }
                        (high, low, last_range) = (0.0, 0.0, range);
                        if found.is_none() && sections.len() > next_try {
                            next_try *= 2;
                            found = limit(block, &sections).map(|cycle| (cycle, sections.len()));
                        }
                        // Earlier extremes may exceed those of the limit cycle.
                        if let Some((cycle, since)) = found {
                            let far = (here.p.ln() - cycle.section[0]).hypot(here.y - cycle.section[1]);
                            if far < CYCLE_DISTANCE
                                || cycle.fraction > MAX_CONVERGENCE_RATIO
                                || sections.len() > since + MAX_CYCLES_LEFT
                            {
                                watch.simulation.long_term = Ok(LongTermBehaviour::Cycle(cycle));
                                return watch.simulation;
                            }
                        }
                    }
                }
                Event::Pass { here, level, up } => {
                    let enters = (level > 0.0) != up;
                    watch.since = enters.then(|| (here.t, block.speed(&here).abs()));
                }
            }
        }
        if stable && [here.x, here.y, here.p].iter().all(|part| part.abs() < quiet) {
            return watch.settled();
        }
    }
}

struct Watch {
    simulation: Simulation,
    /// The last entry into the band and the speed there; none outside.
    since: Option<(f64, f64)>,
    /// The least distance of a turn from an edge of the band.
    edge: f64,
}

impl Watch {
    fn settled(mut self) -> Simulation {
        if let Some((time, speed)) = self.since {
            self.simulation.long_term = Ok(LongTermBehaviour::Settled { time, speed, margin: self.edge });
        }
        self.simulation
    }
}

/// From one section to the next: place, duration, and extremes between.
fn cycle(block: &Block, p: f64, y: f64) -> Option<(BlockState, f64, f64)> {
    let mut here = block.section(p, y);
    let (mut high, mut low) = (0.0f64, 0.0f64);
    // Rounding may report the section from which it starts.
    let mut left = false;
    for _ in 0..MOST_LEGS {
        let (end, events) = block.leg(here, &[0.0])?;
        here = end;
        for event in events {
            match event {
                Event::Turn { here, top } => {
                    left |= top;
                    (high, low) = (high.max(here.x), low.min(here.x));
                }
                Event::Pass { here, up: true, .. } if left => return Some((here, high, low)),
                Event::Pass { .. } => {}
            }
        }
    }
    None
}

/// Relative step of the section for numerical derivatives.
const SECTION_STEP: f64 = 1e-5;

/// Greatest number of steps of Newton's method, and the longest step.
const MOST_STEPS: u32 = 12;
const MAX_NEWTON_STEP: f64 = 0.5;

/// The closed cycle near the last of these sections, if they converge to it: Newton's method for the section, in `ln p` and `y`.
fn limit(block: &Block, sections: &[BlockState]) -> Option<Cycle> {
    let [.., before, last] = sections else { return None };
    let motion = (last.p / before.p).ln();
    if motion.is_nan() || motion.abs() > MAX_NEWTON_STEP {
        return None;
    }
    let (mut ln_p, mut y) = (last.p.ln(), last.y);
    let map = |ln_p: f64, y: f64| {
        let (end, high, low) = cycle(block, ln_p.exp(), y)?;
        Some(([end.p.ln(), end.y], end.t, high, low))
    };
    for _ in 0..MOST_STEPS {
        let (to, period, high, low) = map(ln_p, y)?;
        let [by_p, by_y] = [map(ln_p + SECTION_STEP, y)?.0, map(ln_p, y + SECTION_STEP)?.0];
        let [[pp, yp], [py, yy]] =
            [by_p, by_y].map(|moved| [(moved[0] - to[0]) / SECTION_STEP, (moved[1] - to[1]) / SECTION_STEP]);
        let miss = [to[0] - ln_p, to[1] - y];
        let determinant = (1.0 - pp) * (1.0 - yy) - py * yp;
        let step =
            [((1.0 - yy) * miss[0] + py * miss[1]) / determinant, (yp * miss[0] + (1.0 - pp) * miss[1]) / determinant];
        let size = step[0].hypot(step[1]);
        if !size.is_finite() {
            return None;
        }
        let fraction = (MAX_NEWTON_STEP / size).min(1.0);
        (ln_p, y) = (ln_p + fraction * step[0], y + fraction * step[1]);
        if size < 1e-9 {
            // The greater multiplier.
            let (half, product) = (0.5 * (pp + yy), pp * yy - py * yp);
            let square = half * half - product;
            let fraction = if square > 0.0 { half.abs() + square.sqrt() } else { product.sqrt() };
            let way = ln_p - last.p.ln();
            let towards = way.abs() < 1e-6 || way * motion > 0.0;
            return (fraction < 1.0 && towards).then_some(Cycle { period, high, low, fraction, section: [ln_p, y] });
        }
    }
    None
}
