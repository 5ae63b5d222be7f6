//! `slipsweep report DATASET`: one HTML page with pictures and summary of a dataset, usable without a network.

use std::path::{Path, PathBuf};

use super::summary::SummaryBlock;
use super::watch::waiting;
use super::{Failure, dataset, is_stdout, keep_datasets, plan, put, refused, say, summary, words, write_file};
use crate::dataset::{Folder, TableSurvey};
use crate::file::ending;
use crate::plot::table::{Request, Source};
use crate::plot::{COLUMN, PAGE, Page, PlotError};
use crate::protocol::Status;
use crate::sweep::{Spec, Sweep, estimate, units};

/// Arguments of `report`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep report results/landscape")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
    /// Output file; - is standard output [default: NAME-report.html]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the page.
///
/// # Errors
///
/// A dataset that cannot be read, or a page that cannot be written.
pub fn report(arguments: &Arguments) -> Result<(), Failure> {
    let (folder, manifest) = dataset(&arguments.dataset)?;
    let path = arguments.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}-report.html", manifest.name)));
    let is_page = matches!(ending(&path).as_str(), "html" | "htm");
    // A device or a named pipe has no ending.
    if !is_stdout(&path) && !is_page && (path.is_file() || !path.exists()) {
        let found = format!("--out {}: the page is HTML", path.display());
        return Err(refused(found, "a name that ends in .html", "leave out --out, or change the ending"));
    }
    keep_datasets(&path)?;
    let mut page = Page::new(&format!("Dataset {}", manifest.name));
    // The description by the user comes first.
    let spec = Spec::parse(&manifest.spec)?;
    if !spec.description.is_empty() {
        page.words(&spec.description);
    }
    page.words(&format!("Made by slipsweep {}.", manifest.build.version));
    let units = units(&spec.model)?;
    let tables = summary::contents(&folder, &manifest)?.tables;

    pictures(&mut page, Source::new(folder, manifest.clone(), units))?;
    statuses(&mut page, &tables);
    summaries(&mut page, &tables);
    plan_of(&mut page, &manifest.spec, &arguments.dataset)?;
    page.heading("Spec");
    page.verbatim(&manifest.spec);
    if is_stdout(&path) {
        return put(page.html().as_bytes());
    }
    write_file(&path, page.html().as_bytes())?;
    say(&format!("written to {}\n", path.display()))
}

/// A picture of each table.
fn pictures(page: &mut Page, source: Source) -> Result<(), Failure> {
    page.heading("Pictures");
    for table in source.tables() {
        let drawing = format!("drawing {table}");
        match waiting(&drawing, || source.figure(&table, &Request::default())) {
            Ok(figure) => {
                page.picture(&figure.draw(if figure.columns > 1 { PAGE } else { COLUMN }));
                figure.remarks.iter().for_each(|remark| page.words(&format!("{table}: {remark} of `slipsweep plot`.")));
            }
            Err(error @ (PlotError::Part(_) | PlotError::Frame(_))) => return Err(error.into()),
            // The help of the message concerns single pictures.
            Err(error) => page.words(error.to_string().lines().next().unwrap_or_default()),
        }
    }
    Ok(())
}

/// The numbers of rows by status, for each table.
fn statuses(page: &mut Page, tables: &[TableSurvey]) {
    page.heading("Rows and statuses");
    let used: Vec<usize> = (0..Status::ALL.len())
        .filter(|&status| tables.iter().any(|table| table.statistics.status[status] > 0))
        .collect();
    let names: Vec<&str> = ["table", "rows", "parts", "missing parts"]
        .into_iter()
        .chain(used.iter().map(|&status| Status::ALL[status].name()))
        .collect();
    let counted = tables.iter().map(|table| {
        let counts = [table.rows, table.parts, table.parts - table.there].map(words::count);
        let statuses = used.iter().map(|&status| words::count(table.statistics.status[status]));
        [table.name.clone()].into_iter().chain(counts).chain(statuses).collect()
    });
    let rows: Vec<Vec<String>> = counted.collect();
    page.table(&names, &rows);
}

/// The summary.
fn summaries(page: &mut Page, tables: &[TableSurvey]) {
    page.heading("Summary");
    for table in tables {
        for piece in summary::blocks(&table.name, table.rows, &table.statistics) {
            match piece {
                SummaryBlock::Line(_, line) => page.words(&line),
                SummaryBlock::Table(_, names, units, rows) => {
                    let headed = |(place, name): (usize, &String)| match units.get(place) {
                        Some(unit) if !unit.is_empty() => format!("{name} [{unit}]"),
                        _ => name.clone(),
                    };
                    let names: Vec<String> = names.iter().enumerate().map(headed).collect();
                    page.table(&names.iter().map(String::as_str).collect::<Vec<_>>(), &rows);
                }
            }
        }
    }
}

/// The plan of the spec of the dataset in `folder`.
fn plan_of(page: &mut Page, spec: &str, folder: &Path) -> Result<(), Failure> {
    page.heading("Plan");
    match Sweep::parse_at(spec, &Folder::at(folder).manifest_path()) {
        Ok(sweep) => {
            let estimates = waiting("computing a sample", || estimate(&sweep, folder)).map_err(Failure::failed)?;
            page.verbatim(&plan::in_words(&sweep, &estimates, 0.0));
        }
        // The dataset does not contain points files.
        Err(error) => page.words(&format!("It cannot be recomputed from the dataset alone: {}", error.found)),
    }
    Ok(())
}
