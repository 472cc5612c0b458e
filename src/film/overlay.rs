//! Lines and dots drawn over a picture.

use glam::{DVec2, DVec3};

use super::image::Image;

/// Draws over the colours of a picture, at places in pixels from the full frame's top left corner.
#[derive(Debug)]
pub struct Overlay<'a> {
    image: &'a mut Image,
}

impl<'a> Overlay<'a> {
    /// Over R, G, B and A of a picture, those that there are.
    pub const fn new(image: &'a mut Image) -> Self {
        Self { image }
    }

    /// A line with round ends, its rim blended over one pixel.
    pub fn line(&mut self, [from, to]: [DVec2; 2], width: f64, colour: DVec3) {
        if !(from.is_finite() && to.is_finite()) {
            return;
        }
        let reach = 0.5 * width + 1.0;
        let way = to - from;
        let covered = |centre: DVec2| {
            let along = ((centre - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
            // a line without length is a dot
            let nearest = if along.is_nan() { from } else { from + along * way };
            (0.5 * width + 0.5 - centre.distance(nearest)).clamp(0.0, 1.0)
        };
        self.blend([from.min(to) - reach, from.max(to) + reach], covered, colour);
    }

    /// A disk, its rim blended over one pixel.
    pub fn dot(&mut self, centre: DVec2, radius: f64, colour: DVec3) {
        self.line([centre, centre], 2.0 * radius, colour);
    }

    /// Blends a colour into the pixels of a box by how much of each is covered.
    fn blend(&mut self, [low, high]: [DVec2; 2], covered: impl Fn(DVec2) -> f64, colour: DVec3) {
        let window = self.image.data_window();
        let (x, y) = (f64::from(window.x), f64::from(window.y));
        let first = low.max(DVec2::new(x, y)).floor();
        let last =
            high.min(DVec2::new(x + f64::from(window.width), y + f64::from(window.height)) - 1.0).ceil();
        let mut row = first.y;
        while row <= last.y {
            let mut column = first.x;
            while column <= last.x {
                let share = covered(DVec2::new(column + 0.5, row + 0.5));
                if share > 0.0 {
                    #[expect(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "within the window"
                    )]
                    self.image.blend([column as u32, row as u32], colour, share);
                }
                column += 1.0;
            }
            row += 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Window;

    #[test]
    fn dots_and_lines_cover_their_pixels() {
        let names = ["R", "A"].map(str::to_owned);
        let window = Window { x: 2, y: 1, width: 12, height: 8 };
        let mut image = Image::new([20, 20], window, &names);
        let mut overlay = Overlay::new(&mut image);
        overlay.line([DVec2::new(-50.0, 4.5), DVec2::new(50.0, 4.5)], 1.0, DVec3::ONE);
        overlay.dot(DVec2::new(6.0, 7.0), 1.0, DVec3::splat(0.5));
        overlay.dot(DVec2::NAN, 1.0, DVec3::ONE);
        overlay.dot(DVec2::new(1000.0, -1000.0), 3.0, DVec3::ONE);
        let red = |x, y| image.channel("R").unwrap()[window.index([x, y])];
        assert!((2..14).all(|x| red(x, 4) == 1.0 && red(x, 2) == 0.0));
        assert!(red(5, 6) > 0.3 && red(6, 7) > 0.3 && red(9, 7) == 0.0);
        assert_eq!(image.channel("A").unwrap()[window.index([2, 4])], 1.0);
    }
}
