//! How much memory the process may take: what work is about to take is asked for before it is taken.
//!
//! What is in use is what the system says that the process has in memory, so that nothing is forgotten; what has been asked
//! for and may not be in memory yet is added. An estimate that is too low is noticed at the next question, so long work asks
//! again and again.

use std::fmt;
use std::fs;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

/// Share of the machine's memory, or of its control group's, that is used unless something else is asked for.
const SHARE: f64 = 0.8;

/// Bytes that are asked for and may not be in memory yet. The memory is the process's, and so is this.
static PROMISED: AtomicU64 = AtomicU64::new(0);

/// The most memory that the process may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    bytes: u64,
}

impl Default for MemoryLimit {
    /// [`Self::NONE`].
    fn default() -> Self {
        Self::NONE
    }
}

/// What was asked for would be too much.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "not enough memory: {what} would take about {}, and {} of the {} that --max-memory allows are in use",
    Size(*bytes), Size(*used), Size(*most)
)]
pub struct OutOfMemory {
    /// What asked.
    pub what: String,
    /// For how many bytes.
    pub bytes: u64,
    /// Bytes in use.
    pub used: u64,
    /// Bytes allowed.
    pub most: u64,
}

/// Memory that was asked for: until this is dropped, whether it is in use yet or not, others are told that it is.
#[derive(Debug)]
#[must_use = "the memory is kept for the asker only as long as this is"]
pub struct Promise {
    bytes: u64,
}

impl Drop for Promise {
    fn drop(&mut self) {
        PROMISED.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl MemoryLimit {
    /// No limit but the machine's.
    pub const NONE: Self = Self { bytes: u64::MAX };

    /// A limit of so many bytes.
    #[must_use]
    pub const fn new(bytes: u64) -> Self {
        Self { bytes }
    }

    /// 80 % of the machine's memory, or of its control group's if that is less; [`Self::NONE`] where that is not known.
    #[must_use]
    pub fn of_machine() -> Self {
        let all = machine_memory().into_iter().chain(group_memory()).min();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a part of a number of bytes"
        )]
        all.map_or(Self::NONE, |bytes| Self::new((bytes as f64 * SHARE) as u64))
    }

    /// The most bytes that the process may have.
    #[must_use]
    pub const fn bytes(self) -> u64 {
        self.bytes
    }

    /// Asks for about so many bytes more, for what is named.
    ///
    /// # Errors
    /// If they are more than are left.
    pub fn ask(self, what: impl fmt::Display, bytes: u64) -> Result<Promise, OutOfMemory> {
        // memory is promised before the sum is looked at, so that two askers do not both get what is enough for one
        let promised = PROMISED.fetch_add(bytes, Ordering::Relaxed);
        let promise = Promise { bytes };
        if self == Self::NONE {
            return Ok(promise);
        }
        let used = in_memory().unwrap_or(0).saturating_add(promised);
        if used.saturating_add(bytes) <= self.bytes {
            return Ok(promise);
        }
        Err(OutOfMemory { what: what.to_string(), bytes, used, most: self.bytes })
    }

    /// Asks, in the midst of work whose size is not known before, whether what is in use is still allowed.
    ///
    /// # Errors
    /// If it is too much; `bytes` are what the work has taken so far.
    pub fn check(self, what: impl fmt::Display, bytes: u64) -> Result<(), OutOfMemory> {
        match in_memory() {
            Some(used) if used > self.bytes => {
                Err(OutOfMemory { what: what.to_string(), bytes, used, most: self.bytes })
            }
            _ => Ok(()),
        }
    }
}

/// Why a text is no size of memory.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("must be a size above 0, such as 512M or 4G (K, M, G and T are powers of 1024)")]
pub struct SizeError;

impl FromStr for MemoryLimit {
    type Err = SizeError;

    fn from_str(text: &str) -> Result<Self, SizeError> {
        let text = text.strip_suffix(['B', 'b']).unwrap_or(text);
        let text = text.strip_suffix(['I', 'i']).unwrap_or(text);
        let power = |letter: char| "KMGT".find(letter.to_ascii_uppercase()).map(|place| 10 * (place + 1));
        let (number, shift) = match text.chars().last().and_then(power) {
            Some(shift) => (&text[..text.len() - 1], shift),
            None => (text, 0),
        };
        let number: f64 = number.parse().map_err(|_| SizeError)?;
        let bytes = number * libm::exp2(shift as f64);
        if !(bytes >= 1.0 && bytes < u64::MAX as f64) {
            return Err(SizeError);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        Ok(Self { bytes: bytes as u64 })
    }
}

/// A number of bytes for people.
struct Size(u64);

impl fmt::Display for Size {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mut size, mut unit) = (self.0 as f64, "bytes");
        for next in ["KB", "MB", "GB", "TB"] {
            if size < 1024.0 {
                break;
            }
            (size, unit) = (size / 1024.0, next);
        }
        let digits = usize::from(unit != "bytes" && size < 100.0);
        write!(formatter, "{size:.digits$} {unit}")
    }
}

/// Bytes of the process in memory; `None` where the system does not say.
#[must_use]
pub fn in_memory() -> Option<u64> {
    named_kilobytes("/proc/self/status", "VmRSS:")
}

fn machine_memory() -> Option<u64> {
    named_kilobytes("/proc/meminfo", "MemTotal:")
}

/// The limit of the process's control group: of version 2, or of version 1.
fn group_memory() -> Option<u64> {
    let paths = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
    paths.iter().filter_map(|path| fs::read_to_string(path).ok()?.trim().parse().ok()).min()
}

/// A number of kilobytes that stands behind a name at the start of a line.
fn named_kilobytes(path: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_shown() {
        for (text, bytes) in [
            ("1", 1),
            ("512M", 512 << 20),
            ("1.5g", 3 << 29),
            ("4GiB", 4 << 30),
            ("2kb", 2048),
            ("1T", 1 << 40),
        ] {
            assert_eq!(text.parse(), Ok(MemoryLimit::new(bytes)), "{text}");
        }
        for text in ["", "G", "-1G", "0", "nan", "1X", "inf", "1e30", "é"] {
            assert_eq!(text.parse::<MemoryLimit>(), Err(SizeError), "{text}");
        }
        let shown = [7, 1536, 3 << 29, 200 << 20].map(|bytes| Size(bytes).to_string());
        assert_eq!(shown, ["7 bytes", "1.5 KB", "1.5 GB", "200 MB"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_is_too_much_is_refused() {
        let used = in_memory().expect("the system says");
        let limit = MemoryLimit::new(used + (1 << 32));
        let error = limit.ask("a picture", 1 << 33).unwrap_err();
        assert!(error.to_string().contains("a picture would take about 8.0 GB"), "{error}");
        let kept = limit.ask("a picture", 3 << 30).unwrap();
        assert!(limit.ask("another picture", 2 << 30).is_err());
        drop(kept);
        assert!(limit.ask("another picture", 2 << 30).is_ok());
        assert!(MemoryLimit::new(1).check("a mesh", 5).is_err());
        assert!(MemoryLimit::of_machine().bytes() > 1 << 20);
    }
}
