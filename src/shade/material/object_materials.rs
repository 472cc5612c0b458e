//! The materials of one object.

use glam::DVec3;

use super::Material;
use super::prepared::PreparedMaterial;

/// The materials of one object: one for all of it, or one for each face of its mesh.
#[derive(Clone, Debug)]
pub struct ObjectMaterials {
    settings: Vec<Material>,
    prepared: Vec<PreparedMaterial>,
    /// The material of each input face; empty if there is one for all.
    of_face: Vec<u32>,
    /// The radiance that each material emits; empty if none does.
    emission: Vec<DVec3>,
}

impl ObjectMaterials {
    /// One material for all of an object: what it is made of, and as rays meet it.
    #[must_use]
    pub fn uniform(settings: Material, prepared: PreparedMaterial) -> Self {
        Self { settings: vec![settings], prepared: vec![prepared], of_face: Vec::new(), emission: Vec::new() }
    }

    /// Materials by face: `of_face` has the index of each input face's material.
    ///
    /// # Panics
    /// If there is no material, or a face has one that is not there.
    #[must_use]
    pub fn by_face(materials: Vec<(Material, PreparedMaterial)>, of_face: Vec<u32>) -> Self {
        assert!(!materials.is_empty(), "an object has a material");
        assert!(
            of_face.iter().all(|&index| (index as usize) < materials.len()),
            "each face's material is there"
        );
        let (settings, prepared) = materials.into_iter().unzip();
        Self { settings, prepared, of_face, emission: Vec::new() }
    }

    /// The same materials, each emitting a radiance to the side from which its faces wind counter-clockwise.
    ///
    /// # Panics
    /// If there is not one radiance for each material.
    #[must_use]
    pub fn with_emission(mut self, emission: Vec<DVec3>) -> Self {
        assert_eq!(emission.len(), self.settings.len(), "one radiance for each material");
        self.emission =
            if emission.iter().all(|&radiance| radiance == DVec3::ZERO) { Vec::new() } else { emission };
        self
    }

    /// The radiance that each material emits; empty if none does.
    #[must_use]
    pub fn emission(&self) -> &[DVec3] {
        &self.emission
    }

    /// The material of an input face, as rays meet it.
    #[must_use]
    #[inline]
    pub fn at(&self, face: u32) -> &PreparedMaterial {
        &self.prepared[self.index(face)]
    }

    /// The index of an input face's material.
    #[must_use]
    #[inline]
    pub fn index(&self, face: u32) -> usize {
        self.of_face.get(face as usize).map_or(0, |&index| index as usize)
    }

    /// The material of each input face; empty if there is one for all.
    #[must_use]
    pub fn of_face(&self) -> &[u32] {
        &self.of_face
    }

    /// All materials: what they are made of, and as rays meet them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&Material, &PreparedMaterial)> {
        self.settings.iter().zip(&self.prepared)
    }

    /// What the one material is made of, if there is one for all.
    #[must_use]
    pub fn only(&self) -> Option<&Material> {
        self.of_face.is_empty().then(|| &self.settings[0])
    }
}
