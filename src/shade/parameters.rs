//! Parameters of lights and materials by their names in scene files: their values, and where they are read from.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::texture::TextureSource;
use crate::choice::Choice;
use crate::film::Picture;

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Parameter<'a> {
    /// A number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// One of several names.
    Name(&'static str),
    /// A colour, or what is emitted; linear RGB.
    Colour(DVec3),
    /// A point in the world.
    Point(DVec3),
    /// A direction in the world.
    Vector(DVec3),
    /// A map to the world.
    Placement(DAffine3),
    /// A colour that may vary over the surface.
    ColourTexture(&'a TextureSource),
    /// A number that may vary over the surface.
    NumberTexture(&'a TextureSource),
    /// A picture around the scene.
    Picture(&'a PictureSource),
    /// An object, by its index.
    Object(usize),
}

/// Parameters by their names, in the order of Mitsuba's scene files.
pub type Parameters<'a> = Vec<(&'static str, Parameter<'a>)>;

/// A picture, or the file that it is in.
#[derive(Clone, Debug, PartialEq)]
pub enum PictureSource {
    /// The file, not read yet.
    File(PathBuf),
    /// The picture.
    Read(Arc<Picture>),
}

/// Where the parameters of a light or a material are read from, such as a table of a scene file.
///
/// Methods give none for a parameter that is left out, and for one that is not what `expected` says; the source reports
/// the latter. As what has faults is never used, the reader may go on with any value in its place.
pub trait ParameterSource {
    /// Whether a parameter is given.
    fn has(&self, key: &str) -> bool;

    /// Reports a fault of a parameter's value, or of the whole if the parameter is left out.
    fn report_value(&self, key: &str, message: String);

    /// Reports that a parameter should not be there.
    fn report_key(&self, key: &str, message: String);

    /// Yes or no.
    fn flag(&self, key: &str) -> Option<bool>;

    /// A finite number that passes `accepts`.
    fn number(&self, key: &str, expected: &str, accepts: &dyn Fn(f64) -> bool) -> Option<f64>;

    /// Three finite numbers, or one for all, that pass `accepts`.
    fn colour(&self, key: &str, expected: &str, accepts: &dyn Fn(f64) -> bool) -> Option<DVec3>;

    /// What a light emits: as [`Self::colour`], of at least 0; 1 if it is left out.
    fn emission(&self, key: &str) -> DVec3;

    /// A colour or number that may vary over the surface.
    fn texture(&self, key: &str, range: TextureRange) -> Option<TextureSource>;

    /// Three finite numbers.
    fn vector(&self, key: &str, expected: &str) -> Option<DVec3>;

    /// An invertible map to the world; the identity if it is left out.
    fn placement(&self, key: &str) -> Option<DAffine3>;

    /// A text.
    fn text(&self, key: &str) -> Option<&str>;

    /// One of the known names, by its index; `what` they are is for messages.
    fn name(&self, key: &str, what: &str, known: &[&'static str]) -> Option<usize>;

    /// A file; it must be given.
    fn file(&self, key: &str, expected: &str) -> Option<PathBuf>;

    /// Index of an object of the scene; it must be given.
    fn object(&self, key: &str) -> Option<usize>;

    /// Reports a parameter that is left out but must be given.
    fn require(&self, key: &str, expected: &str);
}

/// What the numbers of a texture may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureRange {
    /// A colour in `[0, 1]`.
    Colour,
    /// A number in `[0, 1]`.
    Share,
    /// A number of at least 0.
    Roughness,
}

/// A value that is chosen by its name.
pub(super) fn choice<C: Choice>(source: &dyn ParameterSource, key: &str) -> Option<C> {
    source.name(key, C::WHAT, &C::names()).map(|index| C::ALL[index])
}
