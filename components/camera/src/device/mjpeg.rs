//! Motion JPEG, what cameras give that compress: JPEG files that may lack the Huffman tables,
//! because all have the same (ITU-T T.81, annex K.3.3). With them any decoder can read a file.

use crate::jpeg;
use crate::picture::{Picture, PictureError, PixelLayout};

/// The second byte of the marks that begin the tables, and the picture itself.
const TABLES: u8 = 0xc4;
const SCAN: u8 = 0xda;

/// Returns the file with Huffman tables: itself if it has any.
pub(super) fn add_missing_tables(file: Vec<u8>) -> Result<Vec<u8>, PictureError> {
    let before = list_segments(&file).find(|(_, mark, _)| [TABLES, SCAN].contains(mark));
    let (at, mark) = before.map(|(at, mark, _)| (at, mark)).ok_or(PictureError::Unfinished)?;
    if mark == TABLES {
        return Ok(file);
    }
    let tables = standard_tables()?;
    Ok([&file[..at], &tables, &file[at..]].concat())
}

/// The tables of the standard, as our own compressor writes them before each picture.
fn standard_tables() -> Result<Vec<u8>, PictureError> {
    let file = jpeg::encode(&Picture::new(1, 1, PixelLayout::Rgb, vec![0; 3])?, 80)?;
    Ok(list_segments(&file)
        .filter(|(_, mark, _)| *mark == TABLES)
        .flat_map(|(.., all)| all)
        .copied()
        .collect())
}

/// The segments before the picture and the one that begins it: where each lies, the second byte of
/// its mark, and all of its bytes.
fn list_segments(file: &[u8]) -> impl Iterator<Item = (usize, u8, &[u8])> {
    // After the mark that begins the file.
    let mut next = Some(2);
    std::iter::from_fn(move || {
        let at = next.take()?;
        let [0xff, mark, high, low] = *file.get(at..at + 4)? else { return None };
        let end = at + 2 + usize::from(u16::from_be_bytes([high, low]));
        next = (mark != SCAN).then_some(end);
        Some((at, mark, file.get(at..end)?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jpeg::tests::gradient;

    /// A file as such cameras give it.
    fn without_tables(file: &[u8]) -> Vec<u8> {
        let mut bare = file[..2].to_vec();
        let mut end = 2;
        for (at, mark, segment) in list_segments(file) {
            if mark != TABLES {
                bare.extend_from_slice(segment);
            }
            end = at + segment.len();
        }
        bare.extend_from_slice(&file[end..]);
        bare
    }

    #[test]
    fn a_file_without_tables_gets_those_of_the_standard() {
        for layout in [PixelLayout::Rgb, PixelLayout::Mono] {
            let file = jpeg::encode(&gradient(40, 30, layout), 80).expect("a file");
            let bare = without_tables(&file);
            assert!(bare.len() < file.len() - 100 && jpeg::decode(&bare).is_err());
            let complete = add_missing_tables(bare).expect("a JPEG");
            let (ours, theirs) = (jpeg::decode(&complete), jpeg::decode(&file));
            assert_eq!(ours.expect("a JPEG"), theirs.expect("a JPEG"));
        }
    }

    #[test]
    fn the_tables_are_those_of_the_standard() {
        let tables = standard_tables().expect("tables");
        // T.81, tables K.3 to K.6: how many codes of each length, 12, 162, 12 and 162 in all.
        let counts = [
            [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0],
            [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7d],
            [0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0],
            [0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77],
        ];
        for count in counts {
            let is_there = tables.windows(16).any(|bytes| bytes == count);
            assert!(is_there, "{count:?} in {tables:?}");
        }
    }

    #[test]
    fn a_file_with_tables_stays_and_one_without_a_picture_is_refused() {
        let file = jpeg::encode(&gradient(40, 30, PixelLayout::Rgb), 80).expect("a file");
        assert_eq!(add_missing_tables(file.clone()).expect("a JPEG"), file);
        for end in 0..40 {
            assert!(add_missing_tables(file[..end].to_vec()).is_err(), "{end} bytes");
        }
        assert!(add_missing_tables(vec![0xff; 100]).is_err());
    }
}
