//! The records as tables in Markdown.

use super::measure::Record;

/// Errors at which times are compared.
const TARGETS: [f64; 2] = [1e-6, 1e-10];

/// The table of one subject and one kind of cases.
pub fn table(records: &[&Record], ln: f64) -> String {
    let count = records.iter().map(|record| record.count).max().unwrap_or(0);
    let mut text = format!(
        "| {count} cases | ns to 1e-6 | in ln | failed | ns to 1e-10 | in ln | failed | least error | worst | failed |\n{}\n",
        "| --- ".repeat(10) + "|"
    );
    let mut methods: Vec<&str> = Vec::new();
    for record in records {
        if !methods.contains(&record.method.as_str()) {
            methods.push(&record.method);
        }
    }
    for method in methods {
        let own: Vec<&Record> = records.iter().copied().filter(|record| record.method == method).collect();
        text.push_str(&format!("| {method} "));
        for target in TARGETS {
            match fastest(&own, target) {
                Some(record) => {
                    let in_ln = digits(record.ns / ln);
                    // A tolerance follows from the error; a number of nodes is an input.
                    let setting = match record.tolerance {
                        None if !record.setting.is_empty() => format!(" ({})", record.setting),
                        _ => String::new(),
                    };
                    text.push_str(&format!("| {}{setting} | {in_ln} | {} ", digits(record.ns), failed(record)));
                }
                None => text.push_str("| - | - | - "),
            }
        }
        let best = own.iter().filter(|record| is_sound(record)).min_by(|p, q| p.errors[1].total_cmp(&q.errors[1]));
        match best {
            Some(best) => {
                text.push_str(&format!("| {:.1e} | {:.1e} | {} |\n", best.errors[1], best.errors[2], failed(best)));
            }
            None => {
                let least = own.iter().min_by_key(|record| record.failures);
                text.push_str(&format!("| - | - | {} |\n", least.map_or_else(String::new, |record| failed(record))));
            }
        }
    }
    text
}

/// Whether half of the cases at least are answered.
fn is_sound(record: &Record) -> bool {
    2 * record.failures <= record.count && record.errors[1].is_finite()
}

/// The fastest setting of a method by which 95 % of what did not fail is good to `target`.
fn fastest<'a>(records: &[&'a Record], target: f64) -> Option<&'a Record> {
    let good = records.iter().copied().filter(|record| is_sound(record) && record.errors[1] <= target);
    good.min_by(|p, q| p.ns.total_cmp(&q.ns))
}

fn failed(record: &Record) -> String {
    format!("{} of {}", record.failures, record.count)
}

/// A number to three digits, without an exponent.
fn digits(value: f64) -> String {
    let decimals = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    let rounded = format!("{value:.decimals$}");
    if decimals > 0 {
        return rounded;
    }
    let places = rounded.len();
    let group = |(place, digit): (usize, char)| {
        let comma = place > 0 && (places - place).is_multiple_of(3);
        [comma.then_some(','), Some(digit)].into_iter().flatten()
    };
    rounded.chars().enumerate().flat_map(group).collect()
}
