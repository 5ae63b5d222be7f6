//! `gap`: the landscape of the cubic shortcuts and their distance from the optimum.
//!
//! A part is computed transition by transition, in any order of its axes. Rows of one transition and duration share one landscape and one
//! optimal protocol. Threads evaluate them in chunks.

use std::ops::Range;
use std::sync::OnceLock;

use super::failpoint;
use super::optimum_cache::{LAW_AXES, cached_optimum, least_work, transition, work_error};
use super::rows::{RowChunk, in_chunks};
use super::{Column, ColumnBuffer, Job, Projection, RunStats, Stopped, Table};
use crate::grid::Quantity::{A, Alpha2, Alpha3, B, FinalVelocity, InitialVelocity, Law, Time, VelocityCeiling};
use crate::grid::{Point, Quantity, Runs, Scale, View};
use crate::model::{Friction, Transition};
use crate::numerics::double_double::DoubleDouble;
use crate::protocol::cubic::{CubicPoint, Landscape, LandscapeBuffers};
use crate::protocol::optimal::Bounds;
use crate::protocol::{SolverStats, Status, error};

const WORK_OPTIMAL: usize = 1;
/// Index of the column `gap`.
pub(super) const WORK_GAP: usize = 2;
const WORK_ERROR: usize = 4;
const GAP_ERROR: usize = 5;

pub(super) const COLUMNS: &[Column] = &[
    Column::number("work", "mu_0 sigma l", "work of friction W_s of the shortcut"),
    Column::number(
        "work_optimal",
        "mu_0 sigma l",
        "least work of friction W* of any protocol, under v_ceiling if there is one; if none exists, the row is infeasible",
    ),
    Column::number("gap", "1", "(W_s - W*)/W*; error up to rtol (1 + gap)"),
    Column::number("v_min", "v_0", "least velocity of the shortcut"),
    Column::number("work_error", "mu_0 sigma l", "error bound of work, by a second quadrature").optional(),
    Column::number("gap_error", "1", "error bound of gap, by a second quadrature and a second optimum").optional(),
    Column::number("v_max", "v_0", "greatest velocity of the shortcut, which v_ceiling does not bound").optional(),
];

/// Rows of a chunk. Chosen: a run stops within a fraction of a second at any accuracy.
const CHUNK: usize = 1 << 13;

/// One row for each shortcut, under the laws of a grid with the axis `law`.
pub static GAP: Table = Table {
    axes: &[Time, A, B, Law, InitialVelocity, FinalVelocity, VelocityCeiling, Alpha2, Alpha3],
    needs_optimum: |_, _| false,
    compute: compute_with_laws,
    ..GAP_OF_AGEING
};

/// One row for each shortcut, with ageing and without ceilings.
pub const GAP_OF_AGEING: Table = Table {
    name: "gap",
    doc: "the work of a cubic shortcut and its gap to the optimum",
    axes: &[Time, A, B, InitialVelocity, FinalVelocity, Alpha2, Alpha3],
    columns: COLUMNS,
    rows_per_part: 1 << 18,
    cost: 100,
    needs_optimum: |projection, _| needs_optimum(projection),
    compute,
};

fn needs_optimum(projection: &Projection) -> bool {
    projection.has_any([WORK_OPTIMAL, WORK_GAP, GAP_ERROR])
}

pub(super) fn compute(job: &Job<'_>, rows: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    compute_by(job, prepare, rows, buffer)
}

fn compute_with_laws(job: &Job<'_>, rows: Range<u64>, buffer: &mut ColumnBuffer) -> Result<RunStats, Stopped> {
    compute_by(&Job { tuples: job.rows.tuples(LAW_AXES), ..*job }, prepare_with_law, rows, buffer)
}

/// Prepares the landscape of a group from one of its points.
type Prepare = fn(&Job<'_>, &LandscapeRows, &Point, &mut RunStats) -> PreparedLandscape;

fn compute_by(
    job: &Job<'_>,
    prepare: Prepare,
    rows: Range<u64>,
    buffer: &mut ColumnBuffer,
) -> Result<RunStats, Stopped> {
    let view = job.rows.view(rows.clone());
    let (groups, order) = groups(&view, job, &rows);
    let coefficients = Coefficients::new(job, view, &rows, order.as_deref());
    let work = in_chunks(job, buffer, CHUNK, |chunk| evaluate((job, prepare), &groups, &coefficients, chunk))?;
    if let Some(order) = order {
        scatter(buffer, &order);
    }
    let sizes = job.projection.indices().iter().map(|&index| COLUMNS[index].size(job.grid));
    for (column, size) in buffer.columns.iter_mut().zip(sizes).filter(|(_, size)| *size != 1.0) {
        column.iter_mut().for_each(|cell| *cell *= size);
    }
    Ok(work)
}

/// Rows of one transition and duration, contiguous in the order of computation.
struct LandscapeRows {
    tuple: u64,
    /// One of its rows.
    row: u64,
    /// Where its rows are in the order of computation.
    places: Range<usize>,
    prepared: OnceLock<PreparedLandscape>,
}

#[derive(Default)]
struct PreparedLandscape {
    /// `None` if no protocol with `v >= 1` is fast enough: every row is infeasible.
    landscape: Option<Landscape>,
    /// The landscape at the tightest tolerance, its transition and duration, if error bounds are requested.
    finest: Option<(Landscape, Transition, f64)>,
    /// Status and `W*` of the optimal protocol, if requested.
    optimum: Option<(Status, Option<f64>)>,
    /// Error bound of `W*`, if requested.
    error_optimal: f64,
}

impl PreparedLandscape {
    /// Whether the rounding of the coefficients matters to a shortcut of its landscape, of this status and least velocity. Error bounds do not count
    /// this rounding.
    fn depends_on_rounding(&self, landscape: &Landscape, place: [f64; 2], status: Status, v_min: f64) -> bool {
        self.finest.is_some() && status != Status::Infeasible || landscape.depends_on_rounding(place, status, v_min)
    }

    /// The shortcut with exact coefficients, and the error bound of its work: NaN if it is not requested.
    fn exact(
        &self,
        landscape: &Landscape,
        job: &Job<'_>,
        place: [DoubleDouble; 2],
        work: &mut RunStats,
    ) -> (CubicPoint, f64) {
        let mut stats = SolverStats::default();
        let mut point = |of: &Landscape, rtol| of.point(place, job.friction, rtol, &mut stats);
        let found = point(landscape, job.rtol).unwrap_or(CubicPoint::INFEASIBLE);
        let error = self.finest.as_ref().and_then(|(finest, transition, t_f)| {
            let again = point(finest, error::TIGHTEST_RTOL)?;
            Some(error::of_shortcut(transition, *t_f, found.v_min, found.work, again.work))
        });
        *work += RunStats::from(stats);
        (found, error.unwrap_or(f64::NAN))
    }
}

/// The groups of a part, and the row of each place in the order of computation, if the orders differ.
fn groups(view: &View<'_>, job: &Job<'_>, rows: &Range<u64>) -> (Vec<LandscapeRows>, Option<Vec<u32>>) {
    let mut runs = view.tuples(&job.tuples, rows.clone());
    let order = (!runs.is_sorted_by_key(|(tuple, _)| *tuple)).then(|| {
        runs.sort_by_key(|(tuple, _)| *tuple);
        runs.iter().flat_map(|(_, run)| run.clone()).map(|row| (row - rows.start) as u32).collect()
    });
    let mut groups: Vec<LandscapeRows> = Vec::new();
    let mut place = 0;
    for (tuple, run) in runs {
        let end = place + (run.end - run.start) as usize;
        match groups.last_mut() {
            Some(group) if group.tuple == tuple => group.places.end = end,
            _ => groups.push(LandscapeRows { tuple, row: run.start, places: place..end, prepared: OnceLock::new() }),
        }
        place = end;
    }
    (groups, order)
}

/// The rows of a part, and the coefficients of every place.
struct Coefficients<'a> {
    view: View<'a>,
    first: u64,
    order: Option<&'a [u32]>,
    runs: [Option<Runs>; 2],
    natural: [bool; 2],
    sizes: [f64; 2],
}

const ALPHAS: [Quantity; 2] = [Quantity::Alpha2, Quantity::Alpha3];

impl<'a> Coefficients<'a> {
    fn new(job: &Job<'a>, view: View<'a>, rows: &Range<u64>, order: Option<&'a [u32]>) -> Self {
        let runs = ALPHAS.map(|alpha| view.runs(alpha, rows.clone()));
        let natural = ALPHAS.map(|alpha| job.grid.scale(alpha) == Some(Scale::Model));
        let sizes = ALPHAS.map(|alpha| job.grid.units.size(alpha.unit(Scale::Model)));
        Coefficients { view, first: rows.start, order, runs, natural, sizes }
    }

    /// The row at a place in the order of computation.
    fn row(&self, place: usize) -> u64 {
        self.first + self.order.map_or(place as u64, |order| order[place].into())
    }

    /// `alpha_2 t_f` and `alpha_3 t_f^2` at `places`, all of one duration, in double precision.
    fn values(&self, places: Range<usize>, t_f: f64) -> [Vec<f64>; 2] {
        [0, 1].map(|i| {
            let Some(runs) = &self.runs[i] else { return Vec::new() };
            let mut values = match self.order {
                None => runs.cells(self.row(places.start)..self.row(places.end)),
                Some(_) => places.clone().map(|place| runs.values()[runs.step_of(self.row(place))]).collect(),
            };
            if self.natural[i] {
                let unit = self.unit(i, t_f).high;
                values.iter_mut().for_each(|value| *value *= unit);
            }
            values
        })
    }

    /// What turns a coefficient in natural units into that relative to the duration.
    fn unit(&self, i: usize, t_f: f64) -> DoubleDouble {
        let time = DoubleDouble::new(t_f);
        let power = if i == 0 { time } else { time * time };
        power / DoubleDouble::new(self.sizes[i])
    }

    /// `alpha_2 t_f` and `alpha_3 t_f^2` at a place, to 32 digits.
    fn exact(&self, place: usize, t_f: f64) -> [DoubleDouble; 2] {
        [0, 1].map(|i| {
            let value = self.runs[i].as_ref().map_or(0.0, |runs| runs.values()[runs.step_of(self.row(place))]);
            let value = DoubleDouble::new(value);
            if self.natural[i] { value * self.unit(i, t_f) } else { value }
        })
    }
}

/// Computes a chunk, which has places of one or several groups, group by group.
fn evaluate(
    (job, prepare): (&Job<'_>, Prepare),
    groups: &[LandscapeRows],
    coefficients: &Coefficients<'_>,
    chunk: RowChunk<'_>,
) -> RunStats {
    let RowChunk { place: start, columns: requested, status } = chunk;
    // A column that is not requested is empty.
    let mut columns = [(); COLUMNS.len()].map(|()| <&mut [f64]>::default());
    for (column, &index) in requested.into_iter().zip(job.projection.indices()) {
        column.fill(f64::NAN);
        columns[index] = column;
    }
    let is_rounded = coefficients.natural.contains(&true);
    let (mut work_buffer, mut v_min_buffer, mut error_buffer) = (Vec::new(), Vec::new(), Vec::new());
    let mut work = RunStats::default();
    let end = start + status.len();
    let first_group = groups.partition_point(|group| group.places.end <= start);
    for group in groups[first_group..].iter().take_while(|group| group.places.start < end) {
        let places = group.places.start.max(start)..group.places.end.min(end);
        failpoint::panic_at(places.clone().map(|place| coefficients.row(place)));
        let (length, cells) = (places.len(), places.start - start..places.end - start);
        let status = &mut status[cells.clone()];
        let point = job.grid.scaled(&coefficients.view.point(group.row));
        let prepared = group.prepared.get_or_init(|| prepare(job, group, &point, &mut work));
        let t_f = point[Quantity::Time];
        let [a_2, a_3] = coefficients.values(places.clone(), t_f);

        let Some(landscape) = &prepared.landscape else {
            status.fill(Status::Infeasible);
            continue;
        };

        let [work_s, work_optimal, gap, v_min, work_error, gap_error, v_max] =
            columns.each_mut().map(|column| column.get_mut(cells.clone()).unwrap_or_default());
        let with_work = !gap.is_empty() || prepared.finest.is_some();
        let works = if work_s.is_empty() && with_work { buffer(&mut work_buffer, length) } else { work_s };
        let v_min = if v_min.is_empty() { buffer(&mut v_min_buffer, length) } else { v_min };
        let out = LandscapeBuffers { work: &mut *works, v_min: &mut *v_min, status: &mut *status };
        work += RunStats::from(landscape.evaluate(&a_2, &a_3, out));
        if job.friction == Friction::Regularised {
            let out = LandscapeBuffers { work: &mut *works, v_min: &mut *v_min, status: &mut *status };
            work += RunStats::from(landscape.regularise(&a_2, &a_3, job.rtol, out));
        }
        let errors = if work_error.is_empty() { buffer(&mut error_buffer, length) } else { work_error };
        if let Some((finest, transition, t_f)) = &prepared.finest {
            let mut again = status.to_vec();
            let out = LandscapeBuffers { work: &mut *errors, v_min: &mut [], status: &mut again };
            work += RunStats::from(finest.evaluate(&a_2, &a_3, out));
            for ((error, &work_s), &v_min) in errors.iter_mut().zip(&*works).zip(&*v_min) {
                *error = error::of_shortcut(transition, *t_f, v_min, work_s, *error);
            }
        }
        landscape.greatest_velocities(&a_2, &a_3, status, v_max);
        for i in (0..length).filter(|_| is_rounded) {
            let rounded = [a_2[i], a_3[i]];
            if !prepared.depends_on_rounding(landscape, rounded, status[i], v_min[i]) {
                continue;
            }
            let place = coefficients.exact(places.start + i, t_f);
            let (exact, error) = prepared.exact(landscape, job, place, &mut work);
            status[i] = exact.status;
            let cells = [works.get_mut(i), v_min.get_mut(i), v_max.get_mut(i), errors.get_mut(i)];
            for (cell, value) in cells.into_iter().zip([exact.work, exact.v_min, exact.v_max, error]) {
                cell.into_iter().for_each(|cell| *cell = value);
            }
        }

        compare(prepared, status, [works, v_min, work_optimal, gap, gap_error], errors);
    }
    work
}

/// Removes rows of a group that did not converge, and compares the works of the others, with these errors, with the optimum. A column that is not
/// requested is empty.
fn compare(
    prepared: &PreparedLandscape,
    status: &mut [Status],
    [works, v_min, work_optimal, gap, gap_error]: [&mut [f64]; 5],
    errors: &[f64],
) {
    for (i, status) in status.iter().enumerate() {
        if *status == Status::NotConverged {
            [works.get_mut(i), v_min.get_mut(i)].into_iter().flatten().for_each(|cell| *cell = f64::NAN);
        }
    }
    let Some((optimum, value)) = prepared.optimum else { return };
    for (i, status) in status.iter_mut().enumerate() {
        if matches!(status, Status::Infeasible | Status::NotConverged) {
            continue;
        }
        if let Some(value) = value {
            if let Some(cell) = work_optimal.get_mut(i) {
                *cell = value;
            }
            if let Some(cell) = gap.get_mut(i) {
                *cell = (works[i] - value) / value;
            }
            if let Some(cell) = gap_error.get_mut(i) {
                *cell = error::of_gap((works[i], errors[i]), (value, prepared.error_optimal));
            }
        }
        *status = status.compared_with(optimum);
    }
}

fn buffer(buffer: &mut Vec<f64>, length: usize) -> &mut [f64] {
    buffer.clear();
    buffer.resize(length, f64::NAN);
    buffer
}

fn prepare(job: &Job<'_>, group: &LandscapeRows, point: &Point, work: &mut RunStats) -> PreparedLandscape {
    if job.bounded && point[Quantity::Time] < transition(point).min_duration() {
        return PreparedLandscape::default();
    }
    let mut error_optimal = f64::NAN;
    let optimum = needs_optimum(job.projection).then(|| {
        let solved = cached_optimum(job, (group.tuple, point), work);
        if let Some(optimum) = solved.value.filter(|_| job.projection.has(GAP_ERROR)) {
            error_optimal = work_error(point, &Bounds::new(job.bounded), &optimum, work);
        }
        (solved.status, solved.value.map(|optimum| optimum.work))
    });
    PreparedLandscape { optimum, error_optimal, ..landscapes(job, point, work) }
}

/// [`prepare`] under the law and the velocity ceiling of the point.
fn prepare_with_law(job: &Job<'_>, _: &LandscapeRows, point: &Point, work: &mut RunStats) -> PreparedLandscape {
    let least = least_work(job, point, job.projection.has(GAP_ERROR), work);
    if least.status == Status::Infeasible {
        return PreparedLandscape::default();
    }
    let optimum = Some((least.status, least.value.map(|(work, _)| work)));
    let error_optimal = least.value.map_or(f64::NAN, |(_, error)| error);
    PreparedLandscape { optimum, error_optimal, ..landscapes(job, point, work) }
}

/// The landscapes of a point, not yet compared with an optimum.
fn landscapes(job: &Job<'_>, point: &Point, work: &mut RunStats) -> PreparedLandscape {
    work.landscapes += 1;
    let (transition, t_f) = (transition(point), point[Quantity::Time]);
    let landscape = |rtol| Landscape::under(point.state_law(), &transition, t_f, rtol);
    let has_errors = job.projection.has_any([WORK_ERROR, GAP_ERROR]);
    let finest = has_errors.then(|| (landscape(error::TIGHTEST_RTOL), transition, t_f));
    PreparedLandscape { landscape: Some(landscape(job.rtol)), finest, ..PreparedLandscape::default() }
}

/// Sorts a buffer from the order of computation into the order of rows.
fn scatter(buffer: &mut ColumnBuffer, order: &[u32]) {
    for column in &mut buffer.columns {
        let computed = column.clone();
        for (value, &row) in computed.into_iter().zip(order) {
            column[row as usize] = value;
        }
    }
    let computed = buffer.status.clone();
    for (status, &row) in computed.into_iter().zip(order) {
        buffer.status[row as usize] = status;
    }
}
