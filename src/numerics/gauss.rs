//! Gauss-Legendre (provisional).
/// Rule
#[derive(Debug)]
pub struct Rule {
    /// nodes
    pub x: Vec<f64>,
    /// weights
    pub w: Vec<f64>,
}
/// rule
pub fn rule(n: usize) -> &'static Rule {
    use std::sync::OnceLock;
    static CACHE: [OnceLock<Rule>; 513] = [const { OnceLock::new() }; 513];
    CACHE[n].get_or_init(|| {
        let (mut x, mut w) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            let mut t = -libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5));
            let mut d = 0.0;
            for _ in 0..10 {
                let (mut p0, mut p1) = (1.0, t);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * t * p1 - (k - 1.0) * p0) / k);
                }
                d = n as f64 * (t * p1 - p0) / (t * t - 1.0);
                t -= p1 / d;
            }
            x[i] = t;
            w[i] = 2.0 / ((1.0 - t * t) * d * d);
        }
        Rule { x, w }
    })
}
