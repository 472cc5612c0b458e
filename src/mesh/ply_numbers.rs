//! The numbers behind the header of a PLY file.

use super::file_error::{MeshFaults, Place};
use super::obj_fault::quote;
use super::ply_fault::PlyFault;
use super::ply_header::Scalar;

/// The file has no further number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End;

/// Numbers one after the other.
pub(super) trait Numbers {
    /// The next one.
    fn real(&mut self, scalar: Scalar) -> Result<f64, End>;

    /// The next one, which must be whole and from 0 on; what is not is noted and stands as [`i64::MAX`].
    fn whole(&mut self, scalar: Scalar) -> Result<i64, End>;

    /// Goes past some.
    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), End>;

    /// How many bytes are left.
    fn left(&self) -> usize;

    /// Where the next number is.
    fn place(&self) -> Place;

    /// What was no number.
    fn into_faults(self) -> MeshFaults;
}

/// Numbers in binary.
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    pub(super) file: &'a [u8],
    /// Where the next one begins.
    pub(super) at: usize,
}

impl<const BIG_ENDIAN: bool> Binary<'_, BIG_ENDIAN> {
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], End> {
        let mut bytes = *self.file.get(self.at..).and_then(|rest| rest.first_chunk::<N>()).ok_or(End)?;
        self.at += N;
        if BIG_ENDIAN {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG_ENDIAN: bool> Numbers for Binary<'_, BIG_ENDIAN> {
    fn real(&mut self, scalar: Scalar) -> Result<f64, End> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.bytes()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.bytes()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.bytes()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.bytes()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.bytes()?),
        })
    }

    fn whole(&mut self, scalar: Scalar) -> Result<i64, End> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.bytes()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.bytes()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.bytes()?).into(),
            // lists of whole numbers alone are read by this
            Scalar::F32 | Scalar::F64 => i64::MAX,
        })
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), End> {
        let end = scalar.size().checked_mul(count).and_then(|bytes| bytes.checked_add(self.at)).ok_or(End)?;
        if end > self.file.len() {
            return Err(End);
        }
        self.at = end;
        Ok(())
    }

    fn left(&self) -> usize {
        self.file.len() - self.at
    }

    fn place(&self) -> Place {
        Place::Byte(self.at)
    }

    fn into_faults(self) -> MeshFaults {
        MeshFaults::default()
    }
}

/// Numbers in text, separated by white space.
pub(super) struct Text<'a> {
    file: &'a [u8],
    at: usize,
    line: usize,
    /// Where the line begins.
    line_start: usize,
    faults: MeshFaults,
}

impl<'a> Text<'a> {
    /// The text from a byte on, where a line of this number (from 1) begins.
    pub(super) fn new(file: &'a [u8], at: usize, line: usize) -> Self {
        Self { file, at, line, line_start: at, faults: MeshFaults::default() }
    }

    fn skip_space(&mut self) {
        while let Some(byte) = self.file.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.at += 1;
            if *byte == b'\n' {
                (self.line, self.line_start) = (self.line + 1, self.at);
            }
        }
    }

    /// The next word; none at the end.
    pub(super) fn word(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        let rest = &self.file[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    /// The rest of the line.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.file[self.at..];
        let length = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// Where the next word begins.
    pub(super) fn here(&mut self) -> Place {
        self.skip_space();
        self.place()
    }

    /// Where a word that was just read begins.
    pub(super) fn place_of(&self, word: &[u8]) -> Place {
        Place::Line([self.line, self.at - word.len() - self.line_start + 1])
    }
}

/// A word as a number.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word of at most 18 digits as the number that they make.
fn digits(word: &[u8]) -> Option<i64> {
    if word.len() > 18 || word.is_empty() {
        return None;
    }
    word.iter().try_fold(0, |sum, byte| byte.is_ascii_digit().then(|| 10 * sum + i64::from(byte - b'0')))
}

impl Numbers for Text<'_> {
    fn real(&mut self, _: Scalar) -> Result<f64, End> {
        let word = self.word().ok_or(End)?;
        Ok(number(word).unwrap_or_else(|| {
            let quoted = quote(&String::from_utf8_lossy(word));
            self.faults.push(self.place_of(word), PlyFault::NotANumber(quoted));
            0.0
        }))
    }

    fn whole(&mut self, _: Scalar) -> Result<i64, End> {
        let word = self.word().ok_or(End)?;
        Ok(digits(word).unwrap_or_else(|| {
            let quoted = quote(&String::from_utf8_lossy(word));
            self.faults.push(self.place_of(word), PlyFault::NotWhole(quoted));
            i64::MAX
        }))
    }

    fn skip(&mut self, _: Scalar, count: usize) -> Result<(), End> {
        (0..count).try_for_each(|_| self.word().map(|_| ()).ok_or(End))
    }

    fn left(&self) -> usize {
        self.file.len() - self.at
    }

    fn place(&self) -> Place {
        Place::Line([self.line, self.at - self.line_start + 1])
    }

    fn into_faults(self) -> MeshFaults {
        self.faults
    }
}
