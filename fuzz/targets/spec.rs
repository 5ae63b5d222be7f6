//! Any text as a spec: it is refused with a message, or it is a sweep whose rows can be enumerated.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use slipsweep::sweep::{AxisForm, AxisSpec, BlockSpec, Plan, Spec, Sweep};

/// Most combinations of a spec with a condition or a computed axis, which are evaluated one by one: 2^36 are legal and take minutes.
const MOST_COMBINATIONS: f64 = 16384.0;

fuzz_target!(|text: &str| {
    if is_long(text) {
        return;
    }
    match Sweep::parse(text, Path::new("corpus/points")) {
        Ok(sweep) => {
            let plan = Plan::new(&sweep);
            assert_eq!(plan.tables.len(), sweep.requests.len());
            sweep.requests.iter().for_each(|request| drop(sweep.hash(request)));
            for request in &sweep.requests {
                for row in [0, request.rows / 2, request.rows - 1] {
                    request.row_index.point(row);
                }
            }
        }
        // At most ten faults.
        Err(error) => assert!(error.to_string().len() < 10 * 4096),
    }
});

/// Whether a legal spec takes long because it is large: no defect.
fn is_long(text: &str) -> bool {
    let Ok(spec) = Spec::parse(text) else { return false };
    spec.blocks().any(|(_, block)| evaluates(block) && combinations(block) > MOST_COMBINATIONS)
}

fn evaluates(block: &BlockSpec) -> bool {
    let computed = |axis: &AxisSpec| matches!(axis, AxisSpec::Form(AxisForm { expr: Some(_), .. }));
    block.condition.is_some() || block.axes.values().any(computed)
}

fn combinations(block: &BlockSpec) -> f64 {
    let count = |axis: &AxisSpec| match axis {
        AxisSpec::One(_) => 1.0,
        AxisSpec::List(values) => values.len() as f64,
        AxisSpec::Form(form) => {
            let forms = [&form.linspace, &form.geomspace, &form.sobol, &form.lhs];
            forms.into_iter().flatten().filter_map(|numbers| numbers.get(2).copied()).fold(1.0, f64::max)
        }
    };
    block.axes.values().map(count).product()
}
