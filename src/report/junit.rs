//! Test results for build servers.

use std::io;

use crate::export::xml::Element;

/// One test.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TestCase {
    /// Its name.
    pub name: String,
    /// What it belongs to.
    pub class: String,
    /// How long it took.
    pub seconds: f64,
    /// Why it failed, in one line; none if it passed.
    pub failure: Option<String>,
    /// What else there is to tell.
    pub output: String,
}

/// The results in the XML of `JUnit`: one suite of tests.
///
/// # Errors
/// None in practice: it is written to memory.
pub fn junit(suite: &str, cases: &[TestCase]) -> io::Result<Vec<u8>> {
    let failures = cases.iter().filter(|case| case.failure.is_some()).count().to_string();
    let seconds = format!("{:.3}", cases.iter().map(|case| case.seconds).sum::<f64>());
    let counted = |element: Element| {
        element
            .attribute("name", suite)
            .attribute("tests", cases.len().to_string())
            .attribute("failures", failures.clone())
            .attribute("errors", "0")
            .attribute("time", seconds.clone())
    };
    let elements = cases.iter().map(|case| {
        let element = Element::new("testcase")
            .attribute("name", printable(&case.name))
            .attribute("classname", printable(&case.class))
            .attribute("time", format!("{:.3}", case.seconds));
        let failure = case.failure.iter().map(|reason| {
            Element::new("failure").attribute("message", printable(reason)).text(printable(&case.output))
        });
        let output = Some(&case.output).filter(|output| !output.is_empty());
        let output = output.map(|output| Element::new("system-out").text(printable(output)));
        element.children(failure).children(output)
    });
    let suite = counted(Element::new("testsuite")).children(elements);
    counted(Element::new("testsuites")).child(suite).document("by trimray")
}

/// Without the control characters that XML cannot hold.
fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() || ['\n', '\t'].contains(c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_counted_and_escaped() {
        let passed =
            TestCase { name: "depth".into(), class: "a".into(), seconds: 0.5, ..TestCase::default() };
        let failed = TestCase {
            name: "color".into(),
            failure: Some("5 < 6".into()),
            output: "a & b\u{1}".into(),
            ..passed.clone()
        };
        let text = String::from_utf8(junit("diff", &[passed, failed]).unwrap()).unwrap();
        for part in [
            r#"<testsuite name="diff" tests="2" failures="1" errors="0" time="1.000">"#,
            r#"<testcase name="depth" classname="a" time="0.500"/>"#,
            r#"<failure message="5 &lt; 6">a &amp; b</failure>"#,
            "<system-out>a &amp; b</system-out>",
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
    }
}
