//! Pictures in a page, side by side in one place; the only file that names the `base64` crate.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::html;

use super::page::Html;

/// A picture to show.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// What it is.
    pub label: &'a str,
    /// A PNG file's bytes.
    pub png: &'a [u8],
}

impl Shown<'_> {
    /// The picture within the page.
    pub(super) fn uri(&self) -> String {
        format!("data:image/png;base64,{}", STANDARD.encode(self.png))
    }
}

/// A picture with its label below.
#[must_use]
pub fn figure(picture: &Shown<'_>) -> Html {
    html! {
        figure {
            img src=(picture.uri()) alt=(picture.label);
            figcaption { (picture.label) }
        }
    }
}

/// Two pictures of one size in one place, the first to the left of a line that the pointer and the arrow keys move.
#[must_use]
pub fn wipe(first: &Shown<'_>, second: &Shown<'_>) -> Html {
    html! {
        figure {
            div class="wipe" tabindex="0" role="slider" aria-valuemin="0" aria-valuemax="100" aria-valuenow="50"
                aria-label={ (first.label) " against " (second.label) } {
                img src=(first.uri()) alt=(first.label);
                img src=(second.uri()) alt=(second.label);
                hr;
            }
            figcaption { "left: " (first.label) "; right: " (second.label) " (drag, or arrow keys)" }
        }
    }
}

/// Two pictures of one size in one place, in turn: with each click, space or return, or twice a second after `p`.
#[must_use]
pub fn flip(first: &Shown<'_>, second: &Shown<'_>) -> Html {
    html! {
        figure {
            div class="flip" tabindex="0" role="button" data-first=(first.label) data-second=(second.label)
                aria-label={ "flip between " (first.label) " and " (second.label) } {
                img src=(first.uri()) alt=(first.label);
                img src=(second.uri()) alt=(second.label) hidden;
            }
            figcaption { "shown: " span class="now" { (first.label) } " (click or space; p plays)" }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_in_the_page() {
        let (a, b) = (Shown { label: "a \"quoted\"", png: b"\x89PNG" }, Shown { label: "b", png: b"xyz" });
        for made in [wipe(&a, &b), flip(&a, &b)] {
            let text = made.into_string();
            assert_eq!(text.matches("data:image/png;base64,").count(), 2);
            assert!(text.contains("base64,iVBORw==") && text.contains("base64,eHl6"), "{text}");
            assert!(text.contains("a &quot;quoted&quot;"), "{text}");
        }
        assert!(figure(&b).into_string().contains("<figcaption>b</figcaption>"));
    }
}
