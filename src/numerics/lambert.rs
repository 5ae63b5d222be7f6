//! The principal branch of the Lambert function from its branch point on.

use super::elementary::{exp, rough_ln};

/// `E >= 1` with `E ln E - E + 1 = d`, that is `e^(1 + W_0((d - 1)/e))`, for `d >= 0`; to a dozen units in the last place.
///
/// One step of Halley's and one of Newton's method, or [`near_branch`].
pub fn above_branch(d: f64) -> f64 {
    if d <= NEAR_END {
        return near_branch(d);
    }
    let l = rough_ln(1.0 + (2.0 * d).sqrt());
    let [a_1, a_2, b_1, b_2] = GUESS;
    // ln E, and E.
    let y = (l + l * l * (a_1 + a_2 * l)) / (1.0 + l * (b_1 + b_2 * l));
    let e = exp(y);
    let newton = ((1.0 - y) * e + (d - 1.0)) / (y * e);
    let step = newton / (1.0 + 0.5 * newton * (1.0 + 1.0 / y));
    let (y, e) = (y + step, e + e * step * (1.0 + step * (0.5 + step * (1.0 / 6.0 + step * (1.0 / 24.0)))));
    e + ((1.0 - y) * e + (d - 1.0)) / y
}

/// [`above_branch`] for `d <= NEAR_END`, to some units in the last place, without branches.
///
/// Close to the branch point `E` is a series in `p = sqrt(2 d)` (Corless et al., Advances in Computational Mathematics 5, 329, 1996, section 4). Its
/// next singularity is at `|p| = sqrt 2` off the real axis; `p/(p + 4)` moves it away.
#[inline(always)]
pub fn near_branch(d: f64) -> f64 {
    interpolated(&NEAR, 24.0 / 10.0, d)
}

/// [`near_branch`] for `d <= NEAREST_END`, with fewer terms.
#[inline(always)]
pub fn nearest_branch(d: f64) -> f64 {
    interpolated(&NEAREST, 26.0 / 9.0, d)
}

/// The interpolant of `E/(1 + p + p^2/6)`; `scale` maps `p/(p + 4)` onto the range from 0 to 2.
#[inline(always)]
fn interpolated<const TERMS: usize>(terms: &[f64; TERMS], scale: f64, d: f64) -> f64 {
    let p = (2.0 * d).sqrt();
    let s = p / (p + 4.0) * scale - 1.0;
    let square = s * s;
    // Two sums, which the processor adds side by side.
    let (mut even, mut odd) = (0.0, 0.0);
    for pair in terms.chunks_exact(2).rev() {
        (even, odd) = (even * square + pair[0], odd * square + pair[1]);
    }
    (even + s * odd) * (1.0 + p * (1.0 + p * (1.0 / 6.0)))
}

/// Greatest `d` of [`nearest_branch`]: `p = 9`.
pub const NEAREST_END: f64 = 40.5;

/// Greatest `d` of [`near_branch`]. Chosen: `p = 20`, so that most paths lie below.
pub const NEAR_END: f64 = 200.0;

/// `E/(1 + p + p^2/6)` in powers of `s`, which is -1 at `p = 0` and 1 at `p = 20`: Chebyshev interpolant, truncation 3e-16. Made by
/// `tests/reference/coefficients.py`.
const NEAR: [f64; 36] = [
    0.9623751449209692,
    -0.1017317534049068,
    -0.08846156348375729,
    -0.028376124626466916,
    -0.009485682257465511,
    -0.006350694172784871,
    -0.002388659606101271,
    -0.0018649939405141268,
    -0.0008262407994018149,
    -0.0006249993987172234,
    -0.00031961205008798616,
    -0.0002293312153487188,
    -0.0001294213839108857,
    -8.946680266404951e-05,
    -5.735524162426555e-05,
    -3.891340511200814e-05,
    -1.0112132987165843e-05,
    -6.483659876876947e-06,
    -5.341981950860865e-05,
    -3.6900417977737595e-05,
    0.00010155712565809958,
    7.072964980875957e-05,
    -0.00019697923200852766,
    -0.000136932370115386,
    0.0002670389385591421,
    0.00018569806517750078,
    -0.0002720883997222338,
    -0.00018916988324666978,
    0.00019750875507283547,
    0.00013731155347650038,
    -9.816357600934402e-05,
    -6.823325684151623e-05,
    2.985928749638742e-05,
    2.0751764409999805e-05,
    -4.31250541790608e-06,
    -2.9959385470039854e-06,
];

/// `E/(1 + p + p^2/6)` for `p` up to 9: Chebyshev interpolant, truncation 1e-16. Made by `tests/reference/coefficients.py`.
const NEAREST: [f64; 26] = [
    0.977188412551686,
    -0.06153454322027919,
    -0.052040633447858725,
    -0.013526283610014856,
    -0.002314851026571093,
    -0.0019304791854772715,
    -0.00020715577265451217,
    -0.0003429660173825874,
    -3.2344132053190276e-05,
    -6.558231734984055e-05,
    -7.279359196107779e-06,
    -1.3115468327929965e-05,
    -1.89828059373208e-06,
    -2.722424917340669e-06,
    -4.96448315523638e-07,
    -5.760014247865123e-07,
    -1.5994063248187567e-07,
    -1.417249173795778e-07,
    -5.346584269239334e-09,
    -1.2262974350370254e-08,
    -3.568992188883463e-08,
    -2.1263666235987175e-08,
    1.1147961462234418e-08,
    5.921108168373159e-09,
    -4.209978082766379e-09,
    -2.379088593873598e-09,
];

/// Coefficients of `ln E/L` with `L = ln(1 + p)`: `(1 + a_1 L + a_2 L^2)/(1 + b_1 L + b_2 L^2)`. Fitted to `ln E <= 36`, where its error is 1.6e-4.
const GUESS: [f64; 4] = [0.7074810976002599, 0.15562451660492752, 0.5403412703865909, 0.07870485733359356];
