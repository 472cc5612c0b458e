//! A scene as its file gives it: checked plain data, before any mesh is read.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use glam::{DAffine3, DVec2, DVec3};

use super::diagnostic::{Located, Location};
use super::names::{Choice, lookup};
use crate::analytic::Extension;
use crate::film::FilmSettings;
use crate::model::MAX_LEVEL;
use crate::shade::{CameraSettings, Light, Material, RenderSettings};
use crate::spline::{Axis, SignedAxis};
use crate::subdivide::FrameChoice;
use crate::surface::SplineSurface;

/// A whole scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneDescription {
    /// The scene file.
    pub path: PathBuf,
    /// The camera; if none, one that frames all objects.
    pub camera: Option<CameraSettings>,
    /// The film.
    pub film: FilmSettings,
    /// What decides the picture besides the scene.
    pub render: RenderSettings,
    /// The materials, in the file's order; their names differ.
    pub materials: Vec<NamedMaterial>,
    /// The lights; if none are listed at all, [`SceneDescription::build`] lights the scene from the camera's side.
    pub lights: Option<Vec<LightDescription>>,
    /// The objects, at least one; their names differ.
    pub objects: Vec<ObjectDescription>,
    /// Whether drags that contradict each other are met as nearly as possible instead of being an error.
    pub least_squares: bool,
}

impl SceneDescription {
    /// The material of `object`, or the default one.
    ///
    /// # Panics
    /// If `object` belongs to another scene with more materials.
    #[must_use]
    pub fn material_of(&self, object: &ObjectDescription) -> Material {
        object.material.map(|index| self.materials[index].material.clone()).unwrap_or_default()
    }
}

/// A light as the scene file gives it.
#[derive(Clone, Debug, PartialEq)]
pub enum LightDescription {
    /// One that names no other file.
    Complete(Light),
    /// [`Light::Envmap`], whose picture is not read yet.
    Envmap {
        /// The picture's file, on the path of the scene file's folder.
        file: Located<PathBuf>,
        /// Factor of the radiance.
        scale: f64,
        /// Turns the picture.
        to_world: DAffine3,
    },
}

/// A material and the name that objects call it by.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterial {
    /// Its name.
    pub name: Located<String>,
    /// The material.
    pub material: Material,
}

/// One object: a mesh, placed, then deformed.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectDescription {
    /// Its name.
    pub name: Located<String>,
    /// What it is before it is placed and deformed.
    pub shape: ObjectShape,
    /// Index into the scene's materials; if none, the default material.
    pub material: Option<usize>,
    /// Places the mesh in the world before it is deformed; invertible.
    pub transform: DAffine3,
    /// Whether shading uses the mesh's normals, carried along by the deformation, instead of the surface's own.
    pub vertex_normals: bool,
    /// How the deformed shape is represented.
    pub method: Method,
    /// The deformations, in the order they apply.
    pub deform: Vec<Located<DeformDescription>>,
}

/// An object before it is placed and deformed.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectShape {
    /// A mesh file, on the path of the scene file's folder.
    Mesh(Located<PathBuf>),
    /// A parametric surface.
    Surface(Located<SplineSurface>),
}

impl ObjectShape {
    /// Where the scene file gives it.
    #[must_use]
    pub const fn location(&self) -> Location {
        match self {
            Self::Mesh(mesh) => mesh.location,
            Self::Surface(surface) => surface.location,
        }
    }

    /// The mesh file, if it is a mesh.
    #[must_use]
    pub fn mesh(&self) -> Option<&Path> {
        match self {
            Self::Mesh(mesh) => Some(&mesh.value),
            Self::Surface(_) => None,
        }
    }
}

/// How a deformed shape is represented for tracing.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Method {
    /// Trimmed Bézier patches, without approximation.
    #[default]
    Exact,
    /// Triangular Bézier patches, one for each triangle of the mesh in each knot box: as exact, the method before.
    Triangular,
    /// Flat triangles, each of the mesh's split into 4^level, with their corners alone deformed.
    Pointwise {
        /// How often triangles are split.
        level: u32,
    },
    /// Flat triangles with corners on the deformed shape, halved until they are close enough to it.
    Adaptive {
        /// Greatest distance between triangles and shape, in world units; above 0.
        tolerance: f64,
    },
}

impl std::fmt::Display for Method {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Exact => write!(formatter, "exact"),
            Self::Triangular => write!(formatter, "triangular"),
            Self::Pointwise { level } => write!(formatter, "pointwise:{level}"),
            Self::Adaptive { tolerance } => write!(formatter, "adaptive:{tolerance}"),
        }
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // the part after the colon is the method's parameter
        let (name, parameter) = match text.split_once(':') {
            Some((name, parameter)) => (name, Some(parameter)),
            None => (text, None),
        };
        let known = ["exact", "pointwise", "adaptive", "triangular"];
        match (lookup("method", &known, name)?, parameter) {
            (0, None) => Ok(Self::Exact),
            (3, None) => Ok(Self::Triangular),
            (0 | 3, Some(_)) => Err(format!("method {name} takes no parameter: write {name} alone")),
            (1, parameter) => {
                let level =
                    parameter.and_then(|level| level.parse().ok()).filter(|&level| level <= MAX_LEVEL);
                level.map(|level| Self::Pointwise { level }).ok_or_else(|| {
                    format!("method pointwise needs how often triangles are split, 0 to {MAX_LEVEL}: write pointwise:2")
                })
            }
            (_, parameter) => {
                let tolerance = parameter.and_then(|tolerance| tolerance.parse::<f64>().ok());
                let tolerance = tolerance.filter(|tolerance| tolerance.is_finite() && *tolerance > 0.0);
                tolerance.map(|tolerance| Self::Adaptive { tolerance }).ok_or_else(|| {
                    "method adaptive needs the greatest distance from the surface, in world units, above 0: write adaptive:1e-3"
                        .to_owned()
                })
            }
        }
    }
}

/// One deformation of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum DeformDescription {
    /// By a lattice.
    Ffd(FfdDescription),
    /// By extension functions of a surface's parameters.
    Extension(Extension),
}

/// A free-form deformation by a B-spline volume over a box.
#[derive(Clone, Debug, PartialEq)]
pub struct FfdDescription {
    /// Degree along each axis, in `1..=4`.
    pub degree: [usize; 3],
    /// Control points along each axis, more than the degree.
    pub points: [usize; 3],
    /// Least and greatest corner of the lattice's box, with extent along every axis; if none, the
    /// bounding box of the object after its transform.
    pub bounds: Option<[DVec3; 2]>,
    /// What happens to parts of the object outside the box.
    pub outside: Outside,
    /// Outermost layers of control points that stay.
    pub hold: usize,
    /// The frames of the patches.
    pub frame: FrameChoice,
    /// Edits of the lattice, in the order they apply.
    pub edits: Vec<Located<Edit>>,
}

/// What happens to parts of an object outside the lattice's box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Outside {
    /// They stay as they are.
    #[default]
    Keep,
    /// They are an error.
    Error,
}

impl FromStr for SignedAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (negative, name) = match text.strip_prefix('-') {
            Some(name) => (true, name),
            None => (false, text.strip_prefix('+').unwrap_or(text)),
        };
        let axis = Axis::from_name(name)?;
        Ok(Self { axis, negative })
    }
}

/// An edit of a lattice's control points.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Moves one control point.
    Move {
        /// Its index along each axis, inside the lattice and not held.
        index: [usize; 3],
        /// Where it goes.
        to: MoveTo,
    },
    /// Turns about the box's centre line by the right-hand rule.
    Twist {
        /// Direction of the centre line.
        axis: Axis,
        /// Degrees at the far end, 0 at the near end.
        angle: f64,
    },
    /// Scales across the box's centre line.
    Taper {
        /// Direction of the centre line.
        axis: Axis,
        /// Factors at the far end along [`Axis::cross_axes`], 1 at the near end.
        scale: [f64; 2],
    },
    /// Bends the box's centre line to a circle's arc (Barr 1984).
    Bend {
        /// Direction of the centre line.
        axis: Axis,
        /// Degrees at the far end, 0 at the near end.
        angle: f64,
        /// The side that the far end bends to; across `axis`.
        toward: SignedAxis,
    },
    /// Distance from the centre line times `1 + amount·sin(π z)`, z in `[0, 1]` along the axis.
    Bulge {
        /// Direction of the centre line.
        axis: Axis,
        /// Growth in the middle.
        amount: f64,
    },
    /// Sets the weight of one control point.
    Weight {
        /// Its index along each axis, inside the lattice and not held.
        index: [usize; 3],
        /// The weight, above 0.
        value: f64,
    },
    /// Moves points of the object to targets, by the least change of the lattice.
    Drag(DragDescription),
    /// Sets all control points.
    ControlPoints {
        /// A `.npy` file, on the path of the scene file's folder.
        path: PathBuf,
    },
}

/// Points of the object that are dragged together.
#[derive(Clone, Debug, PartialEq)]
pub struct DragDescription {
    /// The points.
    pub sources: DragSources,
    /// Where each must go.
    pub targets: Vec<DVec3>,
    /// What of the lattice changes.
    pub using: DragUsing,
}

/// How dragged points are given.
#[derive(Clone, Debug, PartialEq)]
pub enum DragSources {
    /// On the undeformed object, as the deformation receives it.
    Points(Vec<DVec3>),
    /// As the camera sees them after the edits before: places in the picture, in pixels from its top left corner.
    Pixels(Vec<DVec2>),
}

/// What drags change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DragUsing {
    /// Places of control points.
    Points,
    /// Weights, each at least this times the least one before.
    Weights {
        /// The factor, above 0.
        min_weight: f64,
    },
}

/// Where a control point is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MoveTo {
    /// By this much from where it is.
    By(DVec3),
    /// To this place.
    To(DVec3),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_parse() {
        assert_eq!("exact".parse(), Ok(Method::Exact));
        assert_eq!("triangular".parse(), Ok(Method::Triangular));
        assert_eq!(Method::Triangular.to_string(), "triangular");
        for (text, message) in [
            (
                "exat",
                r#"unknown method "exat" (known: exact, pointwise, adaptive, triangular); did you mean "exact"?"#,
            ),
            ("exact:2", "method exact takes no parameter: write exact alone"),
            ("triangular:2", "method triangular takes no parameter: write triangular alone"),
            ("pointwise", "method pointwise needs how often triangles are split, 0 to 12: write pointwise:2"),
            (
                "pointwise:13",
                "method pointwise needs how often triangles are split, 0 to 12: write pointwise:2",
            ),
            (
                "adaptive:0",
                "method adaptive needs the greatest distance from the surface, in world units, above 0: write adaptive:1e-3",
            ),
        ] {
            assert_eq!(text.parse::<Method>(), Err(message.to_owned()));
        }
    }

    #[test]
    fn signed_axes_parse() {
        for (text, axis, negative) in [("x", Axis::X, false), ("+y", Axis::Y, false), ("-z", Axis::Z, true)] {
            assert_eq!(text.parse(), Ok(SignedAxis { axis, negative }));
        }
        assert!("--x".parse::<SignedAxis>().is_err());
    }
}
