//! Bytes into lines of bounded length.

/// Longest line in bytes; the rest of a longer one is left out.
pub const MAX_LINE_LEN: usize = 8 << 10;

/// Holds the line that has begun.
#[derive(Default)]
pub struct Splitter {
    begun: Vec<u8>,
    cut: bool,
}

impl Splitter {
    /// Takes in bytes and hands out each line that they complete, without its end.
    pub fn feed(&mut self, bytes: &[u8], each: &mut impl FnMut(&[u8])) {
        let mut rest = bytes;
        while let Some(end) = rest.iter().position(|byte| *byte == b'\n') {
            self.append(&rest[..end]);
            self.complete(each);
            rest = &rest[end + 1..];
        }
        self.append(rest);
    }

    /// Hands out the last line if no newline ended it.
    pub fn finish(&mut self, each: &mut impl FnMut(&[u8])) {
        if !self.begun.is_empty() {
            self.complete(each);
        }
    }

    fn append(&mut self, bytes: &[u8]) {
        let room = MAX_LINE_LEN - self.begun.len();
        self.begun.extend_from_slice(&bytes[..bytes.len().min(room)]);
        self.cut |= bytes.len() > room;
    }

    fn complete(&mut self, each: &mut impl FnMut(&[u8])) {
        if std::mem::take(&mut self.cut) {
            self.begun.extend_from_slice(" … (cut)".as_bytes());
        }
        each(&self.begun);
        self.begun.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(chunks: &[&[u8]], lines: &[&str]) {
        let mut splitter = Splitter::default();
        let mut got = Vec::new();
        let mut each = |line: &[u8]| got.push(String::from_utf8_lossy(line).into_owned());
        for chunk in chunks {
            splitter.feed(chunk, &mut each);
        }
        splitter.finish(&mut each);
        assert_eq!(got, lines);
    }

    #[test]
    fn lines_do_not_depend_on_how_they_arrive() {
        check(&[], &[]);
        check(&[b"one\ntwo\n"], &["one", "two"]);
        check(&[b"o", b"ne", b"\ntw", b"o"], &["one", "two"]);
        check(&[b"\n\n"], &["", ""]);
    }

    #[test]
    fn a_line_without_end_takes_bounded_memory() {
        let long = vec![b'x'; MAX_LINE_LEN];
        let cut = format!("{} … (cut)", "x".repeat(MAX_LINE_LEN));
        check(&[&long, b"\nnext\n"], &[&"x".repeat(MAX_LINE_LEN), "next"]);
        check(&[&long, &long, &long, b"\nnext\n"], &[&cut, "next"]);
        let mut splitter = Splitter::default();
        for _ in 0..1000 {
            splitter.feed(&long, &mut |_| panic!("there is no line yet"));
        }
        assert!(splitter.begun.capacity() <= 2 * MAX_LINE_LEN);
    }
}
