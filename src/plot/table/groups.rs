//! What is left of a table once the axes of a panel are chosen: the values of the further axes, each of which makes a panel or a line.

use std::collections::BTreeMap;

use super::survey::{Survey, Values};
use crate::plot::{PlotError, label};

/// Most different groups that are told apart.
const MOST_GROUPS: usize = 4096;

/// The axes that vary besides those that are drawn and tell rows apart, and a sentence on those that only change along.
pub fn further<'a>(survey: &'a Survey, drawn: &[&str]) -> Result<(Vec<&'a str>, Option<String>), PlotError> {
    let others =
        survey.axes.iter().filter(|axis| (axis.varies() || axis.infinite) && !drawn.contains(&axis.name.as_str()));
    let others: Vec<&str> = others.map(|axis| axis.name.as_str()).collect();
    let mut determined = survey.determined(&others, drawn)?.into_iter();
    let (along, further): (Vec<&str>, Vec<&str>) = others.into_iter().partition(|_| determined.next().unwrap_or(false));
    let along: Vec<&str> = along.into_iter().filter(|name| survey.axis(name).is_some_and(Values::varies)).collect();
    let list = |names: &[&str]| names.iter().map(|name| label::name(name)).collect::<Vec<_>>().join(" and ");
    let verb = if along.len() == 1 { "changes" } else { "change" };
    let note = (!along.is_empty()).then(|| format!("Along with {}, {} {verb}.", list(drawn), list(&along)));
    Ok((further, note))
}

/// The rows of the same values of some axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// The values, in the order of the axes.
    pub values: Vec<f64>,
    /// They in words, in markup: only of axes that vary.
    pub name: String,
}

/// The groups that are shown.
#[derive(Debug, Clone)]
pub struct Groups {
    /// The axes.
    pub axes: Vec<String>,
    /// Those that are shown.
    pub shown: Vec<Group>,
    /// How many there are in all.
    pub all: usize,
    places: BTreeMap<Vec<u64>, usize>,
}

impl Groups {
    /// The groups of the rows of `survey` over `axes`, at most `most` of them, evenly chosen, those of infinite values included; one
    /// group of all rows if there are too many to choose from. `alike` makes values equal that mean the same; a group that is to be
    /// kept is shown before others.
    pub fn new(
        survey: &Survey,
        axes: &[&str],
        most: usize,
        alike: impl Fn(&mut [f64]),
        is_kept: impl Fn(&[f64]) -> bool,
    ) -> Result<Groups, PlotError> {
        let mut found: BTreeMap<Vec<u64>, Vec<f64>> = BTreeMap::new();
        let mut last: Vec<f64> = Vec::new();
        let mut cells_alike = Vec::new();
        survey.each_while(axes, |cells| {
            let same = last.len() == cells.len() && last.iter().zip(cells).all(|(a, b)| a.to_bits() == b.to_bits());
            if same && !last.is_empty() {
                return true;
            }
            last.clear();
            last.extend_from_slice(cells);
            cells_alike.clear();
            cells_alike.extend_from_slice(cells);
            alike(&mut cells_alike);
            found.entry(key(&cells_alike)).or_insert_with(|| cells_alike.clone());
            // Without axes there is one group, however many rows.
            !axes.is_empty() && found.len() <= MOST_GROUPS
        })?;
        let axes: Vec<String> = axes.iter().map(|&axis| axis.to_owned()).collect();
        if found.len() > MOST_GROUPS {
            let whole = Group { values: Vec::new(), name: String::new() };
            return Ok(Groups {
                axes: Vec::new(),
                shown: vec![whole],
                all: 1,
                places: BTreeMap::from([(Vec::new(), 0)]),
            });
        }
        let mut groups: Vec<Vec<f64>> = found.into_values().collect();
        // In the order of the values, not of their bits.
        groups.sort_by(|a, b| {
            a.iter()
                .zip(b)
                .map(|(a, b)| a.total_cmp(b))
                .find(|order| order.is_ne())
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let all = groups.len();
        let varies: Vec<bool> =
            (0..axes.len()).map(|axis| groups.iter().any(|group| group[axis] != groups[0][axis])).collect();
        let (kept, others): (Vec<usize>, Vec<usize>) = (0..all).partition(|&place| is_kept(&groups[place]));
        let mut places = kept;
        places.truncate(most);
        places.extend(chosen(others.len(), most - places.len()).into_iter().map(|place| others[place]));
        places.sort_unstable();
        let shown: Vec<Group> = places
            .into_iter()
            .map(|place| {
                let values = groups[place].clone();
                let named = axes.iter().zip(&values).zip(&varies).filter(|(_, varies)| **varies);
                let words = named.filter_map(|((axis, value), _)| {
                    // A value that means nothing here was made NaN.
                    survey.axis(axis).filter(|_| !value.is_nan()).map(|axis| axis.told(*value))
                });
                Group { name: words.collect::<Vec<_>>().join(", "), values }
            })
            .collect();
        let places = shown.iter().enumerate().map(|(place, group)| (key(&group.values), place)).collect();
        Ok(Groups { axes, shown, all, places })
    }

    /// The group with these values of the axes, if it is shown.
    pub fn place(&self, values: &[f64]) -> Option<usize> {
        self.places.get(&key(values)).copied()
    }

    /// Drops the groups for which `is_kept`, asked in their order, is false, and returns their names.
    pub fn retain(&mut self, mut is_kept: impl FnMut() -> bool) -> Vec<String> {
        let mut dropped = Vec::new();
        self.shown.retain(|group| {
            let keep = is_kept();
            if !keep {
                dropped.push(group.name.clone());
            }
            keep
        });
        self.all -= dropped.len();
        self.places = self.shown.iter().enumerate().map(|(place, group)| (key(&group.values), place)).collect();
        dropped
    }

    /// What is left out, in a sentence.
    pub fn note(&self, what: &str) -> Option<String> {
        let names: Vec<String> = self.axes.iter().map(|axis| label::name(axis)).collect();
        (self.all > self.shown.len()).then(|| {
            format!("{} of {} {what} ({}); others with --where.", self.shown.len(), self.all, names.join(", "))
        })
    }
}

fn key(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| (value + 0.0).to_bits()).collect()
}

/// `most` of `all` places, the first and the last among them, evenly spread.
fn chosen(all: usize, most: usize) -> Vec<usize> {
    if all <= most {
        return (0..all).collect();
    }
    (0..most).map(|i| if most < 2 { 0 } else { (i * (all - 1) + (most - 1) / 2) / (most - 1) }).collect()
}

#[cfg(test)]
mod tests {
    //! An even choice.

    use super::*;

    #[test]
    fn the_choice_is_even_and_keeps_the_ends() {
        assert_eq!(chosen(3, 7), [0, 1, 2]);
        assert_eq!(chosen(9, 3), [0, 4, 8]);
        assert_eq!(chosen(31, 4), [0, 10, 20, 30]);
        assert_eq!(chosen(5, 1), [0]);
    }
}
