//! The outcome of a solve is data: a status beside the numbers, and the work that was spent on them.

/// The outcome of a row. The order is that of summaries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Status {
    /// Every number is good to the requested tolerance.
    Ok,
    /// Computed, but `0 < v < 1` somewhere: outside the range of the friction law.
    BelowBound,
    /// No such protocol: `theta <= 0` or `v <= 0` somewhere, or `t_f < t_min`.
    Infeasible,
    /// Computed, but `tau < 0` somewhere on this path: outside any friction law.
    NegativeFriction,
    /// `tau <= max(0, b - a)` somewhere on the optimal path, where the extremal need not be unique.
    Unproven,
    /// A defect of ours: the solver could not certify its answer.
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

    /// The name that is written into tables.
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

    /// The status of a path with this least friction, which would have status `self` otherwise.
    ///
    /// Negative friction rules out more than a low velocity or an optimum that need not be unique. A path without
    /// numbers has no friction.
    pub fn with_friction(self, least: f64) -> Status {
        match self {
            Status::Ok | Status::BelowBound | Status::Unproven if least < 0.0 => Status::NegativeFriction,
            status => status,
        }
    }

    /// The status of a row that compares a path of status `self` with the optimum of this status.
    ///
    /// An optimum that need not be the least leaves the row in doubt, and so does one whose own friction is negative;
    /// negative friction on the path itself is the stronger statement.
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

/// Work spent on a solve; exact and the same on every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SolverStats {
    /// Quadratures evaluated.
    pub quadratures: u32,
    /// Quadrature nodes evaluated, all quadratures together.
    pub nodes: u32,
}

impl std::ops::AddAssign for SolverStats {
    fn add_assign(&mut self, other: SolverStats) {
        self.quadratures = self.quadratures.saturating_add(other.quadratures);
        self.nodes = self.nodes.saturating_add(other.nodes);
    }
}

/// A status, the numbers where there are any, and the effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved<T> {
    /// The status.
    pub status: Status,
    /// The numbers; `None` wherever the status is `Infeasible` or `NotConverged`.
    pub value: Option<T>,
    /// Work spent.
    pub stats: SolverStats,
}
