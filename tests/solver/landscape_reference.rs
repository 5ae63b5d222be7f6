//! The landscape against a 40-digit table, up to 1e-12 from the border of feasibility.

use crate::reference;
use slipsweep::model::{Law, Transition};
use slipsweep::protocol::Status;
use slipsweep::protocol::cubic::{Landscape, LandscapeBuffers};

#[test]
fn reference_landscape_points_are_good_to_rtol_up_to_the_border_of_feasibility() {
    let rows = reference::table("landscape");
    assert!(rows.len() >= 200, "{} rows", rows.len());
    for rtol in [1e-6, 1e-10, 1e-13] {
        for row in &rows {
            let law = Law { a: row.number("a"), b: row.number("b") };
            let transition = Transition { law, v_i: row.number("v_i"), v_f: row.number("v_f") };
            let (mut work, mut v_min, mut status) = ([f64::NAN], [f64::NAN], [Status::NotConverged]);
            Landscape::new(&transition, row.number("t_f"), rtol).evaluate(
                &[row.number("a_2")],
                &[row.number("a_3")],
                LandscapeBuffers { work: &mut work, v_min: &mut v_min, status: &mut status },
            );
            assert_eq!(status[0].name(), row.text("status"), "{row:?}");
            if let (Some(expected_work), Some(expected_v_min)) = (row.optional("work"), row.optional("v_min")) {
                let error = ((work[0] - expected_work) / expected_work).abs();
                assert!(error <= rtol + 4.0 * f64::EPSILON, "work {} off by {error:.1e} at {rtol} in {row:?}", work[0]);
                let error = ((v_min[0] - expected_v_min) / expected_v_min).abs();
                assert!(
                    error <= rtol + 4.0 * f64::EPSILON,
                    "v_min {} off by {error:.1e} at {rtol} in {row:?}",
                    v_min[0]
                );
            }
        }
    }
}
