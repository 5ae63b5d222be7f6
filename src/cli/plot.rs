//! `slipsweep plot DATASET|TRACE…`: pictures as SVG, PNG or PDF.

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::kind::{self, Kind};
use super::watch::waiting;
use super::{EXIT_FAILURE, Failure, cannot_write, dataset, is_stdout, put, refused, say, within, write_file, wrong};
use crate::plot::table::{Condition, Request, Source};
use crate::plot::{self, COLUMN, Figure, Format, PAGE, PlotError, missing_letters};
use crate::sweep::units_of;

/// Arguments of `plot`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  slipsweep plot results/landscape                       every table, one picture each
  slipsweep plot results/landscape --format png --out pictures
  slipsweep plot results/landscape --table gap --where t_f=0.02 --out gap.pdf
  slipsweep plot results/crossover --table crossover --x v_f --y b --color t_floor --where v_i=1.1
  slipsweep plot optimal.csv best_cubic.csv --out protocols.png
  slipsweep plot cycle.csv --x v --y tau                 a phase portrait")]
pub struct Arguments {
    /// Folder of a dataset, such as results/NAME, or traces of `slipsweep trace` (.csv, .parquet)
    #[arg(required = true, value_name = "DATASET|TRACE")]
    sources: Vec<PathBuf>,
    /// Table to draw [default: every table, one picture each]
    #[arg(long, value_name = "NAME")]
    table: Option<String>,
    /// Rows to show: comparisons by =, !=, <, <=, >, >= or in (…), joined by commas, such as "a=0.03, v_f>=10"
    #[arg(long = "where", value_name = "CONDITION")]
    conditions: Vec<String>,
    /// Horizontal axis; for traces a column, such as v [default for traces: t]
    #[arg(long, value_name = "AXIS")]
    x: Option<String>,
    /// Vertical axis of a map, or the column of lines or traces
    #[arg(long, value_name = "AXIS|COLUMN")]
    y: Option<String>,
    /// Colour column of a map, or the axis that distinguishes lines
    #[arg(long, visible_alias = "colour", value_name = "COLUMN|AXIS")]
    color: Option<String>,
    /// A file that ends in .svg, .png or .pdf, or a folder; - is standard output [default: NAME-TABLE.svg]
    #[arg(short, long, value_name = "FILE|DIR")]
    out: Option<PathBuf>,
    /// Format of the pictures in a folder [default: svg]
    #[arg(long, value_name = "FORMAT", value_enum)]
    format: Option<Format>,
    /// Width in millimetres: 89 for one column of a journal, 183 for two [default: by the number of panels]
    #[arg(long, value_name = "MM", value_parser = within(50.0, 1000.0))]
    width: Option<f64>,
    /// Pixels per inch of a .png
    #[arg(long, value_name = "N", default_value = "300", value_parser = within(20.0, 2400.0))]
    dpi: f64,
}

impl From<PlotError> for Failure {
    fn from(error: PlotError) -> Failure {
        // A damaged file is not an error of the arguments.
        match error {
            PlotError::Part(_) | PlotError::Frame(_) | PlotError::Trace(_) => Failure::failed(error),
            _ => wrong(error),
        }
    }
}

/// Draws the requested pictures.
///
/// # Errors
///
/// A source that cannot be drawn, or a file that cannot be written.
pub fn plot(arguments: &Arguments) -> Result<(), Failure> {
    let place = arguments.place()?;
    match arguments.sources.as_slice() {
        [one] if Kind::of(one) == Kind::Dataset => arguments.dataset(one, &place),
        sources => {
            for source in sources {
                if source.is_dir() && sources.len() > 1 {
                    let found = format!("{}: a dataset together with other arguments", source.display());
                    return Err(refused(found, "one dataset, or traces", "draw them one after the other"));
                }
                kind::expect(source, &[Kind::Dataset, Kind::Trace])?;
            }
            arguments.traces(sources, &place)
        }
    }
}

/// Destination of pictures: a folder, or the file of a single one.
struct OutputTarget {
    path: PathBuf,
    is_file: bool,
    format: Format,
}

impl Arguments {
    fn traces(&self, sources: &[PathBuf], place: &OutputTarget) -> Result<(), Failure> {
        let courses = sources.iter().map(|path| plot::trace::read(path)).collect::<Result<Vec<_>, _>>()?;
        let of_tables = [
            ("--table", self.table.is_some()),
            ("--where", !self.conditions.is_empty()),
            ("--color", self.color.is_some()),
        ];
        if let Some((flag, _)) = of_tables.into_iter().find(|(_, is_given)| *is_given) {
            return Err(wrong(format!(
                "{flag}: traces have no tables\n  expected: the folder of a dataset, such as results/NAME"
            )));
        }
        let stem = match sources {
            [one] => one.file_stem().map_or("trace".into(), |stem| stem.to_string_lossy().into_owned()),
            _ => "traces".to_owned(),
        };
        let figure = plot::trace::figure(&courses, [self.x.as_deref(), self.y.as_deref()])?;
        self.write(&figure, "", &stem, place)
    }

    fn dataset(&self, path: &Path, place: &OutputTarget) -> Result<(), Failure> {
        let (folder, manifest) = dataset(path)?;
        let units = units_of(&manifest.spec)?;
        let source = Source::new(folder, manifest, units);
        let request = self.request()?;
        let tables = match &self.table {
            Some(table) => vec![table.clone()],
            None => source.tables(),
        };
        if tables.len() > 1 && place.is_file {
            let tables = tables.join(", ");
            return Err(wrong(format!(
                "--out FILE is for one table\n  found: {tables}\n  help: name one of them with --table"
            )));
        }
        let (mut damage, mut pictures) = (None, 0);
        for table in &tables {
            let drawing = format!("drawing {table}");
            let figure = match waiting(&drawing, || source.figure(table, &request)).map_err(Failure::from) {
                // A table without a picture does not prevent the pictures of other tables.
                Err(failure) if tables.len() > 1 && failure.code == EXIT_FAILURE => {
                    damage = damage.or(Some(failure));
                    continue;
                }
                Err(failure) if tables.len() > 1 => {
                    say(&format!("{table}: no picture: {}\n", failure.message.trim_start_matches("error: ")))?;
                    continue;
                }
                drawn => drawn?,
            };
            self.write(&figure, &format!("{table}: "), &format!("{}-{table}", source.manifest.name), place)?;
            pictures += 1;
        }
        match damage {
            Some(failure) => Err(failure),
            None if pictures == 0 => Err(wrong(format!("{}: no table has a picture", path.display()))),
            None => Ok(()),
        }
    }

    fn request(&self) -> Result<Request, Failure> {
        let conditions =
            self.conditions.iter().map(|text| Condition::all(text)).collect::<Result<Vec<_>, _>>()?.concat();
        Ok(Request { conditions, x: self.x.clone(), y: self.y.clone(), colour: self.color.clone() })
    }

    /// Destination and format of the pictures.
    fn place(&self) -> Result<OutputTarget, Failure> {
        let format = self.format.unwrap_or(Format::Svg);
        let path = self.out.clone().unwrap_or_default();
        if is_stdout(&path) {
            if format != Format::Svg && io::stdout().is_terminal() {
                return Err(wrong(
                    "a picture is not written to a terminal\n  help: name a file with --out, or pipe the output",
                ));
            }
            return Ok(OutputTarget { path, is_file: true, format });
        }
        if path.is_dir() || path.extension().is_none() {
            return Ok(OutputTarget { path, is_file: false, format });
        }
        let shown = path.display();
        match (Format::of(&path), self.format) {
            (None, _) => Err(wrong(format!(
                "--out {shown}: the name ends in none of .svg, .png, .pdf\n  help: end it in one of these; for a folder, make it first"
            ))),
            (Some(named), Some(given)) if named != given => Err(wrong(format!(
                "--out {shown}: the ending contradicts --format\n  help: leave out --format, or name a folder"
            ))),
            (Some(format), _) => Ok(OutputTarget { path, is_file: true, format }),
        }
    }

    /// Writes a figure, and reports its path; the line begins with `name`.
    fn write(&self, figure: &Figure, name: &str, stem: &str, place: &OutputTarget) -> Result<(), Failure> {
        let path = match place.is_file {
            true => place.path.clone(),
            false => place.path.join(format!("{stem}.{}", place.format.ending())),
        };
        let width = self.width.unwrap_or(if figure.columns > 1 { PAGE } else { COLUMN });
        let svg = figure.draw(width).svg;
        let missing = missing_letters(&svg);
        if place.format != Format::Svg && !missing.is_empty() {
            let letters: String = missing.into_iter().collect();
            // A note that cannot be printed is no failure.
            let _ = writeln!(io::stderr(), "note: the font of PNG and PDF lacks {letters}; an SVG has all letters");
        }
        let bytes = waiting("writing the picture", || place.format.encode(&svg, self.dpi))?;
        if is_stdout(&path) {
            return put(&bytes);
        }
        if !place.is_file {
            fs::create_dir_all(&place.path).map_err(|error| cannot_write(&path, &error))?;
        }
        write_file(&path, &bytes)?;
        say(&format!("{name}written to {}\n{}", path.display(), remarks(figure)))
    }
}

/// The note on omitted panels.
fn remarks(figure: &Figure) -> String {
    figure.remarks.iter().map(|remark| format!("  {remark}\n")).collect()
}
