//! The page of scenes tested against their references.

use maud::html;

use super::page::{Html, page, table};
use super::pictures::{Shown, figure, wipe};

/// One scene's test on the page.
#[derive(Clone, Debug, Default)]
pub struct SceneTestShown {
    /// The scene's name.
    pub name: String,
    /// Why it failed; nothing if it passed.
    pub failures: Vec<String>,
    /// What else there is to tell.
    pub notes: Vec<String>,
    /// Names and values.
    pub figures: Vec<[String; 2]>,
    /// PNG files of one size: the reference and the picture, if there are both.
    pub pictures: Option<[Vec<u8>; 2]>,
    /// Where they differ, as a PNG file, and what it shows.
    pub heat_map: Option<(String, Vec<u8>)>,
}

/// A page with the counts, then the scenes that failed, then those that passed, folded.
#[must_use]
pub fn scene_tests_page(title: &str, tests: &[SceneTestShown], warnings: &[String]) -> String {
    let (failed, passed): (Vec<_>, Vec<_>) = tests.iter().partition(|test| !test.failures.is_empty());
    let status = if failed.is_empty() { "pass" } else { "fail" };
    let body = html! {
        p {
            span class={ "verdict " (status) } { (status.to_uppercase()) } " "
            (passed.len()) " of " (tests.len()) " scenes pass, " (failed.len()) " fail"
        }
        @if !warnings.is_empty() { ul { @for warning in warnings { li { (warning) } } } }
        @if !failed.is_empty() {
            nav { ul { @for test in &failed {
                li { a href={ "#" (test.name) } { (test.name) } ": " (test.failures.join("; ")) }
            } } }
        }
        @for test in failed {
            section id=(test.name) {
                h2 { span class="verdict fail" { "FAIL" } " " (test.name) }
                ul { @for failure in &test.failures { li { (failure) } } }
                (details(test))
            }
        }
        @for test in passed {
            details id=(test.name) {
                summary { span class="verdict pass" { "PASS" } " " (test.name) }
                (details(test))
            }
        }
    };
    page(title, &body)
}

fn details(test: &SceneTestShown) -> Html {
    let rows: Vec<_> = test.figures.iter().map(|row| row.to_vec()).collect();
    html! {
        @if test.pictures.is_some() || test.heat_map.is_some() {
            div class="pair" {
                @if let Some([reference, picture]) = &test.pictures {
                    (wipe(
                        &Shown { label: "reference", png: reference },
                        &Shown { label: "test", png: picture },
                    ))
                }
                @if let Some((label, png)) = &test.heat_map { (figure(&Shown { label, png })) }
            }
        }
        @if !rows.is_empty() { (table(&["figure", "value"], &rows)) }
        @if !test.notes.is_empty() { ul { @for note in &test.notes { li { (note) } } } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_come_first_and_passes_are_folded() {
        let passed = SceneTestShown { name: "a".into(), ..SceneTestShown::default() };
        let failed = SceneTestShown {
            name: "b".into(),
            failures: vec!["1 < 2".into()],
            figures: vec![["max error".into(), "2".into()]],
            pictures: Some([b"one".to_vec(), b"two".to_vec()]),
            heat_map: Some(("FLIP".into(), b"map".to_vec())),
            ..SceneTestShown::default()
        };
        let page = scene_tests_page("all", &[passed, failed], &["c.exr is of no scene".into()]);
        let place = |part: &str| page.find(part).unwrap_or_else(|| panic!("{part} is not in {page}"));
        assert!(place("1 of 2 scenes pass, 1 fail") < place("c.exr is of no scene"));
        assert!(place("<section id=\"b\">") < place("<details id=\"a\">"), "{page}");
        assert!(page.contains("1 &lt; 2") && page.contains("<td>max error</td>"), "{page}");
        assert_eq!(page.matches("data:image/png;base64,").count(), 3);
        let all = scene_tests_page("all", &[], &[]);
        assert!(all.contains("0 of 0 scenes pass") && all.contains("verdict pass"));
    }
}
