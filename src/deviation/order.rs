//! An order by numbers.

use std::cmp::Ordering;

/// A thing with a value to order it by; the greatest comes first out of a heap.
#[derive(Clone, Copy, Debug)]
pub(super) struct ByValue<T>(pub(super) f64, pub(super) T);

impl<T> PartialEq for ByValue<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T> Eq for ByValue<T> {}

impl<T> PartialOrd for ByValue<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for ByValue<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}
