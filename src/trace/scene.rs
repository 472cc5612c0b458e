//! Objects ready to trace, in one acceleration structure.

use std::sync::OnceLock;

use fearless_simd::Level;
use glam::{DVec2, DVec3};

use crate::math::bounds;
use crate::memory::{MemoryLimit, OutOfMemory};
use crate::patch::Face;

use super::bvh::Bvh;
use super::interaction::{self, SurfaceInteraction};
use super::leaf::{Cover, Cut, Leaf, Leaves};
use super::local::LocalSpace;
use super::object::{PatchHit, TracedObject};
use super::overlaps::Overlaps;
use super::ray::Ray;
use super::statistics::AccelerationStatistics;
use super::target::{Target, surface_error, tolerance};

/// Leaves that are made between two looks at the memory that is left.
const LEAVES_BETWEEN_CHECKS: usize = 1 << 14;

/// All objects of a scene in one acceleration structure.
#[derive(Debug)]
pub struct TracedScene {
    objects: Vec<TracedObject>,
    leaves: Vec<Leaf>,
    cuts: Vec<Cut>,
    bvh: Bvh,
    space: LocalSpace,
    /// The processor's vectors.
    level: Level,
    /// Found when they are first asked for.
    overlaps: OnceLock<Overlaps>,
}

impl TracedScene {
    /// Builds the acceleration structure over all patches.
    pub fn new(objects: Vec<TracedObject>) -> Self {
        Self::try_new_within(objects, MemoryLimit::NONE).expect("nothing is too much without a limit")
    }

    /// As [`Self::new`], if there is memory enough.
    ///
    /// # Errors
    /// If the process would have more memory than it may.
    pub fn try_new_within(objects: Vec<TracedObject>, memory: MemoryLimit) -> Result<Self, OutOfMemory> {
        let patches = objects.iter().flat_map(|object| object.faces());
        let all = bounds::around(patches.flat_map(|trimmed| trimmed.patch.hull_bounds()));
        let space = LocalSpace::around(all);
        let mut leaves = Leaves::default();
        let mut next_check = LEAVES_BETWEEN_CHECKS;
        for (object, traced) in (0..).zip(&objects) {
            for (patch, trimmed) in (0..).zip(traced.faces()) {
                leaves.add([object, patch], trimmed, surface_error(trimmed), &space);
                if leaves.len() >= next_check {
                    memory.check(format_args!("the leaves of object {:?}", traced.name), leaves.bytes())?;
                    next_check += LEAVES_BETWEEN_CHECKS;
                }
            }
        }
        let Leaves { mut leaves, mut cuts, boxes, .. } = leaves;
        leaves.shrink_to_fit();
        cuts.shrink_to_fit();
        let what = format_args!("the tree over {} leaves", leaves.len());
        let _promise = memory.ask(what, boxes.len() as u64 * Bvh::BYTES_PER_BOX)?;
        let bvh = Bvh::build(&boxes);
        Ok(Self { objects, leaves, cuts, bvh, space, level: Level::new(), overlaps: OnceLock::new() })
    }

    /// The objects.
    pub fn objects(&self) -> &[TracedObject] {
        &self.objects
    }

    /// What the acceleration structure is made of.
    pub fn acceleration(&self) -> AccelerationStatistics {
        let bytes = size_of_val(&*self.leaves) + size_of_val(&*self.cuts);
        let leaves = self.leaves.len();
        let inside = self.leaves.iter().filter(|leaf| matches!(leaf.cover, Cover::Inside(_))).count();
        AccelerationStatistics {
            leaves,
            leaves_inside: inside,
            leaves_crossed: leaves - inside,
            nodes: self.bvh.nodes(),
            bytes: self.bvh.bytes() + bytes,
        }
    }

    /// Lowest and highest corner of a box around one object's surface; not the tightest.
    pub fn object_bounds(&self, object: usize) -> [DVec3; 2] {
        self.objects[object].bounds()
    }

    /// Lowest and highest corner of a box around all objects.
    pub fn bounds(&self) -> [DVec3; 2] {
        bounds::around(self.objects.iter().flat_map(TracedObject::bounds))
    }

    /// How far off the parameters of a ray's hit may be, for rounding.
    pub fn st_error(&self, hit: &PatchHit, ray: &Ray) -> DVec2 {
        tolerance(self.trimmed(hit), &self.space, hit.st, ray)
    }

    /// Everything shading needs of a hit.
    pub fn interaction(&self, hit: &PatchHit) -> SurfaceInteraction {
        interaction::interaction(&self.objects, hit)
    }

    /// The processor's vectors.
    pub(super) fn level(&self) -> Level {
        self.level
    }

    /// Loops that overlap others.
    pub(super) fn overlaps(&self) -> &Overlaps {
        self.overlaps.get_or_init(|| Overlaps::new(&self.objects))
    }

    /// The patch that is hit.
    pub(super) fn trimmed(&self, hit: &PatchHit) -> &Face {
        &self.objects[hit.object as usize].faces()[hit.patch as usize]
    }

    pub(super) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    pub(super) fn space(&self) -> &LocalSpace {
        &self.space
    }

    #[inline(always)]
    pub(super) fn leaf(&self, index: usize) -> &Leaf {
        &self.leaves[index]
    }

    #[inline(always)]
    pub(super) fn target(&self, leaf: usize) -> Target<'_> {
        let leaf = &self.leaves[leaf];
        let trimmed = &self.objects[leaf.object as usize].faces()[leaf.patch as usize];
        let cuts = match leaf.cover {
            Cover::Inside(_) => &[],
            Cover::Crossed { start, end } => &self.cuts[start as usize..end as usize],
        };
        Target { leaf, cuts, trimmed, space: &self.space }
    }
}
