//! The affine frame of a coplanar group, and the degrees of its surface.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 3.3.3 and Table 1 (the rectangle); the parallelogram is the
//! affine frame of lowest degree.

use glam::{DVec2, DVec3};

use super::coplanar::Plane;
use crate::math::bounds;

/// Which frame a patch's parameters live in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FrameChoice {
    /// The affine frame of lowest degree: (K - k1) × (K - k2) in a general plane, with K the sum of the volume's
    /// degrees and k1, k2 its two largest.
    #[default]
    Parallelogram,
    /// The orthogonal frame of Feng et al. (2002), Table 1: (K - k1) × K in a general plane.
    Rectangle,
}

/// The affine map from a patch's unit square to the plane of its undeformed polygons:
/// `origin + s · frame.s + t · frame.t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The point at (0, 0).
    pub origin: DVec3,
    /// From (0, 0) to (1, 0).
    pub s: DVec3,
    /// From (0, 0) to (0, 1).
    pub t: DVec3,
}

impl Frame {
    /// The point of the plane at the given parameters.
    pub fn point(&self, st: DVec2) -> DVec3 {
        self.origin + st.x * self.s + st.y * self.t
    }

    /// The frame whose unit square is the rectangle `[low, high]` of this one's parameters.
    pub(crate) fn restricted(&self, low: DVec2, high: DVec2) -> Self {
        let size = high - low;
        Self { origin: self.point(low), s: size.x * self.s, t: size.y * self.t }
    }
}

/// A frame with what finds parameters in it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DualFrame {
    frame: Frame,
    /// The parameters of a point of the plane are its products with these, from the origin.
    dual: [DVec3; 2],
}

/// A frame with the degrees that a volume's piece has along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FramedPlane {
    pub(crate) frame: Frame,
    pub(crate) degree: [usize; 2],
    dual: [DVec3; 2],
}

impl FramedPlane {
    /// The parameters of a point of the plane.
    pub(crate) fn parameters(&self, point: DVec3) -> DVec2 {
        let offset = point - self.frame.origin;
        DVec2::new(self.dual[0].dot(offset), self.dual[1].dot(offset))
    }
}

/// How much larger than in the knot box a volume's piece may get on the frame's parallelogram, as a bound on the
/// growth of its values and so of their rounding, before a frame of higher degree is taken.
///
/// The frame along the two axes with the smallest slopes stays below 5^4 = 625 at degree 4; its choice never fails.
const MAX_GROWTH: f64 = 1000.0;

/// What a frame is chosen for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameSettings {
    /// The volume's degrees.
    pub(crate) degree: [usize; 3],
    /// The extent of the knot box.
    pub(crate) box_size: DVec3,
    /// The least extent of a frame, a length: one around a sliver is wider than the sliver.
    ///
    /// Points of a patch are known to the rounding of their coordinates, whatever its size: to a patch as small as that
    /// they would say nothing of where in it they are.
    pub(crate) least: f64,
    pub(crate) choice: FrameChoice,
}

/// The bounding frame of the corners of a group, right-handed with the plane's normal, and its degrees.
///
/// A direction's degree is the sum of the volume's degrees over the axes that change along it. `None` if the corners are at
/// one place along a direction of the frame and its least extent is 0.
pub(crate) fn frame_group(plane: &Plane, corners: &[DVec3], settings: &FrameSettings) -> Option<FramedPlane> {
    let degree = settings.degree;
    let nonzero = (0..3).filter(|&axis| plane.normal[axis] != 0.0).count();
    let DualFrame { frame, dual } = match (settings.choice, nonzero) {
        (FrameChoice::Rectangle, 2..) => rectangle(plane, corners, settings)?,
        _ => parallelogram(plane, corners, settings)?,
    };
    let sum = |direction: DVec3| (0..3).filter(|&axis| direction[axis] != 0.0).map(|axis| degree[axis]).sum();
    let degree = [sum(frame.s), sum(frame.t)];
    Some(FramedPlane { frame, degree, dual })
}

/// An interval, made as long as `least` about its middle if it is shorter.
fn widened((low, high): (f64, f64), least: f64) -> (f64, f64) {
    if high - low >= least {
        return (low, high);
    }
    let start = low - 0.5 * (least - (high - low));
    (start, start + least)
}

/// The plane as a graph over a rectangle in the two axes that are not `dependent`.
///
/// The direction along each of the two changes the dependent axis too, unless the normal has no component along
/// its own: so each omits the other axis.
fn parallelogram(plane: &Plane, corners: &[DVec3], settings: &FrameSettings) -> Option<DualFrame> {
    let FrameSettings { degree, box_size, least, .. } = *settings;
    let n = plane.normal;
    let candidates = (0..3).filter(|&axis| n[axis] != 0.0);
    let dependent = candidates.min_by(|&a, &b| {
        let cost = |axis: usize| {
            let control_points = graph_control_points(n, axis, degree);
            let growth = growth(n, axis, degree, box_size);
            (if growth <= MAX_GROWTH { control_points } else { usize::MAX }, growth)
        };
        let ((points_a, growth_a), (points_b, growth_b)) = (cost(a), cost(b));
        points_a.cmp(&points_b).then(growth_a.total_cmp(&growth_b))
    })?;
    let (along_s, along_t) = order_of_axes(n, dependent, degree);
    // e_(d+1) x e_(d+2) = e_d
    let flips = (along_s == (dependent + 1) % 3) == (n[dependent] < 0.0);
    let [mut low, mut high] = bounds::around(corners.iter().copied());
    for along in [along_s, along_t] {
        (low[along], high[along]) = widened((low[along], high[along]), least);
    }
    let direction = |along: usize, length: f64| {
        let mut vector = DVec3::ZERO;
        vector[along] = length;
        vector[dependent] = -n[along] / n[dependent] * length + 0.0;
        vector
    };
    let s = direction(along_s, high[along_s] - low[along_s]);
    let t =
        direction(along_t, if flips { low[along_t] - high[along_t] } else { high[along_t] - low[along_t] });
    let mut origin = low;
    if flips {
        origin[along_t] = high[along_t];
    }
    let offset = origin - plane.anchor;
    origin[dependent] = plane.anchor[dependent]
        - (n[along_s] * offset[along_s] + n[along_t] * offset[along_t]) / n[dependent];
    let dual = [DVec3::AXES[along_s] / s[along_s], DVec3::AXES[along_t] / t[along_t]];
    (s[along_s] != 0.0 && t[along_t] != 0.0).then_some(DualFrame { frame: Frame { origin, s, t }, dual })
}

/// Which of the two free axes s follows: as in Table 1 where the normal has zeros, else the one that gives the lower
/// degree.
fn order_of_axes(n: DVec3, dependent: usize, degree: [usize; 3]) -> (usize, usize) {
    let (first, second) = ((dependent + 1) % 3, (dependent + 2) % 3);
    let swap = match (n[first] == 0.0, n[second] == 0.0) {
        (true, _) => false,
        (false, true) => true,
        (false, false) => degree[first] > degree[second],
    };
    if swap { (second, first) } else { (first, second) }
}

/// Control points of the graph over the two axes that are not `dependent`.
fn graph_control_points(n: DVec3, dependent: usize, degree: [usize; 3]) -> usize {
    (0..3)
        .filter(|&axis| axis != dependent)
        .map(|axis| degree[axis] + if n[axis] != 0.0 { degree[dependent] } else { 0 } + 1)
        .product()
}

/// Bound on the growth of a polynomial of the dependent axis' degree where the graph leaves the knot box:
/// (1 + 2 overshoot)^k, with the overshoot in box heights.
fn growth(n: DVec3, dependent: usize, degree: [usize; 3], box_size: DVec3) -> f64 {
    let overshoot: f64 = (0..3)
        .filter(|&axis| axis != dependent)
        .map(|axis| (n[axis] * box_size[axis] / (n[dependent] * box_size[dependent])).abs())
        .sum();
    let base = 1.0 + 2.0 * overshoot;
    (0..degree[dependent]).fold(1.0, |power, _| power * base)
}

/// Feng et al. (2002), Table 1, for normals with at least two components.
///
/// One component 0: s is that axis. None: s omits the axis of the largest degree; among equal ones the axis along
/// which the knot box is thinnest. t = n × s.
fn rectangle(plane: &Plane, corners: &[DVec3], settings: &FrameSettings) -> Option<DualFrame> {
    let FrameSettings { degree, box_size, least, .. } = *settings;
    let n = plane.normal;
    let s = if let Some(axis) = (0..3).find(|&axis| n[axis] == 0.0) {
        DVec3::AXES[axis]
    } else {
        let omitted = (0..3).max_by(|&a, &b| {
            degree[a].cmp(&degree[b]).then(box_size[b].total_cmp(&box_size[a])).then(b.cmp(&a))
        })?;
        DVec3::AXES[omitted].cross(n).normalize()
    };
    let t = n.cross(s);
    let range = |direction: DVec3| {
        let places = corners.iter().map(|&corner| direction.dot(corner - plane.anchor));
        let range = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), x| (min.min(x), max.max(x)));
        widened(range, least)
    };
    let ((s_min, s_max), (t_min, t_max)) = (range(s), range(t));
    let (width, height) = (s_max - s_min, t_max - t_min);
    let mut origin = plane.anchor + s_min * s + t_min * t;
    if let Some(axis) = (0..3).find(|&axis| n[axis] == 0.0) {
        // copied, not computed
        let [low, high] = bounds::around(corners.iter().copied());
        origin[axis] = widened((low[axis], high[axis]), least).0;
    }
    (width > 0.0 && height > 0.0).then(|| DualFrame {
        frame: Frame { origin, s: width * s, t: height * t },
        dual: [s / width, t / height],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn framed(normal: DVec3, degree: [usize; 3], choice: FrameChoice) -> FramedPlane {
        let normal = normal.normalize();
        let plane = Plane { normal, anchor: DVec3::splat(0.5) };
        let a = normal.any_orthonormal_vector();
        let b = normal.cross(a);
        let corners: Vec<_> = [(0.3, 0.0), (0.0, 0.25), (-0.4, 0.1), (0.0, -0.2)]
            .map(|(x, y)| plane.anchor + x * a + y * b)
            .into();
        let settings = FrameSettings { degree, box_size: DVec3::ONE, least: 0.0, choice };
        let framed = frame_group(&plane, &corners, &settings).unwrap();
        let frame = &framed.frame;
        assert!(frame.s.cross(frame.t).normalize().dot(normal) > 1.0 - 1e-12, "right-handed for {normal}");
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &corner in &corners {
            let st = framed.parameters(corner);
            assert!((frame.point(st) - corner).length() < 1e-15 * 8.0, "round trip for {normal}");
            low = low.min(st);
            high = high.max(st);
        }
        assert!(
            low.abs().max_element() < 1e-14 && (high - 1.0).abs().max_element() < 1e-14,
            "tight: {low} {high}"
        );
        framed
    }

    #[test]
    fn degrees_follow_table_1() {
        use FrameChoice::{Parallelogram, Rectangle};
        let (ku, kv, kw) = (2, 3, 4);
        let k = ku + kv + kw;
        let cases = [
            (DVec3::X, [kv, kw]),
            (DVec3::NEG_X, [kv, kw]),
            (DVec3::Y, [kw, ku]),
            (DVec3::Z, [ku, kv]),
            (DVec3::NEG_Z, [ku, kv]),
        ];
        for (normal, want) in cases {
            for choice in [Rectangle, Parallelogram] {
                assert_eq!(framed(normal, [ku, kv, kw], choice).degree, want, "{normal} {choice:?}");
            }
        }
        let tilted = [
            (DVec3::new(0.0, 1.0, 2.0), [ku, kv + kw]),
            (DVec3::new(3.0, 0.0, -2.0), [kv, ku + kw]),
            (DVec3::new(-1.0, 1.5, 0.0), [kw, ku + kv]),
        ];
        for (normal, want) in tilted {
            assert_eq!(framed(normal, [ku, kv, kw], Rectangle).degree, want, "{normal}");
            assert_eq!(framed(normal, [ku, kv, kw], Parallelogram).degree, want, "{normal}");
        }
        let general = DVec3::new(1.0, -2.0, 1.5);
        assert_eq!(framed(general, [2, 3, 4], Rectangle).degree, [ku + kv, k]);
        assert_eq!(framed(general, [4, 3, 2], Rectangle).degree, [3 + 2, k]);
        assert_eq!(framed(general, [2, 3, 4], Parallelogram).degree, [k - 4, k - 3]);
        assert_eq!(framed(general, [4; 3], Parallelogram).degree, [8, 8]);
        assert_eq!(framed(general, [4; 3], Rectangle).degree, [8, 12]);
    }

    #[test]
    fn a_steep_plane_takes_a_frame_of_higher_degree_rather_than_leave_the_box_far() {
        let general = DVec3::new(1.0, 1.0, 1e-6);
        let got = framed(general, [3, 3, 2], FrameChoice::Parallelogram);
        assert_eq!(got.degree[0] * got.degree[1], 6 * 5, "3+3 by 2+3, not 3+2 by 3+2");
        assert!(got.frame.s.length() + got.frame.t.length() < 4.0);
    }

    #[test]
    fn a_sliver_has_a_frame_of_the_least_extent_about_it() {
        for choice in [FrameChoice::Parallelogram, FrameChoice::Rectangle] {
            for normal in [DVec3::Z, DVec3::NEG_X, DVec3::new(0.0, 1.0, -2.0), DVec3::new(1.0, -2.0, 1.5)] {
                let normal = normal.normalize();
                let plane = Plane { normal, anchor: DVec3::new(0.3, 0.7, 0.5) };
                let a = normal.any_orthonormal_vector();
                let b = normal.cross(a);
                let corners =
                    [(0.0, 0.0), (1e-12, 0.0), (0.0, 1e-13)].map(|(x, y)| plane.anchor + x * a + y * b);
                let settings = FrameSettings { degree: [2; 3], box_size: DVec3::ONE, least: 1e-5, choice };
                let framed = frame_group(&plane, &corners, &settings).unwrap();
                let Frame { s, t, .. } = framed.frame;
                assert!(s.cross(t).normalize().dot(normal) > 1.0 - 1e-12, "right-handed for {normal}");
                assert!(s.length().min(t.length()) > 0.99e-5 && s.length().max(t.length()) < 1e-4);
                for corner in corners {
                    let st = framed.parameters(corner);
                    assert!((st - 0.5).abs().max_element() < 1e-6, "in the middle: {st}");
                    assert!((framed.frame.point(st) - corner).length() < 1e-15);
                }
            }
        }
    }
}
