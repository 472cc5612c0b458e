//! NumPy's files: `.npy` read, `.npz` written; the one file that names their crates.

use std::fs::File;
use std::io::{self, Cursor, Read, Write};
use std::path::{Path, PathBuf};

use npyz::{DType, NpyFile, Order, WriterBuilder};
use thiserror::Error;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::input::read_whole;
use crate::output::{OutputError, write_whole};

/// Why an array cannot be read.
#[derive(Debug, Error)]
pub enum ArrayError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is not a NumPy array.
    #[error("{}: is not a .npy file: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What the reader says.
        reason: String,
    },
    /// The numbers are not of double precision.
    #[error("{}: holds {found}, float64 is needed (numpy: .astype(float))", path.display())]
    Type {
        /// The file.
        path: PathBuf,
        /// The type found.
        found: String,
    },
    /// The file is shorter than its header says.
    #[error("{}: is cut off: its header says {want} numbers, it has {got}", path.display())]
    CutOff {
        /// The file.
        path: PathBuf,
        /// Numbers promised.
        want: u64,
        /// Numbers there.
        got: u64,
    },
}

/// An array of doubles, in C order.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Extents, slowest first.
    pub shape: Vec<usize>,
    /// The numbers, last index fastest.
    pub values: Vec<f64>,
}

/// Reads a float64 `.npy` file of any shape, C or Fortran order, either byte order.
///
/// # Errors
/// [`ArrayError`] if it is not such a file.
pub fn read_f64(path: &Path) -> Result<Array, ArrayError> {
    let bytes = read_whole(path).map_err(|source| ArrayError::Read { path: path.into(), source })?;
    decode(path, &bytes, &["f8"])
}

/// Whether a file begins as a `.npz` archive.
#[must_use]
pub fn is_archive(path: &Path) -> bool {
    let mut start = [0; 4];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == *b"PK\x03\x04"
}

/// Reads those of an archive's arrays that have these names: of float64, or of int32 or int64 as the doubles next to them.
/// The archive must be uncompressed, as `numpy.savez` writes it.
///
/// # Errors
/// [`ArrayError`] if it is no such archive, or one of the arrays is of another type.
pub fn read_archive(path: &Path, names: &[&str]) -> Result<Vec<(String, Array)>, ArrayError> {
    let bytes = read_whole(path).map_err(|source| ArrayError::Read { path: path.into(), source })?;
    let fault = |reason: String| ArrayError::Format { path: path.into(), reason };
    let broken = |error: ZipError| fault(format!("no archive that can be read: {error}"));
    let mut archive = ZipArchive::new(Cursor::new(&bytes)).map_err(broken)?;
    let mut arrays = Vec::new();
    for index in 0..archive.len() {
        let entry = archive.by_index_raw(index).map_err(broken)?;
        let name = entry.name().map_err(broken)?.trim_end_matches(".npy").to_owned();
        if !names.contains(&name.as_str()) {
            continue;
        }
        if entry.compression() != CompressionMethod::Stored {
            return Err(fault(format!("{name} is compressed; numpy.savez writes archives that are not")));
        }
        // stored, so no longer than the file
        let mut content = Vec::new();
        let start = entry.size().min(bytes.len() as u64);
        entry.take(start).read_to_end(&mut content).map_err(|error| fault(error.to_string()))?;
        let array = decode(path, &content, &["f8", "i8", "i4"])?;
        arrays.push((name, array));
    }
    Ok(arrays)
}

/// The content of a `.npy` file, if its numbers are of one of these types.
fn decode(path: &Path, bytes: &[u8], types: &[&str]) -> Result<Array, ArrayError> {
    let format = |reason: String| ArrayError::Format { path: path.into(), reason };
    let promised = header_length(bytes);
    if promised > bytes.len() as u64 {
        let length = bytes.len();
        return Err(format(format!("it is to have a header of {promised} bytes, but the file has {length}")));
    }
    let mut rest = bytes;
    let file = NpyFile::new(&mut rest).map_err(|error| format(shortened(&error.to_string())))?;
    let (dtype, order) = (file.dtype(), file.order());
    let shape: Vec<u64> = file.shape().to_vec();
    let scalar = |name: &str| DType::new_scalar(name.parse().expect("a type of NumPy's own"));
    let is = |order: &str, kind: &&&str| dtype == scalar(&format!("{order}{kind}"));
    let (little, big) = (types.iter().find(|kind| is("<", kind)), types.iter().find(|kind| is(">", kind)));
    let Some(&kind) = little.or(big) else {
        return Err(ArrayError::Type { path: path.into(), found: dtype.descr() });
    };
    let size = if kind == "i4" { 4 } else { 8 };
    let want = shape.iter().try_fold(1_u64, |product, &extent| product.checked_mul(extent));
    let data = file.into_inner();
    let got = data.len() as u64 / size as u64;
    let want = want.ok_or_else(|| format("its shape is too large".into()))?;
    if got < want {
        return Err(ArrayError::CutOff { path: path.into(), want, got });
    }
    let number = |bytes: &[u8]| {
        let mut ordered = [0; 8];
        ordered[..size].copy_from_slice(bytes);
        if little.is_none() {
            ordered[..size].reverse();
        }
        let [a, b, c, d, ..] = ordered;
        match kind {
            "i4" => i32::from_le_bytes([a, b, c, d]).into(),
            "i8" => i64::from_le_bytes(ordered) as f64,
            _ => f64::from_le_bytes(ordered),
        }
    };
    let shape: Vec<usize> = shape
        .into_iter()
        .map(|extent| usize::try_from(extent).expect("fits, for the file holds it"))
        .collect();
    let count = shape.iter().product::<usize>();
    let mut values: Vec<f64> = data.chunks_exact(size).take(count).map(number).collect();
    if order == Order::Fortran {
        values = to_c_order(&shape, &values);
    }
    Ok(Array { shape, values })
}

/// What a reader says, without the whole of a header that it may quote.
fn shortened(said: &str) -> String {
    const LONGEST: usize = 160;
    let mut short: String = said.chars().take(LONGEST).collect();
    if said.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}

/// How long the file's header says that it is: the reader takes memory for it at once. 0 if that cannot be told.
///
/// Source: NEP 1: 6 bytes of a mark, 2 of the version, then 2 (version 1) or 4 with the length of what follows.
fn header_length(bytes: &[u8]) -> u64 {
    match bytes {
        [_, _, _, _, _, _, 2 | 3, _, a, b, c, d, ..] => u64::from(u32::from_le_bytes([*a, *b, *c, *d])) + 12,
        _ => 0,
    }
}

fn to_c_order(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let mut index = vec![0; shape.len()];
    (0..values.len())
        .map(|_| {
            let mut stride = 1;
            let mut place = 0;
            for (i, extent) in index.iter().zip(shape) {
                place += i * stride;
                stride *= extent;
            }
            for axis in (0..shape.len()).rev() {
                index[axis] += 1;
                if index[axis] < shape[axis] {
                    break;
                }
                index[axis] = 0;
            }
            values[place]
        })
        .collect()
}

/// The numbers of an array of an archive.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// float64
    F64(Vec<f64>),
    /// int32
    I32(Vec<i32>),
    /// int64
    I64(Vec<i64>),
    /// bool
    Bool(Vec<bool>),
}

/// A named array of an archive.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedArray {
    /// Name within the archive, without `.npy`.
    pub name: &'static str,
    /// Numbers in each row; 1 gives a one-dimensional array.
    pub columns: usize,
    /// The numbers, row by row.
    pub values: Values,
}

/// Writes arrays as an uncompressed `.npz` archive; the same arrays give the same bytes.
///
/// # Errors
/// If the file cannot be written; nothing is left half-written then.
pub fn write_npz(path: &Path, arrays: &[NamedArray]) -> Result<(), OutputError> {
    let bytes = archive(arrays).map_err(|source| OutputError::Io { path: path.into(), source })?;
    write_whole(path, &bytes)
}

/// Writes one array of float64 as `.npy`.
///
/// # Errors
/// If the file cannot be written; nothing is left half-written then.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f64]) -> Result<(), OutputError> {
    let shape: Vec<u64> = shape.iter().map(|&extent| extent as u64).collect();
    let bytes = npy(values, &shape).map_err(|source| OutputError::Io { path: path.into(), source })?;
    write_whole(path, &bytes)
}

fn archive(arrays: &[NamedArray]) -> io::Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default());
    for array in arrays {
        let bytes = match &array.values {
            Values::F64(values) => rows(values, array.columns)?,
            Values::I32(values) => rows(values, array.columns)?,
            Values::I64(values) => rows(values, array.columns)?,
            Values::Bool(values) => rows(values, array.columns)?,
        };
        let large = bytes.len() > u32::MAX as usize / 2;
        archive.start_file(format!("{}.npy", array.name), options.large_file(large))?;
        archive.write_all(&bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

fn rows<T: npyz::AutoSerialize + Copy>(values: &[T], columns: usize) -> io::Result<Vec<u8>> {
    let rows = (values.len() / columns) as u64;
    let shape = [rows, columns as u64];
    npy(values, if columns == 1 { &shape[..1] } else { &shape })
}

fn npy<T: npyz::AutoSerialize + Copy>(values: &[T], shape: &[u64]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(size_of_val(values) + 256);
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd()?;
    writer.extend(values.iter().copied())?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn write(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    fn header(text: &str) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(text.len()).unwrap().to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes
    }

    #[test]
    fn reads_both_orders_and_byte_orders() {
        let mut c_order = header("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n");
        let mut fortran = header("{'descr': '>f8', 'fortran_order': True, 'shape': (2, 3), }\n");
        for x in [1.0, 2.0, 3.0, 4.0, 5.0, 6.0_f64] {
            c_order.extend(x.to_le_bytes());
        }
        for x in [1.0, 4.0, 2.0, 5.0, 3.0, 6.0_f64] {
            fortran.extend(x.to_be_bytes());
        }
        let want = Array { shape: vec![2, 3], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
        for bytes in [c_order, fortran] {
            let (_folder, path) = write("a.npy", &bytes);
            assert_eq!(read_f64(&path).unwrap(), want);
        }
    }

    #[test]
    fn refuses_what_is_not_an_array_of_doubles() {
        let (_folder, path) = write("a.npy", b"nonsense");
        assert!(matches!(read_f64(&path), Err(ArrayError::Format { .. })));
        let (_folder, path) = write("a.npy", &header(&format!("{{'descr': {}", "(".repeat(60_000))));
        let error = read_f64(&path).unwrap_err().to_string();
        assert!(error.contains("is not a .npy file") && error.chars().count() < 300, "{error}");
        let long = b"\x93NUMPY\x02\x00\xf0\xff\xff\xff{}";
        let (_folder, path) = write("a.npy", long);
        let error = read_f64(&path).unwrap_err().to_string();
        assert!(error.ends_with("to have a header of 4294967292 bytes, but the file has 14"), "{error}");
        let floats = header("{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }\n");
        let (_folder, path) = write("a.npy", &floats);
        assert!(matches!(read_f64(&path), Err(ArrayError::Type { .. })));
        let huge = header("{'descr': '<f8', 'fortran_order': False, 'shape': (4611686018427387904, 3), }\n");
        let (_folder, path) = write("a.npy", &huge);
        assert!(read_f64(&path).is_err());
        let short = header("{'descr': '<f8', 'fortran_order': False, 'shape': (7,), }\n");
        let (_folder, path) = write("a.npy", &short);
        assert!(matches!(read_f64(&path), Err(ArrayError::CutOff { want: 7, got: 0, .. })));
    }

    #[test]
    fn archives_repeat_to_the_byte() {
        let arrays = [
            NamedArray { name: "t", columns: 1, values: Values::F64(vec![1.0, f64::INFINITY]) },
            NamedArray { name: "st", columns: 2, values: Values::F64(vec![0.0; 4]) },
            NamedArray { name: "hit", columns: 1, values: Values::Bool(vec![true, false]) },
        ];
        assert_eq!(archive(&arrays).unwrap(), archive(&arrays).unwrap());
    }
}
