//! Counts of what the solver met.

use std::ops::AddAssign;

use serde::Serialize;

/// A structure of counters that can be added and listed, so that a counter is named in one place only.
macro_rules! counters {
    (
        $(#[$about:meta])*
        pub struct $name:ident {
            $($(#[$meaning:meta])* pub $counter:ident: u64,)*
        }
    ) => {
        $(#[$about])*
        pub struct $name {
            $($(#[$meaning])* pub $counter: u64,)*
        }

        impl $name {
            /// The name and the value of every counter.
            pub fn counts(&self) -> impl Iterator<Item = (&'static str, u64)> + use<> {
                [$((stringify!($counter), self.$counter)),*].into_iter()
            }
        }

        impl AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                $(self.$counter += other.$counter;)*
            }
        }
    };
}

counters! {
    /// Every outcome of the search for hits, counted.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
    pub struct TraceStatistics {
        /// Rays traced.
        pub rays: u64,
        /// Leaves (parts of patches) whose box a ray entered.
        pub leaf_tests: u64,
        /// Leaves for which nothing was proved, so that Bézier clipping decided.
        pub fallbacks: u64,
        /// Parameter boxes examined by Bézier clipping.
        pub boxes: u64,
        /// Steps of Newton's method.
        pub newton_steps: u64,
        /// Roots found by Bézier clipping, before trimming.
        pub roots: u64,
        /// Those of them at which the ray is tangent to the patch, within rounding.
        pub degenerate: u64,
        /// Patches that a ray lies in, within rounding: no single point is hit there.
        pub in_surface: u64,
        /// Searches given up at the limit of boxes.
        pub not_converged: u64,
        /// Roots outside the trim, however they were found.
        pub trimmed: u64,
        /// Hits accepted only for the tolerance of the trim: within rounding of a border.
        pub on_border: u64,
    }
}

impl TraceStatistics {
    /// The name and the value for each ray of every counter but that of rays; zeros if there were none.
    pub fn per_ray(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let rays = self.rays.max(1) as f64;
        self.counts()
            .filter(|(name, _)| *name != "rays")
            .map(move |(name, count)| (name, count as f64 / rays))
    }
}

/// What an acceleration structure is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AccelerationStatistics {
    /// Parts of patches that rays are tested against.
    pub leaves: usize,
    /// Leaves that lie inside one loop of the trim.
    pub leaves_inside: usize,
    /// Leaves that borders of the trim cross.
    pub leaves_crossed: usize,
    /// Nodes of the tree over the leaves' boxes.
    pub nodes: usize,
    /// Memory of leaves and nodes; patches not included.
    pub bytes: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_added_and_listed() {
        let mut sum = TraceStatistics { rays: 3, boxes: 5, on_border: 1, ..Default::default() };
        sum += TraceStatistics { rays: 1, boxes: 1, ..Default::default() };
        let counts: Vec<_> = sum.counts().filter(|(_, count)| *count > 0).collect();
        assert_eq!(counts, [("rays", 4), ("boxes", 6), ("on_border", 1)]);
        let per_ray: Vec<_> = sum.per_ray().filter(|(_, share)| *share > 0.0).collect();
        assert_eq!(per_ray, [("boxes", 1.5), ("on_border", 0.25)]);
        assert!(TraceStatistics::default().per_ray().all(|(_, share)| share == 0.0));
    }
}
