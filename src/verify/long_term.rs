//! The long-term behaviour of a block after a step: following cycle by cycle, and the closed cycle.

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
    /// Over how long it cannot be distinguished from its neighbours.
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

/// The end that was found.
#[derive(Debug, Clone, Copy)]
pub enum LongTermBehaviour {
    /// Since when it is settled, how fast `ln v` changed then, and how close an earlier turn came to the edge of the band.
    Settled {
        time: f64,
        speed: f64,
        margin: f64,
    },
    Cycle(Cycle),
    /// The velocity grows without bound.
    Infinite,
}

/// A response as far as it was followed.
#[derive(Debug, Clone, Copy)]
pub struct Simulation {
    pub long_term: Result<LongTermBehaviour, &'static str>,
    /// Extremes since `v = v_f` was first met.
    pub high: Option<Extremum>,
    pub low: Option<Extremum>,
    /// When it was left.
    pub t: f64,
}

/// Legs of one cycle.
const MOST_LEGS: u32 = 5_000;

/// Velocities beyond `e^this v_f` without mass count as infinite.
const ENDLESS: f64 = 60.0;

/// Within this distance from steady sliding that is stable nothing happens any more, nor within a fraction of what is to be reported.
const QUIET: f64 = 1e-5;
const UNTOLD: f64 = 0.1;

/// Swings within this fraction of the band stay in it.
const INSIDE: f64 = 0.3;

/// A section this close to that of the limit cycle, in `ln p` and `y`, has come to it; as many cycles may be left, and
/// closer ones that come to it slowly come to it from one side.
const ARRIVED: f64 = 1e-7;
const MOST_LEFT: usize = 60;
const SLOW: f64 = 0.8;

const TOO_LONG: &str = "responses too long or too stiff for an explicit integrator";

/// Follows the response from `e^x v_f` to its end, whose numbers are to be known to `rtol`.
pub fn follow(block: &Block, stable: bool, x: f64, rtol: f64) -> Simulation {
    let quiet = QUIET.min(UNTOLD * rtol);
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
        if block.mu == 0.0 && here.x > ENDLESS {
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
                        let small = high < INSIDE * edges[1] && low > INSIDE * edges[0];
                        if stable && sections.len() > 1 && small && range < last_range {
                            return watch.settled();
                        }
                        (high, low, last_range) = (0.0, 0.0, range);
                        if found.is_none() && sections.len() > next_try {
                            next_try *= 2;
                            found = limit(block, &sections).map(|cycle| (cycle, sections.len()));
                        }
                        // What comes before may go further than the limit cycle.
                        if let Some((cycle, since)) = found {
                            let far = (here.p.ln() - cycle.section[0]).hypot(here.y - cycle.section[1]);
                            if far < ARRIVED || cycle.fraction > SLOW || sections.len() > since + MOST_LEFT {
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

/// From one section to the next: where it is met, how long that takes, and the extremes on the way.
fn cycle(block: &Block, p: f64, y: f64) -> Option<(BlockState, f64, f64)> {
    let mut here = block.section(p, y);
    let (mut high, mut low) = (0.0f64, 0.0f64);
    // The section that it starts from may be met by rounding.
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

/// A relative change of the section for its derivatives.
const NUDGE: f64 = 1e-5;

/// Steps of Newton's method, and the longest of them.
const MOST_STEPS: u32 = 12;
const LONGEST: f64 = 0.5;

/// The cycle that closes near the last of these sections, if they come to it: Newton's method for the section, in `ln p` and
/// `y`.
fn limit(block: &Block, sections: &[BlockState]) -> Option<Cycle> {
    let [.., before, last] = sections else { return None };
    let motion = (last.p / before.p).ln();
    if motion.is_nan() || motion.abs() > LONGEST {
        return None;
    }
    let (mut ln_p, mut y) = (last.p.ln(), last.y);
    let map = |ln_p: f64, y: f64| {
        let (end, high, low) = cycle(block, ln_p.exp(), y)?;
        Some(([end.p.ln(), end.y], end.t, high, low))
    };
    for _ in 0..MOST_STEPS {
        let (to, period, high, low) = map(ln_p, y)?;
        let [by_p, by_y] = [map(ln_p + NUDGE, y)?.0, map(ln_p, y + NUDGE)?.0];
        let [[pp, yp], [py, yy]] = [by_p, by_y].map(|moved| [(moved[0] - to[0]) / NUDGE, (moved[1] - to[1]) / NUDGE]);
        let miss = [to[0] - ln_p, to[1] - y];
        let determinant = (1.0 - pp) * (1.0 - yy) - py * yp;
        let step =
            [((1.0 - yy) * miss[0] + py * miss[1]) / determinant, (yp * miss[0] + (1.0 - pp) * miss[1]) / determinant];
        let size = step[0].hypot(step[1]);
        if !size.is_finite() {
            return None;
        }
        let fraction = (LONGEST / size).min(1.0);
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
