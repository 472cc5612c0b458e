//! Values that a scene file or a flag chooses by their names.

use crate::suggestion::lookup;

pub use crate::suggestion::UnknownName;

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
    /// If there is no such value; the message lists the known names.
    fn from_name(name: &str) -> Result<Self, UnknownName> {
        let names = Self::names();
        let index = lookup(Self::WHAT, &names, name)?;
        Ok(Self::ALL[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Aov, Filter};
    use crate::model::Outside;
    use crate::shade::{
        FovAxis, IntegratorKind, MicrofacetDistribution, SamplerKind, TextureFilter, TextureWrap,
    };
    use crate::spline::Axis;
    use crate::subdivide::FrameChoice;
    use crate::suggestion::quoted;

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
            assert_eq!(
                IntegratorKind::from_name(name).map_err(|error| error.to_string()),
                Err(message.to_owned())
            );
        }
    }

    #[test]
    fn long_text_is_shortened_on_one_line() {
        let shown = quoted(&"a\n".repeat(100));
        assert!(!shown.contains('\n'));
        assert!(shown.ends_with("…\""));
    }
}
