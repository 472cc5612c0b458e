//! Files that are read whole.

use std::fs::{self, Metadata};
use std::io;
use std::path::Path;

/// Reads a file or a pipe to its end; devices, which may have none, are refused.
///
/// # Errors
/// What the system says; also for folders and devices.
pub fn read_whole(path: &Path) -> io::Result<Vec<u8>> {
    if is_device(&fs::metadata(path)?) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is a device, not a file"));
    }
    fs::read(path)
}

#[cfg(unix)]
fn is_device(there: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    there.file_type().is_char_device() || there.file_type().is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: &Metadata) -> bool {
    false
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn devices_without_end_are_refused() {
        for device in ["/dev/zero", "/dev/urandom"] {
            let error = read_whole(Path::new(device)).unwrap_err();
            assert_eq!(error.to_string(), "is a device, not a file");
        }
        assert!(read_whole(Path::new("/")).is_err());
    }
}
