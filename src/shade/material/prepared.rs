//! Materials ready to be met by rays.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::bsdf::{BsdfSample, BsdfValue};
use super::{Material, Model, Prepared};
use crate::film::{Picture, PictureError, PictureLimits};
use crate::shade::texture::{Texture, TextureSource};
use crate::trace::SurfaceInteraction;

/// Why a material cannot be prepared.
#[derive(Debug, Error)]
pub enum MaterialError {
    /// A texture's picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// Reads the textures of one material.
#[derive(Debug)]
pub(super) struct Textures {
    limits: PictureLimits,
    /// The pictures among them, in the order they were read.
    pictures: Vec<Arc<Picture>>,
}

impl Textures {
    /// The texture, its picture read.
    pub(super) fn read(&mut self, source: &TextureSource) -> Result<Texture, MaterialError> {
        let texture = Texture::try_new(source, self.limits)?;
        self.pictures.extend(texture.picture());
        Ok(texture)
    }
}

/// A material with its pictures read and its tables computed. Copies share them.
#[derive(Clone, Debug)]
pub struct PreparedMaterial {
    prepared: Arc<dyn Prepared>,
    pictures: Arc<[Arc<Picture>]>,
    two_sided: bool,
}

impl PreparedMaterial {
    /// Reads pictures, of any size, and computes tables.
    ///
    /// # Errors
    /// If a picture cannot be read.
    pub fn try_new(material: &Material) -> Result<Self, MaterialError> {
        Self::try_new_within(material, PictureLimits::NONE)
    }

    /// Reads pictures that are no larger than allowed, and computes tables.
    ///
    /// # Errors
    /// If a picture cannot be read or is larger.
    pub fn try_new_within(material: &Material, limits: PictureLimits) -> Result<Self, MaterialError> {
        let mut textures = Textures { limits, pictures: Vec::new() };
        let prepared = material.settings().prepare(&mut textures)?;
        let two_sided = material.two_sided().unwrap_or(false);
        Ok(Self { prepared: prepared.into(), pictures: textures.pictures.into(), two_sided })
    }

    /// The material at a point.
    #[must_use]
    pub fn bsdf(&self, surface: &SurfaceInteraction) -> Bsdf<'_> {
        Bsdf::new(self.prepared.model(surface.uv), self.two_sided, surface)
    }

    /// The `albedo` layer's value at a point, as Mitsuba has it: the diffuse colour; of metals and glass π times what
    /// they send from the normal's direction to the viewer, which is nothing if they are smooth.
    #[must_use]
    pub fn albedo(&self, surface: &SurfaceInteraction, to_viewer: DVec3) -> DVec3 {
        let diffuse = self.prepared.diffuse_colour(surface.uv);
        diffuse.unwrap_or_else(|| self.bsdf(surface).under_normal_light(to_viewer.normalize()) * PI)
    }

    /// The pictures of its textures, in the order of its parameters.
    #[must_use]
    pub fn pictures(&self) -> &[Arc<Picture>] {
        &self.pictures
    }
}

/// A material at one point of a surface, for directions of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf<'a> {
    model: Model<'a>,
    two_sided: bool,
    /// Right-handed: x along the texture coordinate u if there is one, z the shading normal.
    frame: [DVec3; 3],
}

impl<'a> Bsdf<'a> {
    pub(super) fn new(model: Model<'a>, two_sided: bool, surface: &SurfaceInteraction) -> Self {
        let normal = surface.shading_normal;
        let along_u = surface.dp_du - normal * normal.dot(surface.dp_du);
        let frame = match along_u.try_normalize() {
            Some(tangent) => [tangent, normal.cross(tangent), normal],
            None => {
                let (tangent, bitangent) = normal.any_orthonormal_pair();
                [tangent, bitangent, normal]
            }
        };
        Self { model, two_sided, frame }
    }

    /// BSDF times cosine, and the density of sampling, without delta distributions.
    ///
    /// A two-sided material does on the side that the normal turns away from what it does on the other, as Mitsuba's
    /// `twosided`.
    #[must_use]
    pub fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        let (mut viewer, mut light) = (self.local(to_viewer), self.local(to_light));
        if self.two_sided && viewer.z < 0.0 {
            (viewer.z, light.z) = (-viewer.z, -light.z);
        }
        self.model.eval(viewer, light)
    }

    /// Draws a direction by uniform numbers in `[0, 1)`: `choice` of the part of the model, `u` of the direction.
    ///
    /// None where no light comes from the direction drawn.
    #[must_use]
    pub fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        let mut viewer = self.local(to_viewer);
        let turned = self.two_sided && viewer.z < 0.0;
        if turned {
            viewer.z = -viewer.z;
        }
        let mut sample = self.model.sample(viewer, choice, u)?;
        if turned {
            sample.to_light.z = -sample.to_light.z;
        }
        let [x, y, z] = self.frame;
        let local = sample.to_light;
        sample.to_light = (local.x * x + local.y * y + local.z * z).normalize();
        Some(sample)
    }

    /// BSDF for light along the normal, of a two-sided material on the viewer's side.
    pub(super) fn under_normal_light(&self, to_viewer: DVec3) -> DVec3 {
        let mut viewer = self.local(to_viewer);
        if self.two_sided {
            viewer.z = viewer.z.abs();
        }
        self.model.eval(viewer, DVec3::Z).value
    }

    /// Whether it has more than delta distributions, so that lights can be seen in it by chance.
    #[must_use]
    pub fn has_smooth_part(&self) -> bool {
        self.model.has_smooth_part()
    }

    fn local(&self, direction: DVec3) -> DVec3 {
        let [x, y, z] = self.frame;
        DVec3::new(x.dot(direction), y.dot(direction), z.dot(direction))
    }
}

#[cfg(test)]
mod tests;
