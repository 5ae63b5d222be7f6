//! `slipsweep report DATASET`: one page of HTML with what is in a dataset, without network.

use std::io;
use std::path::PathBuf;

use super::{Failure, dataset, plan, say, summary, to_file, words};
use crate::dataset::{Cell, Digest};
use crate::plot::table::{Request, Source};
use crate::plot::{COLUMN, PAGE, Page};
use crate::protocol::Status;
use crate::sweep::{Sweep, units_of};

/// Arguments of `report`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  slipsweep report results/landscape")]
pub struct Arguments {
    /// Folder of the dataset, such as results/NAME
    dataset: PathBuf,
    /// Where to write it [default: the name of the dataset, -report.html]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the page.
pub fn report(arguments: &Arguments) -> Result<(), Failure> {
    let (folder, manifest) = dataset(&arguments.dataset)?;
    let path = arguments.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}-report.html", manifest.name)));
    let mut page = Page::new(&format!("Dataset {}", manifest.name));
    page.words(&format!("Made by slipsweep {}.", manifest.identity.version));
    let units = units_of(&manifest.spec)?;
    let digests = manifest
        .tables
        .iter()
        .map(|table| Digest::read(&folder, table, &units).map_err(Failure::failed))
        .collect::<Result<Vec<_>, _>>()?;

    page.heading("Plan");
    match Sweep::parse_at(&manifest.spec, &arguments.dataset.join("manifest.json")) {
        Ok(sweep) => page.verbatim(&plan::in_words(&sweep)?),
        // Points are files beside the spec, not in the dataset.
        Err(error) => page.words(&format!("It cannot be told again from the dataset alone: {}", error.found)),
    }

    page.heading("Rows and statuses");
    let used: Vec<usize> =
        (0..Status::ALL.len()).filter(|&status| digests.iter().any(|digest| digest.status[status] > 0)).collect();
    let names: Vec<&str> = ["table", "rows", "parts", "missing parts"]
        .into_iter()
        .chain(used.iter().map(|&status| Status::ALL[status].name()))
        .collect();
    let rows: Vec<Vec<String>> = manifest
        .tables
        .iter()
        .zip(&digests)
        .map(|(table, digest)| {
            let counts = [table.rows, table.parts, digest.missing].map(words::count);
            let statuses = used.iter().map(|&status| words::count(digest.status[status]));
            [table.name.clone()].into_iter().chain(counts).chain(statuses).collect()
        })
        .collect();
    page.table(&names, &rows);

    page.heading("Pictures");
    let source = Source::new(folder, manifest.clone(), units);
    for table in source.tables() {
        match source.figure(&table, &Request::default()) {
            Ok(figure) => page.picture(&figure.draw(if figure.columns > 1 { PAGE } else { COLUMN })),
            // Its help is for who draws one picture.
            Err(error) => page.words(error.to_string().lines().next().unwrap_or_default()),
        }
    }

    page.heading("Summary");
    for (table, digest) in manifest.tables.iter().zip(&digests) {
        page.verbatim(&summary::digest(&table.name, table.rows, digest));
        let rows: &[_] = digest.rows.as_deref().unwrap_or(&digest.least);
        if let Some(first) = rows.first() {
            let names: Vec<&str> = first.iter().map(|(name, _)| name.as_str()).collect();
            let cells = |row: &Vec<(String, Cell)>| row.iter().map(|(_, cell)| summary::shown(cell)).collect();
            page.table(&names, &rows.iter().map(cells).collect::<Vec<_>>());
        }
    }

    page.heading("Spec");
    page.verbatim(&manifest.spec);
    to_file(&path, |file| file.write_all(page.html().as_bytes()))
        .map_err(|error: io::Error| Failure::failed(format!("cannot write {}: {error}", path.display())))?;
    say(&format!("written to {}\n", path.display()))
}
