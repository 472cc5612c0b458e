//! Names that a scene file or a flag chooses from, and what to say of any other name.

use crate::film::{Aov, Filter};
use crate::model::Outside;
use crate::shade::{
    FovAxis, IntegratorKind, MicrofacetDistribution, SamplerKind, TextureFilter, TextureWrap,
};
use crate::spline::Axis;
use crate::subdivide::FrameChoice;

pub(super) use crate::suggestion::{closest, did_you_mean, lookup, quoted, shortened};

/// A value that is chosen by its name.
pub trait Choice: Copy + 'static {
    /// What is chosen, for messages.
    const WHAT: &'static str;
    /// All values, in the order they are listed to users.
    const ALL: &'static [Self];

    /// The name.
    fn name(self) -> &'static str;

    /// All names, in the order of [`Choice::ALL`].
    #[must_use]
    fn names() -> Vec<&'static str> {
        Self::ALL.iter().map(|choice| choice.name()).collect()
    }

    /// The value of a name.
    ///
    /// # Errors
    /// A message with the known names if there is no such value.
    fn from_name(name: &str) -> Result<Self, String> {
        let names = Self::names();
        let index = lookup(Self::WHAT, &names, name)?;
        Ok(Self::ALL[index])
    }
}

impl Choice for IntegratorKind {
    const WHAT: &'static str = "integrator";
    const ALL: &'static [Self] = &[Self::Path, Self::Direct];

    fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Direct => "direct",
        }
    }
}

impl Choice for SamplerKind {
    const WHAT: &'static str = "sampler";
    const ALL: &'static [Self] = &[Self::Independent, Self::Sobol];

    fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }
}

impl Choice for FovAxis {
    const WHAT: &'static str = "fov_axis";
    const ALL: &'static [Self] = &[Self::X, Self::Y, Self::Diagonal, Self::Smaller, Self::Larger];

    fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Diagonal => "diagonal",
            Self::Smaller => "smaller",
            Self::Larger => "larger",
        }
    }
}

impl Choice for Filter {
    const WHAT: &'static str = "filter";
    const ALL: &'static [Self] =
        &[Self::Box, Self::Tent, Self::Gaussian, Self::Mitchell, Self::CatmullRom, Self::Lanczos];

    fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Tent => "tent",
            Self::Gaussian => "gaussian",
            Self::Mitchell => "mitchell",
            Self::CatmullRom => "catmullrom",
            Self::Lanczos => "lanczos",
        }
    }
}

impl Choice for MicrofacetDistribution {
    const WHAT: &'static str = "distribution";
    const ALL: &'static [Self] = &[Self::Beckmann, Self::Ggx];

    fn name(self) -> &'static str {
        match self {
            Self::Beckmann => "beckmann",
            Self::Ggx => "ggx",
        }
    }
}

impl Choice for TextureFilter {
    const WHAT: &'static str = "texture filter";
    const ALL: &'static [Self] = &[Self::Bilinear, Self::Nearest];

    fn name(self) -> &'static str {
        match self {
            Self::Bilinear => "bilinear",
            Self::Nearest => "nearest",
        }
    }
}

impl Choice for TextureWrap {
    const WHAT: &'static str = "wrap";
    const ALL: &'static [Self] = &[Self::Repeat, Self::Mirror, Self::Clamp];

    fn name(self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Mirror => "mirror",
            Self::Clamp => "clamp",
        }
    }
}

impl Choice for Aov {
    const WHAT: &'static str = "aov";
    const ALL: &'static [Self] = &Self::ALL;

    fn name(self) -> &'static str {
        Self::name(self)
    }
}

impl Choice for Axis {
    const WHAT: &'static str = "axis";
    const ALL: &'static [Self] = &[Self::X, Self::Y, Self::Z];

    fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

impl Choice for Outside {
    const WHAT: &'static str = "outside";
    const ALL: &'static [Self] = &[Self::Keep, Self::Error];

    fn name(self) -> &'static str {
        match self {
            Self::Keep => "keep",
            Self::Error => "error",
        }
    }
}

impl Choice for FrameChoice {
    const WHAT: &'static str = "frame";
    const ALL: &'static [Self] = &[Self::Parallelogram, Self::Rectangle];

    fn name(self) -> &'static str {
        match self {
            Self::Parallelogram => "parallelogram",
            Self::Rectangle => "rectangle",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip<C: Choice + PartialEq + std::fmt::Debug>() {
        for choice in C::ALL {
            assert_eq!(C::from_name(choice.name()), Ok(*choice));
        }
    }

    #[test]
    fn names_round_trip() {
        round_trip::<IntegratorKind>();
        round_trip::<SamplerKind>();
        round_trip::<FovAxis>();
        round_trip::<Filter>();
        round_trip::<Aov>();
        round_trip::<MicrofacetDistribution>();
        round_trip::<TextureFilter>();
        round_trip::<TextureWrap>();
        round_trip::<Axis>();
        round_trip::<Outside>();
        round_trip::<FrameChoice>();
    }

    #[test]
    fn unknown_names_list_the_known() {
        for (name, message) in [
            ("pth", r#"unknown integrator "pth" (known: path, direct); did you mean "path"?"#),
            ("Direct", r#"unknown integrator "Direct" (known: path, direct); did you mean "direct"?"#),
            ("volume", r#"unknown integrator "volume" (known: path, direct)"#),
            ("", r#"unknown integrator "" (known: path, direct)"#),
        ] {
            assert_eq!(IntegratorKind::from_name(name), Err(message.to_owned()));
        }
    }

    #[test]
    fn long_text_is_shortened_on_one_line() {
        let shown = quoted(&"a\n".repeat(100));
        assert!(!shown.contains('\n'));
        assert!(shown.ends_with("…\""));
    }
}
