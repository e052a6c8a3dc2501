//! Picture files, one after the other in the order of their names. One that cannot be read is left
//! out and named once.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::finish::Finish;
use crate::picture::PictureError;

/// The longest file that is read, 64 MiB: longer than any picture of a camera.
const MAX_LEN: u64 = 64 << 20;
/// What the names of pictures end with.
const ENDINGS: [&str; 3] = ["jpg", "jpeg", "png"];

/// Why no picture comes of files.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FilmError {
    /// The folder or file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// It.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The folder has no pictures.
    #[error("{} has no files that end with .jpg, .jpeg or .png", .0.display())]
    Empty(PathBuf),
    /// None of the files can be read.
    #[error("none of the {count} pictures of {} can be read", path.display())]
    AllUnreadable {
        /// The folder or file.
        path: PathBuf,
        /// How many files.
        count: usize,
    },
}

/// Why one file is left out.
#[derive(Debug, thiserror::Error)]
enum Unreadable {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error("longer than 64 MiB")]
    Long,
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// Files, and which comes next.
#[derive(Debug)]
pub(crate) struct Film {
    path: PathBuf,
    files: Vec<PathBuf>,
    next: usize,
    /// Begins again after the last.
    is_endless: bool,
    named: BTreeSet<usize>,
}

impl Film {
    /// The pictures of a folder, not of those below it; or a single file, whatever its name.
    pub(crate) fn open(path: &Path, is_endless: bool) -> Result<Self, FilmError> {
        let unreadable = |source| FilmError::Read { path: path.to_owned(), source };
        let files = if path.metadata().map_err(unreadable)?.is_dir() {
            let entries: Result<Vec<_>, _> = path.read_dir().map_err(unreadable)?.collect();
            let paths = entries.map_err(unreadable)?.into_iter().map(|entry| entry.path());
            let mut files: Vec<_> =
                paths.filter(|path| is_picture(path) && path.is_file()).collect();
            files.sort();
            files
        } else {
            vec![path.to_owned()]
        };
        if files.is_empty() {
            return Err(FilmError::Empty(path.to_owned()));
        }
        Ok(Self { path: path.to_owned(), files, next: 0, is_endless, named: BTreeSet::new() })
    }

    /// Whether the last picture was taken.
    pub(crate) fn is_over(&self) -> bool {
        self.next == self.files.len()
    }

    /// Skips the next picture: there is no subscriber.
    pub(crate) fn skip_file(&mut self) {
        if !self.is_over() {
            self.next += 1;
        }
        if self.is_over() && self.is_endless {
            self.next = 0;
        }
    }

    /// Takes the next picture that can be read, as a JPEG file; `None` at the end.
    pub(crate) fn take(&mut self, finish: &Finish) -> Result<Option<Vec<u8>>, FilmError> {
        for _ in 0..self.files.len() {
            if self.is_over() {
                return Ok(None);
            }
            let at = self.next;
            self.skip_file();
            match read_file(&self.files[at], finish) {
                Ok(picture) => return Ok(Some(picture)),
                Err(reason) => {
                    if self.named.insert(at) {
                        tracing::warn!("{} is left out: {reason}", self.files[at].display());
                    }
                }
            }
        }
        if self.named.len() < self.files.len() {
            return Ok(None);
        }
        Err(FilmError::AllUnreadable { path: self.path.clone(), count: self.files.len() })
    }
}

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| ENDINGS.iter().any(|one| ending.eq_ignore_ascii_case(one)))
}

fn read_file(path: &Path, finish: &Finish) -> Result<Vec<u8>, Unreadable> {
    let mut bytes = Vec::new();
    let len = File::open(path)?.take(MAX_LEN + 1).read_to_end(&mut bytes)?;
    if len as u64 > MAX_LEN {
        return Err(Unreadable::Long);
    }
    Ok(finish.file(bytes)?)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::finish::tests::{AS_IT_IS, png};

    /// A folder of its own for one test, removed at its end.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str, files: &[(&str, Vec<u8>)]) -> Self {
            let path =
                std::env::temp_dir().join(format!("armor-camera-{}-{name}", std::process::id()));
            fs::create_dir_all(&path).expect("writable");
            for (name, content) in files {
                fs::write(path.join(name), content).expect("writable");
            }
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// A grey picture of one row, as wide as distinguishes it from the others.
    fn wide(width: u32) -> Vec<u8> {
        png(width, 1, png::ColorType::Grayscale, png::BitDepth::Eight, &vec![9; width as usize])
    }

    /// The widths of the next pictures, 0 at the end.
    fn widths(film: &mut Film, count: usize) -> Vec<u16> {
        let mut next = || film.take(&AS_IT_IS).expect("readable pictures");
        (0..count)
            .map(|_| next().map_or(0, |file| crate::jpeg::size(&file).expect("a JPEG").0))
            .collect()
    }

    #[test]
    fn pictures_come_by_name_and_others_are_left_out() {
        let files =
            [("2.PNG", wide(2)), ("1.png", wide(1)), ("3.png", wide(3)), ("notes.txt", vec![])];
        let scratch = Scratch::new("order", &files);
        let mut film = Film::open(&scratch.0, true).expect("pictures");
        assert_eq!(widths(&mut film, 4), [1, 2, 3, 1]);
        film.skip_file();
        assert_eq!(widths(&mut film, 1), [3]);
        let mut film = Film::open(&scratch.0, false).expect("pictures");
        assert_eq!(widths(&mut film, 5), [1, 2, 3, 0, 0]);
        assert!(film.is_over());
        let mut film = Film::open(&scratch.0.join("2.PNG"), true).expect("a picture");
        assert_eq!(widths(&mut film, 2), [2, 2]);
    }

    #[test]
    fn one_that_cannot_be_read_is_left_out() {
        let files = [("1.png", wide(1)), ("2.jpg", b"no picture".to_vec()), ("3.png", wide(3))];
        let scratch = Scratch::new("damaged", &files);
        let mut film = Film::open(&scratch.0, true).expect("pictures");
        assert_eq!(widths(&mut film, 4), [1, 3, 1, 3]);
        let mut film = Film::open(&scratch.0, true).expect("pictures");
        fs::remove_file(scratch.0.join("1.png")).expect("the file exists");
        assert_eq!(widths(&mut film, 2), [3, 3]);
    }

    #[test]
    fn nothing_to_show_is_an_error_that_names_it() {
        let scratch = Scratch::new("nothing", &[("1.jpg", b"no picture".to_vec())]);
        let mut film = Film::open(&scratch.0, true).expect("a name that fits");
        let error = film.take(&AS_IT_IS).expect_err("none").to_string();
        assert!(error.contains("none of the 1 pictures") && error.contains("nothing"), "{error}");
        fs::remove_file(scratch.0.join("1.jpg")).expect("the file exists");
        let error = Film::open(&scratch.0, true).expect_err("empty").to_string();
        assert!(error.contains("has no files"), "{error}");
        let error = Film::open(&scratch.0.join("gone"), true).expect_err("missing").to_string();
        assert!(error.contains("cannot read") && error.contains("gone"), "{error}");
    }
}
