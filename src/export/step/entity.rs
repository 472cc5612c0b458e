//! The clear text encoding of STEP files.
//!
//! Source: ISO 10303-21 (2016), sections 5 to 11.

use std::fmt::{self, Display, Write};

use glam::{DVec2, DVec3};

/// The name of an entity instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Id(u32);

impl Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// A number as STEP has it: always with a point, shortest digits that read back to the same double.
#[derive(Clone, Copy, Debug)]
pub(super) struct Real(pub(super) f64);

impl Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut buffer = zmij::Buffer::new();
        // -0 is 0
        let digits = buffer.format_finite(self.0 + 0.0);
        match digits.split_once('e') {
            Some((mantissa, exponent)) => {
                let point = if mantissa.contains('.') { "" } else { "." };
                write!(f, "{mantissa}{point}E{exponent}")
            }
            None => f.write_str(digits),
        }
    }
}

/// A string with its quotes; what is not ASCII as UTF-16 in hexadecimal digits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quoted<'a>(pub(super) &'a str);

impl Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_char('\'')?;
        for character in self.0.chars() {
            match character {
                '\'' => f.write_str("''")?,
                '\\' => f.write_str("\\\\")?,
                ' '..='~' => f.write_char(character)?,
                _ => {
                    f.write_str("\\X2\\")?;
                    for unit in character.encode_utf16(&mut [0; 2]) {
                        write!(f, "{unit:04X}")?;
                    }
                    f.write_str("\\X0\\")?;
                }
            }
        }
        f.write_char('\'')
    }
}

/// Things in parentheses, with commas between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct List<I>(pub(super) I);

impl<I> Display for List<I>
where
    I: Clone + IntoIterator,
    I::Item: Display,
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_char('(')?;
        for (number, item) in self.0.clone().into_iter().enumerate() {
            if number > 0 {
                f.write_char(',')?;
            }
            item.fmt(f)?;
        }
        f.write_char(')')
    }
}

/// The data section in the making.
#[derive(Debug, Default)]
pub(super) struct Entities {
    text: String,
    count: u32,
}

impl Entities {
    /// Adds an instance; `definition` is its keyword and parameters.
    pub(super) fn add(&mut self, definition: impl Display) -> Id {
        self.count += 1;
        let id = Id(self.count);
        writeln!(self.text, "{id}={definition};").expect("strings take all that is written");
        id
    }

    /// Adds a point in space.
    pub(super) fn point(&mut self, point: DVec3) -> Id {
        let numbers = List(point.to_array().map(Real));
        self.add(format_args!("CARTESIAN_POINT('',{numbers})"))
    }

    /// Adds a point in a surface's parameters.
    pub(super) fn parameters(&mut self, st: DVec2) -> Id {
        let numbers = List(st.to_array().map(Real));
        self.add(format_args!("CARTESIAN_POINT('',{numbers})"))
    }

    /// Adds a direction in space.
    pub(super) fn direction(&mut self, unit: DVec3) -> Id {
        let numbers = List(unit.to_array().map(Real));
        self.add(format_args!("DIRECTION('',{numbers})"))
    }

    /// The text of all instances.
    pub(super) fn into_text(self) -> String {
        self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_points_and_read_back() {
        for (number, want) in [
            (0.0, "0.0"),
            (-0.0, "0.0"),
            (1.0, "1.0"),
            (-2.5, "-2.5"),
            (1e-7, "1.E-7"),
            (1.25e30, "1.25E+30"),
        ] {
            let got = Real(number).to_string();
            assert_eq!(got.replace("E+", "E"), want.replace("E+", "E"), "{number}");
            assert!(got.split('E').next().is_some_and(|mantissa| mantissa.contains('.')), "{got}");
        }
        for number in [0.1 + 0.2, 1.0 / 3.0, f64::MAX, f64::MIN_POSITIVE, 123_456.789] {
            assert_eq!(Real(number).to_string().parse(), Ok(number));
        }
    }

    #[test]
    fn strings_are_ascii() {
        assert_eq!(Quoted("it's a \\").to_string(), r"'it''s a \\'");
        assert_eq!(Quoted("Rad ø😀").to_string(), r"'Rad \X2\00F8\X0\\X2\D83DDE00\X0\'");
    }

    #[test]
    fn instances_are_numbered() {
        let mut entities = Entities::default();
        let point = entities.point(DVec3::new(1.0, 0.0, 0.5));
        let vertex = entities.add(format_args!("VERTEX_POINT('',{point})"));
        assert_eq!(vertex, Id(2));
        assert_eq!(entities.into_text(), "#1=CARTESIAN_POINT('',(1.0,0.0,0.5));\n#2=VERTEX_POINT('',#1);\n");
    }
}
