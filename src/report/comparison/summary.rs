//! A scene's figures in plain words.

use super::is_exact;
use crate::compare::{MethodFigures, SceneFigures};
use crate::report::numbers::{about, count, scientific, share, short};

/// What is called rounding, in parts of the diagonal: far more than a few operations make, far less than any approximation here.
const ROUNDING: f64 = 1e-10;

/// Sentences: how far the coarsest pointwise level is off, from which level on the silhouette is within a pixel, what the exact
/// patches are, and how far noise goes.
pub(super) fn summary(figures: &SceneFigures) -> Vec<String> {
    let methods = &figures.methods;
    let exact = methods.iter().find(|method| is_exact(method) && !method.noise);
    let noise = methods.iter().find(|method| method.noise);
    let sentences =
        [coarsest(methods), within_a_pixel(figures), exact.and_then(exactness), noise.and_then(noisiness)];
    sentences.into_iter().flatten().collect()
}

fn coarsest(methods: &[MethodFigures]) -> Option<String> {
    let levels = methods.iter().filter_map(|method| Some((method.kind.level()?, method)));
    let (level, method) = levels.min_by_key(|(level, _)| *level)?;
    let shape = method.deviation.map(|found| format!("{} of its diagonal", share(found.max)));
    let outline = method.silhouette.map(|found| format!("{} px at the silhouette", short(found.max)));
    let off: Vec<String> = shape.into_iter().chain(outline).collect();
    let triangles = count(method.triangles);
    let off = (!off.is_empty()).then(|| off.join(" and "))?;
    Some(format!("Pointwise at level {level}, with {triangles} triangles, is off by up to {off}."))
}

fn within_a_pixel(figures: &SceneFigures) -> Option<String> {
    let found =
        figures.needed.iter().find(|needed| needed.quantity == "silhouette" && needed.below == 1.0)?;
    let (level, triangles) = (found.level, about(found.triangles));
    Some(if found.extrapolated {
        format!(
            "Extrapolated, it takes level {level}, about {triangles} triangles, to get the silhouette within a pixel."
        )
    } else {
        format!("From level {level} on, with {triangles} triangles, the silhouette is within a pixel.")
    })
}

fn exactness(exact: &MethodFigures) -> Option<String> {
    let deviation = exact.deviation?;
    let made = match (exact.triangles, exact.patches) {
        (0, patches) => format!("{} patches", count(patches)),
        (triangles, patches) => format!("{} patches for {} triangles", count(patches), count(triangles)),
    };
    let off = match deviation.max {
        0.0 => "do not deviate at all".to_owned(),
        max if max < ROUNDING => format!("deviate by {} of the diagonal, which is rounding", scientific(max)),
        max => format!("deviate by {} of the diagonal", scientific(max)),
    };
    Some(format!("The exact shape's {made} {off}."))
}

fn noisiness(noise: &MethodFigures) -> Option<String> {
    let flip = noise.image.as_ref().map(|image| image.flip).filter(|flip| flip.is_finite())?;
    Some(if flip == 0.0 {
        "The pictures are free of noise: with another seed the exact one is the same.".to_owned()
    } else {
        let flip = short(flip);
        format!(
            "Another seed alone, which is noise, makes a FLIP of {flip}; all methods have the exact one's random numbers, so that smaller differences show too."
        )
    })
}
