//! The state of a render in a file, to go on from after an interruption.
//!
//! The file has a line of text that says what it is, a line of JSON, the tiles' samples as little-endian numbers, and the
//! hash of all before.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::film::Exposure;
use crate::identity::PictureIdentity;
use crate::output::{OutputError, write_whole};

/// Samples of each pixel in a pass: as many rays as are traced side by side. With filters, the sums of a block are added up
/// pass by pass, so that another number would change their last bits.
pub(super) const PASS: u32 = 16;

const _: () =
    assert!(Exposure::BLOCK.is_multiple_of(PASS), "passes lie within the blocks that the sums are kept by");

/// The first line.
const KIND: &str = "trimray checkpoint 2\n";

/// Length of the hash at the end.
const HASH_BYTES: usize = 32;

/// Why a render cannot go on from a checkpoint.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The system refused.
    #[error("{}: cannot be read: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Something else, or damaged.
    #[error("{}: is no checkpoint of a render, or it is damaged", .path.display())]
    NotOne {
        /// The file.
        path: PathBuf,
    },
    /// Another version may compute other samples.
    #[error(
        "{}: was saved by trimray {found}, this is {}: delete the checkpoint to start anew",
        .path.display(), env!("CARGO_PKG_VERSION")
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// The version that saved it.
        found: String,
    },
    /// The scene or a setting has changed.
    #[error("{}: is of another picture: {what} differs; delete the checkpoint to start anew", .path.display())]
    OtherPicture {
        /// The file.
        path: PathBuf,
        /// What is not the same.
        what: String,
    },
    /// More samples would not be added up as in one run.
    #[error(
        "{}: has {saved} samples for each pixel, so that a picture of {asked} cannot go on from it; \
         a multiple of {PASS} can be gone on from", .path.display()
    )]
    Samples {
        /// The file.
        path: PathBuf,
        /// Samples in the file.
        saved: u32,
        /// Samples of the picture.
        asked: u32,
    },
}

/// Where a render's state is saved.
#[derive(Debug)]
pub struct CheckpointFile {
    path: PathBuf,
    identity: PictureIdentity,
    interval: Duration,
    saved: Mutex<Instant>,
}

/// A state that was read.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    /// The tiles.
    bytes: Vec<u8>,
}

impl CheckpointFile {
    /// Saves to `path` every `interval`; a state serves for any number of samples of a picture.
    #[must_use]
    pub fn new(path: PathBuf, identity: &PictureIdentity, interval: Duration) -> Self {
        Self { path, identity: identity.without_samples(), interval, saved: Mutex::new(Instant::now()) }
    }

    /// The state that was saved here.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or is of another picture or version.
    pub fn read(&self) -> Result<Checkpoint, CheckpointError> {
        let path = self.path.clone();
        let mut bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(CheckpointError::Io { path, source }),
        };
        let Some((identity, start)) = parse(&bytes) else { return Err(CheckpointError::NotOne { path }) };
        if identity.version() != self.identity.version() {
            return Err(CheckpointError::OtherVersion { path, found: identity.version().to_owned() });
        }
        if let Some(what) = self.identity.difference(&identity) {
            return Err(CheckpointError::OtherPicture { path, what });
        }
        bytes.truncate(bytes.len() - HASH_BYTES);
        bytes.drain(..start);
        Ok(Checkpoint { path, bytes })
    }

    /// Saves the state if the last time is long enough ago, and no other thread is about to.
    pub(super) fn save_if_due(&self, tiles: &[Mutex<Exposure>]) -> Result<(), OutputError> {
        let Ok(mut saved) = self.saved.try_lock() else { return Ok(()) };
        if saved.elapsed() >= self.interval {
            self.save(tiles)?;
            *saved = Instant::now();
        }
        Ok(())
    }

    /// Saves the state: what has been done of each tile.
    pub(super) fn save(&self, tiles: &[Mutex<Exposure>]) -> Result<(), OutputError> {
        let encode = |error: serde_json::Error| OutputError::Encode {
            path: self.path.clone(),
            reason: error.to_string(),
        };
        let mut bytes = KIND.as_bytes().to_vec();
        serde_json::to_writer(&mut bytes, &self.identity).map_err(encode)?;
        bytes.push(b'\n');
        for tile in tiles {
            tile.lock().expect("another thread's panic ends the render").save(&mut bytes);
        }
        let hash = blake3::hash(&bytes);
        bytes.extend(hash.as_bytes());
        write_whole(&self.path, &bytes)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// What the file is of, and where its tiles start.
fn parse(bytes: &[u8]) -> Option<(PictureIdentity, usize)> {
    let (content, hash) = bytes.split_at_checked(bytes.len().checked_sub(HASH_BYTES)?)?;
    if blake3::hash(content).as_bytes() != hash {
        return None;
    }
    let rest = content.strip_prefix(KIND.as_bytes())?;
    let end = rest.iter().position(|&byte| byte == b'\n')?;
    Some((serde_json::from_slice(&rest[..end]).ok()?, KIND.len() + end + 1))
}

impl Checkpoint {
    /// Brings tiles without samples to the state.
    ///
    /// # Errors
    /// If the file has other tiles, or a number of samples that `spp` cannot go on from.
    pub(super) fn restore(&self, tiles: &mut [Exposure], spp: u32) -> Result<(), CheckpointError> {
        let not_one = || CheckpointError::NotOne { path: self.path.clone() };
        let mut bytes = &self.bytes[..];
        for exposure in tiles {
            exposure.load(&mut bytes).ok_or_else(not_one)?;
            let samples = exposure.samples();
            if samples > spp || (samples < spp && !samples.is_multiple_of(PASS)) {
                return Err(CheckpointError::Samples { path: self.path.clone(), saved: samples, asked: spp });
            }
            if !exposure.starts_at_zero() {
                return Err(not_one());
            }
        }
        if bytes.is_empty() { Ok(()) } else { Err(not_one()) }
    }
}
