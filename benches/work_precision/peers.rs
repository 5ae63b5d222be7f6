//! Methods that ran elsewhere on the same reference tables, as `benches/peers/python/peers.py` writes them down.

use std::path::Path;

use super::measure::{Answer, Record, Subject, judged};

/// One answer of one method.
struct Line {
    subject: String,
    method: String,
    setting: String,
    tolerance: Option<f64>,
    row: usize,
    ns: f64,
    answer: Answer,
}

/// All answers of all methods, setting by setting.
pub struct Peers(Vec<Line>);

impl Peers {
    /// Reads `subject, method, setting, tolerance, row, ns, first, second` below a header.
    pub fn read(path: &Path) -> Result<Peers, String> {
        let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let lines = text.lines().enumerate().skip(1);
        let line = |(place, line): (usize, &str)| {
            parse(line).ok_or_else(|| format!("{}:{}: no answer of a method: {line}", path.display(), place + 1))
        };
        lines.map(line).collect::<Result<_, _>>().map(Peers)
    }

    /// What they did on the cases of a subject.
    pub fn records(&self, subject: &Subject) -> Vec<Record> {
        let own: Vec<&Line> = self.0.iter().filter(|line| line.subject == subject.name).collect();
        let settings = own.chunk_by(|p, q| p.method == q.method && p.setting == q.setting);
        let record = |lines: &[&Line]| {
            let place = |line: &Line| subject.rows.iter().position(|row| *row == line.row);
            let solved: Vec<(usize, Answer)> =
                lines.iter().filter_map(|line| Some((place(line)?, line.answer))).collect();
            let ns: f64 = lines.iter().filter(|line| place(line).is_some()).map(|line| line.ns).sum();
            let first = lines.first().filter(|_| !solved.is_empty())?;
            Some(judged(subject, &first.method, &first.setting, first.tolerance, &solved, 1e-9 * ns))
        };
        settings.filter_map(record).collect()
    }
}

fn parse(line: &str) -> Option<Line> {
    let cells: Vec<&str> = line.split(',').collect();
    let &[subject, method, setting, tolerance, row, ns, first, second] = cells.as_slice() else { return None };
    let tolerance = if tolerance.is_empty() { None } else { Some(tolerance.parse().ok()?) };
    Some(Line {
        subject: subject.into(),
        method: method.into(),
        setting: setting.into(),
        tolerance,
        row: row.parse().ok()?,
        ns: ns.parse().ok()?,
        answer: [first.parse().ok()?, second.parse().ok()?],
    })
}
