//! The outcome of a solve as data: a status, the numbers, and the solver statistics.

/// Status of a row. The order is the order in summaries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Status {
    /// Every number meets the requested tolerance.
    Ok,
    /// Computed, but `0 < v < 1` somewhere: outside the range of the friction law.
    BelowBound,
    /// No such protocol: `theta <= 0` or `v <= 0` somewhere, or `t_f < t_min`.
    Infeasible,
    /// Computed, but `tau < 0` somewhere on this path: outside any friction law.
    NegativeFriction,
    /// `tau <= max(0, b - a)` somewhere on the optimal path, and `tau_ss < 2 (b - a)` at an end: the extremal need not be unique.
    Unproven,
    /// A defect of the program: the solver could not certify its answer.
    NotConverged,
}

impl Status {
    /// All statuses, in their order.
    pub const ALL: [Status; 6] = [
        Status::Ok,
        Status::BelowBound,
        Status::Infeasible,
        Status::NegativeFriction,
        Status::Unproven,
        Status::NotConverged,
    ];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::BelowBound => "below_bound",
            Status::Infeasible => "infeasible",
            Status::NegativeFriction => "negative_friction",
            Status::Unproven => "unproven",
            Status::NotConverged => "not_converged",
        }
    }

    /// Status of a path with this least friction and status `self` otherwise.
    ///
    /// Negative friction takes precedence over a low velocity and over an optimum that need not be unique. A path
    /// without numbers has no friction.
    pub fn with_friction(self, least: f64) -> Status {
        match self {
            Status::Ok | Status::BelowBound | Status::Unproven if least < 0.0 => Status::NegativeFriction,
            status => status,
        }
    }

    /// Status of a row that compares a path of status `self` with the optimum of this status.
    ///
    /// The row is unproven where the optimum need not be the least or has negative friction. Negative friction on the
    /// path itself takes precedence.
    pub fn compared_with(self, optimum: Status) -> Status {
        match (self, optimum) {
            (Status::Infeasible | Status::NotConverged, _) => self,
            (_, Status::Infeasible | Status::NotConverged) => optimum,
            (Status::NegativeFriction, _) => self,
            (_, Status::NegativeFriction | Status::Unproven) => Status::Unproven,
            _ => self,
        }
    }
}

/// Statistics of a solve; exact and the same on every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SolverStats {
    /// Number of quadratures.
    pub quadratures: u32,
    /// Number of quadrature nodes, all quadratures together.
    pub nodes: u32,
}

impl std::ops::AddAssign for SolverStats {
    fn add_assign(&mut self, other: SolverStats) {
        self.quadratures = self.quadratures.saturating_add(other.quadratures);
        self.nodes = self.nodes.saturating_add(other.nodes);
    }
}

impl<T> Solved<T> {
    /// The outcome of a solve without numbers.
    pub const fn without_numbers(status: Status, stats: SolverStats) -> Solved<T> {
        Solved { status, value: None, stats }
    }

    /// The result with `convert`ed numbers.
    pub fn map<U>(self, convert: impl FnOnce(T) -> U) -> Solved<U> {
        Solved { status: self.status, value: self.value.map(convert), stats: self.stats }
    }
}

/// Result of a solve: status, numbers and statistics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved<T> {
    /// The status.
    pub status: Status,
    /// The numbers; `None` wherever the status is `Infeasible` or `NotConverged`.
    pub value: Option<T>,
    /// Solver statistics.
    pub stats: SolverStats,
}
