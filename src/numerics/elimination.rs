//! Linear equations by Gaussian elimination with row pivots.

/// Solves `matrix x = right` for several right-hand sides: `matrix` is square, row by row, and `right` has as many
/// rows, which become those of the solution. `None` where the matrix is singular.
pub fn eliminate(matrix: &mut [f64], right: &mut [f64], rows: usize) -> Option<()> {
    let width = right.len() / rows;
    for k in 0..rows {
        let size = |row: &usize| matrix[row * rows + k].abs();
        let pivot = (k..rows).max_by(|p, q| size(p).total_cmp(&size(q)))?;
        if pivot != k {
            let (above, below) = matrix.split_at_mut(pivot * rows);
            above[k * rows..(k + 1) * rows].swap_with_slice(&mut below[..rows]);
            let (above, below) = right.split_at_mut(pivot * width);
            above[k * width..(k + 1) * width].swap_with_slice(&mut below[..width]);
        }
        let (done, rest) = matrix.split_at_mut((k + 1) * rows);
        let row = &done[k * rows + k..];
        let inverse = 1.0 / row[0];
        if !inverse.is_finite() {
            return None;
        }
        let (values, others) = right.split_at_mut((k + 1) * width);
        let value = &values[k * width..];
        for (target, target_right) in rest.chunks_exact_mut(rows).zip(others.chunks_exact_mut(width)) {
            let factor = target[k] * inverse;
            target[k..].iter_mut().zip(row).for_each(|(t, r)| *t -= factor * r);
            target_right.iter_mut().zip(value).for_each(|(t, r)| *t -= factor * r);
        }
    }
    for k in (0..rows).rev() {
        let (above, below) = right.split_at_mut(k * width);
        let inverse = 1.0 / matrix[k * rows + k];
        let found = &mut below[..width];
        found.iter_mut().for_each(|value| *value *= inverse);
        for (j, target) in above.chunks_exact_mut(width).enumerate() {
            let factor = matrix[j * rows + k];
            target.iter_mut().zip(&*found).for_each(|(t, r)| *t -= factor * r);
        }
    }
    Some(())
}
