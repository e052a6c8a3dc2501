//! Streams a CARMEN log, plain or gzip, in constant memory. Lines that cannot be read are counted,
//! handed out as errors with their number, and do not end the stream.

use crate::line::{self, LineFault};
use crate::record::LogRecord;
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use thiserror::Error;

/// Longest line that is read, bytes: [`line::MAX_BEAMS`] readings and as many remissions, with
/// room.
pub const MAX_LINE_BYTES: usize = 512 * 1024;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// What goes wrong while a log is read.
#[derive(Debug, Error)]
pub enum LogError {
    /// The file cannot be opened or read on, or its compression is damaged. The stream ends here.
    #[error("{}{source}", describe_place(*.line))]
    Io {
        /// Number of the line being read, from 1; 0 when the file did not open.
        line: u64,
        /// The system's error.
        source: io::Error,
    },
    /// One line is malformed; the stream continues after it.
    #[error("line {line}: {fault}")]
    Line {
        /// Number of the line, from 1.
        line: u64,
        /// What is wrong with it.
        fault: LineFault,
    },
    /// One line is longer than [`MAX_LINE_BYTES`] or not text; the stream continues after it.
    #[error("line {line}: longer than {MAX_LINE_BYTES} bytes, or not text")]
    Unreadable {
        /// Number of the line, from 1.
        line: u64,
    },
}

fn describe_place(line: u64) -> String {
    if line == 0 { String::new() } else { format!("line {line}: ") }
}

/// What has been read so far, in lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// All lines.
    pub lines: u64,
    /// Scans of either laser.
    pub scans: u64,
    /// Lines of kinds that mean nothing here.
    pub unknown: u64,
    /// Lines that were malformed.
    pub malformed: u64,
}

/// An iterator over the records of a log.
pub struct CarmenLog<R> {
    reader: R,
    buffer: Vec<u8>,
    tally: Tally,
    ended: bool,
}

impl CarmenLog<Box<dyn BufRead + Send>> {
    /// Opens a log file; gzip is recognised by its first bytes, not by its name.
    ///
    /// # Errors
    /// [`LogError::Io`] when the file cannot be opened or its beginning cannot be read.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let at_start = |source| LogError::Io { line: 0, source };
        let mut file = BufReader::new(File::open(path).map_err(at_start)?);
        let is_gzip = file.fill_buf().map_err(at_start)?.starts_with(&GZIP_MAGIC);
        let reader: Box<dyn BufRead + Send> = if is_gzip {
            Box::new(BufReader::new(MultiGzDecoder::new(file)))
        } else {
            Box::new(file)
        };
        Ok(Self::new(reader))
    }
}

impl<R: BufRead> CarmenLog<R> {
    /// Reads a log from text.
    pub fn new(reader: R) -> Self {
        Self { reader, buffer: Vec::new(), tally: Tally::default(), ended: false }
    }

    /// Counts of what has been read so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Returns whether the last line has been read.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// Reads the next line into the buffer; `None` at the end.
    fn next_line(&mut self) -> Option<Result<(), LogError>> {
        let line = self.tally.lines + 1;
        match read_bounded_line(&mut self.reader, &mut self.buffer) {
            Ok(None) => {
                self.ended = true;
                None
            }
            Ok(Some(fits)) => {
                self.tally.lines = line;
                Some(if fits { Ok(()) } else { Err(LogError::Unreadable { line }) })
            }
            Err(source) => {
                self.ended = true;
                Some(Err(LogError::Io { line, source }))
            }
        }
    }

    fn read_record(&mut self) -> Result<Option<LogRecord>, LogError> {
        let line = self.tally.lines;
        let text = std::str::from_utf8(&self.buffer).map_err(|_| LogError::Unreadable { line })?;
        let record = line::parse_line(text).map_err(|fault| LogError::Line { line, fault })?;
        match record {
            Some(LogRecord::Scan(_)) => self.tally.scans += 1,
            None if !line::is_silent(text) => self.tally.unknown += 1,
            _ => {}
        }
        Ok(record)
    }
}

impl<R: BufRead> Iterator for CarmenLog<R> {
    type Item = Result<LogRecord, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.ended {
            let result = self.next_line()?.and_then(|()| self.read_record());
            match result {
                Ok(None) => {}
                Ok(Some(record)) => return Some(Ok(record)),
                Err(error) => {
                    self.tally.malformed += u64::from(!matches!(error, LogError::Io { .. }));
                    return Some(Err(error));
                }
            }
        }
        None
    }
}

/// Reads one line without its end; `Some(false)` if it was too long and only skipped.
fn read_bounded_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<Option<bool>> {
    line.clear();
    let (mut fits, mut any) = (true, false);
    loop {
        let chunk = match reader.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            chunk => chunk?,
        };
        if chunk.is_empty() {
            return Ok(any.then_some(fits));
        }
        any = true;
        let end = chunk.iter().position(|&byte| byte == b'\n');
        let content = &chunk[..end.unwrap_or(chunk.len())];
        fits &= line.len() + content.len() <= MAX_LINE_BYTES;
        if fits {
            line.extend_from_slice(content);
        }
        let used = end.map_or(chunk.len(), |end| end + 1);
        reader.consume(used);
        if end.is_some() {
            return Ok(Some(fits));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    const SCAN: &str = "FLASER 2 1 2 0 0 0 0 0 0 5 host 5\n";

    fn outcome(text: &[u8]) -> (Vec<Result<LogRecord, LogError>>, Tally) {
        let mut log = CarmenLog::new(text);
        let items: Vec<_> = log.by_ref().collect();
        (items, log.tally())
    }

    #[test]
    fn malformed_and_unknown_lines_are_counted_and_passed_over() {
        let text = format!("# hello\n{SCAN}FLASER 2 1\nSYNC x\r\n\n{SCAN}");
        let (items, tally) = outcome(text.as_bytes());
        assert_eq!(tally, Tally { lines: 6, scans: 2, unknown: 1, malformed: 1 });
        assert!(matches!(&items[1], Err(LogError::Line { line: 3, .. })), "{:?}", items[1]);
        assert!(items[2].is_ok());
    }

    #[test]
    fn endless_and_binary_lines_are_skipped_without_being_kept() {
        let mut text = vec![b'F'; 3 * MAX_LINE_BYTES];
        text.extend_from_slice(b"\n\xff\xfe\n");
        text.extend_from_slice(SCAN.as_bytes());
        let (items, tally) = outcome(&text);
        assert_eq!(tally, Tally { lines: 3, scans: 1, unknown: 0, malformed: 2 });
        assert!(matches!(items[0], Err(LogError::Unreadable { line: 1 })));
        assert!(matches!(items[2], Ok(LogRecord::Scan(_))));
    }

    #[test]
    fn gzip_is_recognised_by_content_and_a_damaged_one_ends_with_an_error() {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(SCAN.repeat(500).as_bytes()).unwrap();
        let packed = encoder.finish().unwrap();
        let path = std::env::temp_dir().join(format!("armor-log-{}.dat", std::process::id()));

        std::fs::write(&path, &packed).unwrap();
        assert_eq!(CarmenLog::open(&path).unwrap().filter(Result::is_ok).count(), 500);
        std::fs::write(&path, &packed[..packed.len() - 9]).unwrap();
        let last = CarmenLog::open(&path).unwrap().last();
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(last, Some(Err(LogError::Io { .. }))), "{last:?}");
    }

    #[test]
    fn a_missing_file_is_an_error() {
        let result = CarmenLog::open(Path::new("/nonexistent/robot.log"));
        assert!(result.is_err_and(|error| error.to_string().starts_with("No such file")));
    }
}
