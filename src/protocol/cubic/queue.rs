//! Queues of shortcuts that wait until they fill all lanes.

use super::{PerShortcut, SPAN_SHORTCUTS};

/// A queue of up to a span of shortcuts of a landscape.
#[derive(Debug, Clone, Default)]
pub(super) struct Queue {
    indices: [usize; SPAN_SHORTCUTS],
    a_2: PerShortcut,
    a_3: PerShortcut,
    count: usize,
}

impl Queue {
    /// Adds the shortcut at `index`; returns whether the queue is full.
    #[inline(always)]
    pub fn push(&mut self, index: usize, a_2: f64, a_3: f64) -> bool {
        let last = self.count % SPAN_SHORTCUTS;
        (self.indices[last], self.a_2[last], self.a_3[last]) = (index, a_2, a_3);
        self.count = last + 1;
        self.count == SPAN_SHORTCUTS
    }

    /// Empties the queue: returns indices, and coordinates for all lanes, padded with the last shortcut; `None` if it is empty.
    pub fn take(&mut self) -> Option<(&[usize], [&PerShortcut; 2])> {
        let count = std::mem::take(&mut self.count);
        let last = count.checked_sub(1)?;
        let (a_2, a_3) = (self.a_2[last], self.a_3[last]);
        self.a_2[last..].fill(a_2);
        self.a_3[last..].fill(a_3);
        Some((&self.indices[..count], [&self.a_2, &self.a_3]))
    }
}

/// A queue of shortcuts whose interval is cut in two.
#[derive(Debug, Clone)]
pub(super) struct Cuts {
    indices: [usize; SPAN_SHORTCUTS / 2],
    a_2: PerShortcut,
    a_3: PerShortcut,
    low: PerShortcut,
    high: PerShortcut,
    count: usize,
}

impl Cuts {
    pub const EMPTY: Cuts = Cuts {
        indices: [0; SPAN_SHORTCUTS / 2],
        a_2: [0.0; SPAN_SHORTCUTS],
        a_3: [0.0; SPAN_SHORTCUTS],
        low: [0.0; SPAN_SHORTCUTS],
        high: [1.0; SPAN_SHORTCUTS],
        count: 0,
    };

    /// Adds the shortcut at `index`, cut at `at`; returns whether the queue is full.
    pub fn push(&mut self, index: usize, [a_2, a_3]: [f64; 2], at: f64) -> bool {
        let last = self.count % (SPAN_SHORTCUTS / 2);
        self.indices[last] = index;
        for lane in [last, last + SPAN_SHORTCUTS / 2] {
            (self.a_2[lane], self.a_3[lane]) = (a_2, a_3);
        }
        (self.high[last], self.low[last + SPAN_SHORTCUTS / 2]) = (at, at);
        self.count = last + 1;
        self.count == SPAN_SHORTCUTS / 2
    }

    /// Empties the queue: returns indices, coordinates and bounds, with the lower parts in the first half of the lanes; `None` if it is empty.
    pub fn take(&mut self) -> Option<(&[usize], [&PerShortcut; 4])> {
        let count = std::mem::take(&mut self.count);
        (count > 0).then_some((&self.indices[..count], [&self.a_2, &self.a_3, &self.low, &self.high]))
    }
}
