//! Numerical tools that know no friction.
