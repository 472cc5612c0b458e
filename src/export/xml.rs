//! XML elements, among them those of Mitsuba's scene files; the only file that names the `quick_xml` crate.

use std::io;

use glam::{DAffine3, DMat4, DVec3};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// An element with its children.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Element {
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
    text: String,
    children: Vec<Self>,
}

impl Element {
    pub(crate) const fn new(tag: &'static str) -> Self {
        Self { tag, attributes: Vec::new(), text: String::new(), children: Vec::new() }
    }

    /// An object of one of Mitsuba's plugins.
    pub(super) fn plugin(tag: &'static str, kind: &str) -> Self {
        Self::new(tag).attribute("type", kind)
    }

    pub(crate) fn attribute(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((name, value.into()));
        self
    }

    /// Text before the children.
    #[cfg(feature = "cli")]
    pub(crate) fn text(mut self, text: impl Into<String>) -> Self {
        self.text = text.into();
        self
    }

    pub(crate) fn child(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    pub(crate) fn children(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    fn parameter(self, tag: &'static str, name: &str, value: impl Into<String>) -> Self {
        self.child(Self::new(tag).attribute("name", name).attribute("value", value))
    }

    pub(super) fn float(self, name: &str, value: f64) -> Self {
        self.parameter("float", name, number(value))
    }

    pub(super) fn integer(self, name: &str, value: impl Into<i64>) -> Self {
        self.parameter("integer", name, value.into().to_string())
    }

    pub(super) fn boolean(self, name: &str, value: bool) -> Self {
        self.parameter("boolean", name, value.to_string())
    }

    pub(super) fn string(self, name: &str, value: &str) -> Self {
        self.parameter("string", name, value)
    }

    /// A linear colour.
    pub(super) fn rgb(self, name: &str, value: DVec3) -> Self {
        self.parameter("rgb", name, numbers(&value.to_array()))
    }

    pub(super) fn point(self, name: &str, value: DVec3) -> Self {
        self.parameter("point", name, numbers(&value.to_array()))
    }

    pub(super) fn vector(self, name: &str, value: DVec3) -> Self {
        self.parameter("vector", name, numbers(&value.to_array()))
    }

    /// A 4 × 4 matrix, written by rows.
    pub(super) fn transform(self, name: &'static str, value: &DAffine3) -> Self {
        let rows = DMat4::from(*value).transpose().to_cols_array();
        let matrix = Self::new("matrix").attribute("value", numbers(&rows));
        self.child(Self::new("transform").attribute("name", name).child(matrix))
    }

    /// The element as a document under a comment.
    ///
    /// # Errors
    /// None in practice: it is written to memory.
    pub(crate) fn document(&self, comment: &str) -> io::Result<Vec<u8>> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("utf-8"), None)))?;
        // two hyphens would end it
        let comment = format!(" {} ", comment.replace("--", "- -"));
        writer.write_event(Event::Comment(BytesText::from_escaped(comment)))?;
        self.write(&mut writer)?;
        let mut bytes = writer.into_inner();
        bytes.push(b'\n');
        Ok(bytes)
    }

    fn write(&self, writer: &mut Writer<Vec<u8>>) -> io::Result<()> {
        let mut start = BytesStart::new(self.tag);
        start.extend_attributes(self.attributes.iter().map(|(name, value)| (*name, value.as_str())));
        if self.children.is_empty() && self.text.is_empty() {
            return writer.write_event(Event::Empty(start));
        }
        writer.write_event(Event::Start(start))?;
        if !self.text.is_empty() {
            writer.write_event(Event::Text(BytesText::new(&self.text)))?;
        }
        for child in &self.children {
            child.write(writer)?;
        }
        writer.write_event(Event::End(BytesEnd::new(self.tag)))
    }
}

/// The shortest decimal that reads back to the same double.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn numbers(values: &[f64]) -> String {
    values.iter().copied().map(number).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documents() {
        let element = Element::plugin("shape", "ply")
            .string("name", "a<b & \"c\" 'é'")
            .float("fov", 0.1)
            .integer("n", 3_u32)
            .boolean("yes", true)
            .rgb("radiance", DVec3::new(1.0, 1e-30, 1e30))
            .transform("to_world", &DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)));
        let text = String::from_utf8(element.document("not -- the end -->").unwrap()).unwrap();
        let want = r#"<?xml version="1.0" encoding="utf-8"?>
<!-- not - - the end - -> -->
<shape type="ply">
  <string name="name" value="a&lt;b &amp; &quot;c&quot; &apos;é&apos;"/>
  <float name="fov" value="0.1"/>
  <integer name="n" value="3"/>
  <boolean name="yes" value="true"/>
  <rgb name="radiance" value="1.0 1e-30 1e30"/>
  <transform name="to_world">
    <matrix value="1.0 0.0 0.0 1.0 0.0 1.0 0.0 2.0 0.0 0.0 1.0 3.0 0.0 0.0 0.0 1.0"/>
  </transform>
</shape>
"#;
        assert_eq!(text, want);
    }
}
