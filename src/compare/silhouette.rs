//! Silhouettes in the picture, to a millionth of a pixel.

use glam::{DVec2, DVec3};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;

use crate::shade::Camera;
use crate::trace::{BoxTree, TracedScene, Tracer};

/// Halvings of a pixel's side in search of where the object changes.
const HALVINGS: u32 = 20;

/// Where the objects that rays from the camera hit change from one to another, or to none: the outlines against the background
/// and against other objects, along the lines between pixels.
#[derive(Clone, Debug, Default)]
pub struct Silhouette {
    /// Where lines of the pixel grid cross it.
    points: Vec<DVec2>,
    /// Between the crossings on the sides of one pixel.
    segments: Vec<[DVec2; 2]>,
}

/// Distances between two silhouettes, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SilhouetteError {
    /// The greatest of a point of either from the other (Hausdorff's distance).
    pub max: f64,
    /// The mean.
    pub mean: f64,
}

impl Silhouette {
    /// The silhouette of a scene in a picture of this width and height in pixels.
    #[must_use]
    pub fn seen_by(scene: &TracedScene, camera: &Camera, [width, height]: [u32; 2]) -> Self {
        let object = |tracer: &mut Tracer<'_>, pixel: DVec2| {
            tracer.closest(&camera.ray(pixel, DVec2::ZERO)).map(|hit| hit.object)
        };
        let columns = width + 1;
        let corner = |x: u32, y: u32| DVec2::new(f64::from(x), f64::from(y));
        let grid: Vec<Option<u32>> = (0..columns * (height + 1))
            .into_par_iter()
            .map_init(
                || scene.tracer(),
                |tracer, index| object(tracer, corner(index % columns, index / columns)),
            )
            .collect();
        let at = |x: u32, y: u32| grid[(y * columns + x) as usize];
        let crossing =
            |tracer: &mut Tracer<'_>, [mut a, mut b]: [DVec2; 2], [of_a, of_b]: [Option<u32>; 2]| {
                if of_a == of_b {
                    return None;
                }
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (a + b);
                    if object(tracer, middle) == of_a { a = middle } else { b = middle }
                }
                Some(0.5 * (a + b))
            };
        // the lines to the right of each corner and below it
        let crossings: Vec<[Option<DVec2>; 2]> = (0..columns * (height + 1))
            .into_par_iter()
            .map_init(
                || scene.tracer(),
                |tracer, index| {
                    let (x, y) = (index % columns, index / columns);
                    let mut toward = |dx: u32, dy: u32| {
                        crossing(
                            tracer,
                            [corner(x, y), corner(x + dx, y + dy)],
                            [at(x, y), at(x + dx, y + dy)],
                        )
                    };
                    [
                        (x < width).then(|| toward(1, 0)).flatten(),
                        (y < height).then(|| toward(0, 1)).flatten(),
                    ]
                },
            )
            .collect();
        let line = |x: u32, y: u32, axis: usize| crossings[(y * columns + x) as usize][axis];
        let mut segments = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let sides = [line(x, y, 0), line(x + 1, y, 1), line(x, y + 1, 0), line(x, y, 1)];
                let found: Vec<DVec2> = sides.into_iter().flatten().collect();
                for (i, &from) in found.iter().enumerate() {
                    segments.extend(found[i + 1..].iter().map(|&to| [from, to]));
                }
            }
        }
        Self { points: crossings.into_iter().flatten().flatten().collect(), segments }
    }

    /// How far it is from another one, both ways; `None` if only one of them has any point.
    #[must_use]
    pub fn error(&self, other: &Self) -> Option<SilhouetteError> {
        if self.segments.is_empty() && other.segments.is_empty() {
            return Some(SilhouetteError::default());
        }
        if self.segments.is_empty() || other.segments.is_empty() {
            return None;
        }
        let distances: Vec<f64> =
            self.distances_to(other).into_iter().chain(other.distances_to(self)).collect();
        let max = distances.iter().fold(0.0, |most: f64, &distance| most.max(distance));
        Some(SilhouetteError { max, mean: distances.iter().sum::<f64>() / distances.len() as f64 })
    }

    fn distances_to(&self, other: &Self) -> Vec<f64> {
        let deep = |p: DVec2| p.extend(0.0);
        let boxes: Vec<[DVec3; 2]> =
            other.segments.iter().map(|[a, b]| [deep(a.min(*b)), deep(a.max(*b))]).collect();
        let tree = BoxTree::build(&boxes);
        let distance = |point: DVec2| {
            let mut nearest = f64::INFINITY;
            tree.nearest(deep(point), nearest, |index| {
                nearest = nearest.min(to_segment(other.segments[index], point));
                nearest
            });
            nearest
        };
        self.points.iter().map(|&point| distance(point)).collect()
    }
}

fn to_segment([a, b]: [DVec2; 2], point: DVec2) -> f64 {
    let along = b - a;
    let fraction = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    // NaN for a segment without length
    point.distance(if fraction.is_nan() { a } else { a + fraction * along })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::{CameraSettings, Projection};
    use crate::subdivide::FrameChoice;
    use crate::test_support::{cube_triangles, deform, scene_of};

    /// A camera that sees the unit square as `pixels` of a picture of 32, straight from above, moved to the side.
    fn above(pixels: f64, aside: f64) -> Camera {
        let target = DVec3::new(0.5 + aside / pixels, 0.5, 0.5);
        let settings = CameraSettings {
            origin: target + 5.0 * DVec3::Z,
            target,
            up: DVec3::Y,
            projection: Projection::Orthographic { width: 32.0 / pixels },
        };
        Camera::try_new(&settings, [32, 32]).unwrap()
    }

    #[test]
    fn silhouettes_are_as_far_apart_as_they_were_moved() {
        let scene = scene_of(deform(&cube_triangles(), None, FrameChoice::Parallelogram));
        let at = |pixels, aside| Silhouette::seen_by(&scene, &above(pixels, aside), [32, 32]);
        let here = at(17.3, 0.0);
        assert_eq!(here.error(&here), Some(SilhouetteError::default()));
        // corners are cut within one pixel: half its diagonal at most
        for aside in [1e-4, 0.01, 0.3] {
            let error = here.error(&at(17.3, aside)).unwrap();
            assert!((error.max - aside).abs() < 0.3 * aside + 1e-5, "{aside}: {error:?}");
            assert!(error.mean < aside, "{aside}: {error:?}");
        }
        let grown = here.error(&at(18.3, 0.0)).unwrap();
        assert!(grown.max >= 0.5 && grown.max < 0.71 + 0.71, "{grown:?}");
        assert!((grown.mean - 0.5).abs() < 0.05, "{grown:?}");
        let empty = at(1e3, 1e9);
        assert_eq!(here.error(&empty), None);
        assert_eq!(empty.error(&empty), Some(SilhouetteError::default()));
    }
}
