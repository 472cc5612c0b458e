//! How far one picture is from another.
//!
//! [`compare`] does what OpenImageIO's `idiff` documents, channel by channel and part by part, and is not fooled where that
//! program is: NaN and infinities that only one picture has are failures whatever the thresholds, channels and parts are matched
//! by name, windows must agree, and hard thresholds and warnings count also if nothing else fails. [`z_test`] tells noise from
//! differences, [`Metric`] measures pictures as a whole.

mod angle;
mod colour_picture;
mod colours;
mod comparison;
mod flip;
mod metrics;
mod pairing;
mod pixels;
mod ssim;
#[cfg(test)]
mod testing;
mod thresholds;
mod ulp;
mod why;
mod worst;
mod ztest;

pub use angle::Angles;
pub use colour_picture::ColourPicture;
pub use colours::Colours;
pub use comparison::{CompareError, CompareSettings, Comparison, Judge, LayerDifference, compare};
pub use flip::{
    Exposures, HdrFlip, PIXELS_PER_DEGREE, hdr_flip, ldr_flip, ldr_flip_of_linear, magma, mean_error,
    srgb_from_linear,
};
pub use metrics::{ErrorMap, Measured, Metric};
pub use pairing::{LayerKind, Mismatch, with_black_outside};
pub use pixels::{Figures, Place, Status};
pub use ssim::{Ssim, ssim};
pub use thresholds::{LayerRule, LayerRuleError, Thresholds};
pub use why::why;
pub use worst::{WorstPixel, difference_layers};
pub use ztest::{Estimate, MeanDifference, ZTest, z_test};
