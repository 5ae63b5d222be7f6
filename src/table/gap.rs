//! `gap`: the landscape of the cubic shortcuts and their distance from the optimum.
//!
//! A part is computed transition by transition, whatever the order of its axes: rows of the same transition and time are brought together,
//! share one landscape and one optimal protocol, and are evaluated in chunks that the threads take one by one.

use std::ops::Range;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::optima::transition;
use super::{Column, Job, Selection, Sheet, Stopped, Table, Work};
use crate::grid::{Point, Quantity, Scale};
use crate::protocol::Status;
use crate::protocol::cubic::{Landscape, Shortcuts};

/// One row a shortcut.
pub struct Gap;

const WORK_OPTIMAL: usize = 1;
const GAP: usize = 2;

const COLUMNS: &[Column] = &[
    Column::number("work", "mu_0 sigma l", "work of friction W_s of the shortcut"),
    Column::number("work_optimal", "mu_0 sigma l", "least work of friction W* of any protocol"),
    Column::number("gap", "1", "(W_s - W*)/W*, good to rtol of 1, not of itself"),
    Column::number("v_min", "v_0", "least velocity of the shortcut"),
];

/// Rows that a thread takes at a time: short enough to stop within a fraction of a second at any accuracy.
const CHUNK: usize = 1 << 11;

impl Table for Gap {
    fn name(&self) -> &'static str {
        "gap"
    }

    fn doc(&self) -> &'static str {
        "the work of a cubic shortcut and its distance from the optimum"
    }

    fn axes(&self) -> &'static [Quantity] {
        &[
            Quantity::Time,
            Quantity::A,
            Quantity::B,
            Quantity::InitialVelocity,
            Quantity::FinalVelocity,
            Quantity::Alpha2,
            Quantity::Alpha3,
        ]
    }

    fn columns(&self) -> &'static [Column] {
        COLUMNS
    }

    fn rows_per_part(&self) -> u64 {
        1 << 18
    }

    fn needs_optimum(&self, selection: &Selection) -> bool {
        selection.has(WORK_OPTIMAL) || selection.has(GAP)
    }

    fn compute(&self, job: &Job<'_>, rows: Range<u64>, sheet: &mut Sheet) -> Result<Work, Stopped> {
        let (groups, order) = groups(job, &rows);
        let coefficients = Coefficients::new(job, &rows, order.as_deref());
        let works = chunks(&groups, sheet, job.selection)
            .into_par_iter()
            // Chunks cost very different times: no thread may keep several to itself while another one is idle.
            .with_max_len(1)
            .map(|chunk| {
                job.signal.check()?;
                let length = chunk.cells.status.len() as u64;
                let work = evaluate(job, &groups, &coefficients, chunk);
                job.signal.advance(length);
                Ok(work)
            })
            .collect::<Result<Vec<Work>, Stopped>>()?;
        if let Some(order) = order {
            scatter(sheet, &order);
        }
        Ok(works.into_iter().sum())
    }
}

/// Rows of one transition and time, side by side in the order of computation.
struct Group {
    tuple: u64,
    /// One of its rows.
    row: u64,
    /// Where its rows are in the order of computation.
    places: Range<usize>,
    prepared: OnceLock<Prepared>,
}

struct Prepared {
    /// `None` where no protocol with `v >= 1` is fast enough, so that every row is infeasible.
    landscape: Option<Landscape>,
    /// Status and `W*` of the optimal protocol, where it is asked for.
    optimum: Option<(Status, Option<f64>)>,
}

/// The groups of a part, and for each place in the order of computation its row, if that is not the order of rows.
fn groups(job: &Job<'_>, rows: &Range<u64>) -> (Vec<Group>, Option<Vec<u32>>) {
    let mut runs: Vec<(u64, Range<u64>)> = Vec::new();
    let mut row = rows.start;
    while row < rows.end {
        let end = ((row / job.tuples.run() + 1).saturating_mul(job.tuples.run())).min(rows.end);
        let tuple = job.tuples.of(row);
        match runs.last_mut() {
            Some((last, run)) if *last == tuple => run.end = end,
            _ => runs.push((tuple, row..end)),
        }
        row = end;
    }
    let in_order = |runs: &[(u64, Range<u64>)]| {
        let mut tuples: Vec<u64> = runs.iter().map(|(tuple, _)| *tuple).collect();
        tuples.sort_unstable();
        tuples.windows(2).all(|pair| pair[0] != pair[1])
    };
    let order = if in_order(&runs) {
        None
    } else {
        runs.sort_by_key(|(tuple, _)| *tuple);
        Some(runs.iter().flat_map(|(_, run)| run.clone()).map(|row| (row - rows.start) as u32).collect())
    };
    let mut groups: Vec<Group> = Vec::new();
    let mut place = 0;
    for (tuple, run) in runs {
        let end = place + (run.end - run.start) as usize;
        match groups.last_mut() {
            Some(group) if group.tuple == tuple => group.places.end = end,
            _ => groups.push(Group { tuple, row: run.start, places: place..end, prepared: OnceLock::new() }),
        }
        place = end;
    }
    (groups, order)
}

/// The coefficients of every place of a part.
struct Coefficients<'a> {
    job: &'a Job<'a>,
    rows: Range<u64>,
    order: Option<&'a [u32]>,
    values: [Vec<f64>; 2],
    natural: [bool; 2],
}

const ALPHAS: [Quantity; 2] = [Quantity::Alpha2, Quantity::Alpha3];

impl<'a> Coefficients<'a> {
    fn new(job: &'a Job<'a>, rows: &Range<u64>, order: Option<&'a [u32]>) -> Self {
        let values = ALPHAS.map(|alpha| job.rows.runs(alpha, rows.clone()).map_or_else(Vec::new, |runs| runs.values()));
        let natural = ALPHAS.map(|alpha| job.grid.scale(alpha) == Some(Scale::Model));
        Coefficients { job, rows: rows.clone(), order, values, natural }
    }

    /// `alpha_2 t_f` and `alpha_3 t_f^2` at `places`, all of one duration.
    fn fill(&self, places: Range<usize>, t_f: f64, out: [&mut Vec<f64>; 2]) {
        for (i, out) in out.into_iter().enumerate() {
            out.clear();
            let Some(runs) = self.job.rows.runs(ALPHAS[i], self.rows.clone()) else { continue };
            let values = &self.values[i];
            match self.order {
                None => {
                    let rows = self.rows.start + places.start as u64..self.rows.start + places.end as u64;
                    for (value, length) in runs.over(rows) {
                        out.resize(out.len() + length, values[value]);
                    }
                }
                Some(order) => out.extend(
                    order[places.clone()]
                        .iter()
                        .map(|&offset| values[runs.step_of(self.rows.start + u64::from(offset))]),
                ),
            }
            if self.natural[i] {
                let unit = if i == 0 { t_f } else { t_f * t_f };
                out.iter_mut().for_each(|value| *value *= unit);
            }
        }
    }
}

/// The cells of consecutive places; a column that is not asked for is empty.
struct Cells<'a> {
    columns: [&'a mut [f64]; COLUMNS.len()],
    status: &'a mut [Status],
}

impl<'a> Cells<'a> {
    fn split(self, at: usize) -> (Cells<'a>, Cells<'a>) {
        let (first, second) = self.status.split_at_mut(at);
        let mut left = Cells { columns: std::array::from_fn(|_| Default::default()), status: first };
        let mut right = Cells { columns: std::array::from_fn(|_| Default::default()), status: second };
        for (i, column) in self.columns.into_iter().enumerate() {
            let middle = at.min(column.len());
            (left.columns[i], right.columns[i]) = column.split_at_mut(middle);
        }
        (left, right)
    }
}

/// What a thread takes at a time: places of one or several groups.
struct Chunk<'a> {
    first_group: usize,
    place: usize,
    cells: Cells<'a>,
}

/// Cuts a part into chunks.
fn chunks<'a>(groups: &[Group], sheet: &'a mut Sheet, selection: &Selection) -> Vec<Chunk<'a>> {
    let mut rest = Cells { columns: std::array::from_fn(|_| Default::default()), status: &mut sheet.status };
    for (column, &index) in sheet.columns.iter_mut().zip(selection.indices()) {
        rest.columns[index] = column;
    }
    let mut chunks = Vec::new();
    let (mut group, mut place) = (0, 0);
    while !rest.status.is_empty() {
        let (cells, others) = {
            let length = rest.status.len();
            rest.split(CHUNK.min(length))
        };
        rest = others;
        while groups[group].places.end <= place {
            group += 1;
        }
        let length = cells.status.len();
        chunks.push(Chunk { first_group: group, place, cells });
        place += length;
    }
    chunks
}

/// Computes a chunk, group by group.
fn evaluate(job: &Job<'_>, groups: &[Group], coefficients: &Coefficients<'_>, chunk: Chunk<'_>) -> Work {
    let Chunk { first_group, mut place, mut cells } = chunk;
    cells.columns.iter_mut().for_each(|column| column.fill(f64::NAN));
    let (mut a_2, mut a_3) = (Vec::with_capacity(CHUNK), Vec::with_capacity(CHUNK));
    let (mut work_buffer, mut v_min_buffer) = (Vec::new(), Vec::new());
    let mut work = Work::default();
    for group in &groups[first_group..] {
        if cells.status.is_empty() {
            break;
        }
        let length = (group.places.end - place).min(cells.status.len());
        let (now, later) = cells.split(length);
        cells = later;
        let point = job.rows.point(group.row);
        let prepared = group.prepared.get_or_init(|| prepare(job, group, &point, &mut work));
        coefficients.fill(place..place + length, point[Quantity::Time], [&mut a_2, &mut a_3]);
        place += length;

        let Some(landscape) = &prepared.landscape else {
            now.status.fill(Status::Infeasible);
            continue;
        };

        let [work_s, work_optimal, gap, v_min] = now.columns;
        let with_gap = !gap.is_empty();
        let works = if work_s.is_empty() && with_gap { buffer(&mut work_buffer, length) } else { work_s };
        let v_min = if v_min.is_empty() { buffer(&mut v_min_buffer, length) } else { v_min };
        let out = Shortcuts { work: &mut *works, v_min: &mut *v_min, status: &mut *now.status };
        work += Work::from(landscape.evaluate(&a_2, &a_3, out));

        for (i, status) in now.status.iter().enumerate() {
            if *status == Status::NotConverged {
                [works.get_mut(i), v_min.get_mut(i)].into_iter().flatten().for_each(|cell| *cell = f64::NAN);
            }
        }
        if let Some((optimum, value)) = prepared.optimum {
            for (i, status) in now.status.iter_mut().enumerate() {
                if matches!(status, Status::Infeasible | Status::NotConverged) {
                    continue;
                }
                if let Some(value) = value {
                    if let Some(cell) = work_optimal.get_mut(i) {
                        *cell = value;
                    }
                    if with_gap {
                        gap[i] = (works[i] - value) / value;
                    }
                }
                if matches!(optimum, Status::Infeasible | Status::Nonphysical | Status::NotConverged) {
                    *status = optimum;
                }
            }
        }
    }
    work
}

fn buffer(buffer: &mut Vec<f64>, length: usize) -> &mut [f64] {
    buffer.clear();
    buffer.resize(length, f64::NAN);
    buffer
}

fn prepare(job: &Job<'_>, group: &Group, point: &Point, work: &mut Work) -> Prepared {
    let (transition, t_f) = (transition(point), point[Quantity::Time]);
    if job.bounded && t_f < transition.least_time() {
        return Prepared { landscape: None, optimum: None };
    }
    work.landscapes += 1;
    let optimum = Gap.needs_optimum(job.selection).then(|| {
        let (solved, spent) = job.optima.get(group.tuple, point);
        *work += spent;
        (solved.status, solved.value.map(|optimum| optimum.work))
    });
    Prepared { landscape: Some(Landscape::new(&transition, t_f, job.rtol)), optimum }
}

/// Brings a sheet from the order of computation into the order of rows.
fn scatter(sheet: &mut Sheet, order: &[u32]) {
    for column in &mut sheet.columns {
        let computed = column.clone();
        for (value, &row) in computed.into_iter().zip(order) {
            column[row as usize] = value;
        }
    }
    let computed = sheet.status.clone();
    for (status, &row) in computed.into_iter().zip(order) {
        sheet.status[row as usize] = status;
    }
}
