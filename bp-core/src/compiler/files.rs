//! Reading of files with a size limit, and atomic writing.
//!
//! In: a path. Out: its bytes; or a file with new bytes. Invariant: a regular file is never partially written, keeps
//! its permissions, and no other file remains; pipes, devices and links are written directly, never replaced.

use atomic_write_file::AtomicWriteFile;
use flate2::read::MultiGzDecoder;
use std::fs::{File, Metadata, OpenOptions, metadata, symlink_metadata};
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::Path;

/// Limit of the bytes read from a file.
pub const MOST_BYTES: u64 = 1 << 28;

/// The first bytes of a gzip file.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// All bytes of a file, decompressed if it is a gzip file.
///
/// # Errors
/// It cannot be read, or holds more than [`MOST_BYTES`].
pub fn read(path: &Path) -> Result<Vec<u8>> {
    bounded(File::open(path)?)
}

/// All bytes of an input, decompressed if it is a gzip file.
///
/// # Errors
/// It cannot be read, or holds more than [`MOST_BYTES`].
pub fn bounded(from: impl Read) -> Result<Vec<u8>> {
    let bytes = all(from)?;
    match bytes.starts_with(&GZIP) {
        true => all(MultiGzDecoder::new(bytes.as_slice())),
        false => Ok(bytes),
    }
}

/// Whether a text is UTF-16, by its byte order mark.
pub fn is_utf16(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff])
}

fn all(from: impl Read) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MOST_BYTES {
        false => Ok(bytes),
        true => {
            let most = MOST_BYTES >> 20;
            let message = format!("it holds more than {most} MiB: too long to be read, or without an end");
            Err(Error::new(ErrorKind::FileTooLarge, message))
        }
    }
}

/// Writes a file. A regular or new file is replaced atomically: the bytes are written to an unnamed file, which then
/// replaces the old one. A pipe, a device or a file with several hard links is written directly; for a symbolic link,
/// its target is written.
///
/// # Errors
/// The file or its folder cannot be written; the old file is then unchanged.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    check_name(path)?;
    let found = match metadata(path) {
        Ok(found) => found,
        // A dangling link creates its target.
        Err(error) if error.kind() == ErrorKind::NotFound && symlink_metadata(path).is_ok() => {
            return through(path, bytes);
        }
        Err(error) if error.kind() == ErrorKind::NotFound => return replaced(path, bytes),
        Err(error) => return Err(error),
    };
    // `/dev/stdout` may be a regular file that others write too.
    if !found.is_file() || is_stream(path) || names(&found) > 1 {
        return through(path, bytes);
    }
    // Renaming would circumvent the write protection of the file.
    if found.permissions().readonly() {
        return Err(Error::new(ErrorKind::PermissionDenied, "the file is read-only"));
    }
    let target = path.canonicalize()?;
    match replaced(&target, bytes) {
        // The folder may be read-only, and the file not.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => through(&target, bytes),
        done => done,
    }
}

/// Whether a path names a device or an open file, such as `/dev/stdin`.
pub fn is_stream(path: &Path) -> bool {
    path.starts_with("/dev") || path.starts_with("/proc")
}

/// Refuses the name of a folder instead of a file.
///
/// # Errors
/// The path ends in a separator, or is that of a folder.
pub fn check_name(path: &Path) -> Result<()> {
    let ends_as_folder = path.as_os_str().to_string_lossy().ends_with(std::path::is_separator);
    match ends_as_folder || path.is_dir() {
        true => Err(Error::new(ErrorKind::IsADirectory, "it is a folder; write the name of a file in it")),
        false => Ok(()),
    }
}

/// Whether a folder can be written into.
///
/// # Errors
/// The folder cannot be written.
pub fn check_folder(folder: &Path) -> Result<()> {
    AtomicWriteFile::open(folder.join("probe"))?.discard()
}

/// Replaces a file.
fn replaced(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = AtomicWriteFile::open(path)?;
    file.write_all(bytes)?;
    file.commit()
}

/// Writes to an existing file.
fn through(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut options = OpenOptions::new();
    match is_stream(path) {
        true => options.append(true),
        false => options.write(true).create(true).truncate(true),
    };
    let mut file = options.open(path)?;
    file.write_all(bytes)?;
    file.flush()
}

/// The number of hard links of a file.
#[cfg(unix)]
fn names(found: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(found)
}

#[cfg(not(unix))]
fn names(_: &Metadata) -> u64 {
    1
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{read_dir, read_link};

    fn entries(folder: &Path) -> Vec<String> {
        let names = read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    #[test]
    fn regular_files_are_replaced_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"one").unwrap();
        write(&path, b"two").unwrap();
        assert_eq!(
            (read(&path).unwrap().as_slice(), entries(folder.path())),
            (&b"two"[..], vec!["a.txt".to_owned()])
        );
        assert!(write(&folder.path().join("no").join("a.txt"), b"three").is_err());
        let no_file = folder.path().join("new").join("");
        for path in [folder.path(), no_file.as_path()] {
            let message = write(path, b"three").unwrap_err();
            assert_eq!(message.to_string(), "it is a folder; write the name of a file in it");
        }
        assert_eq!(entries(folder.path()), ["a.txt"]);
        check_folder(folder.path()).unwrap();
        assert!(check_folder(&folder.path().join("no")).is_err());
        assert_eq!(entries(folder.path()), ["a.txt"]);
        let mut permissions = metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        assert_eq!(write(&path, b"three").unwrap_err().kind(), ErrorKind::PermissionDenied);
        assert_eq!(read(&path).unwrap(), b"two");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_are_kept() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [target, link, twin, nowhere, made] =
            ["target", "link", "twin", "nowhere", "made"].map(|name| folder.path().join(name));
        std::fs::write(&target, b"old").unwrap();
        std::fs::set_permissions(&target, PermissionsExt::from_mode(0o640)).unwrap();
        symlink("target", &link).unwrap();
        write(&link, b"through the link").unwrap();
        assert_eq!(read_link(&link).unwrap(), Path::new("target"));
        assert_eq!(read(&target).unwrap(), b"through the link");
        assert_eq!(metadata(&target).unwrap().permissions().mode() & 0o777, 0o640);
        std::fs::hard_link(&target, &twin).unwrap();
        write(&twin, b"both").unwrap();
        assert_eq!(read(&target).unwrap(), b"both");
        symlink("made", &nowhere).unwrap();
        write(&nowhere, b"new").unwrap();
        assert_eq!(
            (read_link(&nowhere).unwrap().as_path(), read(&made).unwrap().as_slice()),
            (Path::new("made"), &b"new"[..])
        );
        assert_eq!(entries(folder.path()), ["link", "made", "nowhere", "target", "twin"]);
        write(Path::new("/dev/null"), b"gone").unwrap();
        assert!(metadata("/dev/null").unwrap().file_type().is_char_device());
        #[cfg(target_os = "linux")]
        assert_eq!(write(Path::new("/dev/full"), b"much").unwrap_err().kind(), ErrorKind::StorageFull);
    }

    #[test]
    fn compressed_files_are_read_and_endless_ones_refused() {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(b"network").unwrap();
        assert_eq!(bounded(packed.finish().unwrap().as_slice()).unwrap(), b"network");
        assert!(bounded([&GZIP[..], b"no more"].concat().as_slice()).is_err());
        let error = bounded(std::io::repeat(7)).unwrap_err();
        assert!(error.to_string().starts_with("it holds more than 256 MiB"), "{error}");
        let mut bomb = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::copy(&mut std::io::repeat(0).take(MOST_BYTES + 1), &mut bomb).unwrap();
        let error = bounded(bomb.finish().unwrap().as_slice()).unwrap_err();
        assert!(error.to_string().starts_with("it holds more than 256 MiB"), "{error}");
    }
}
