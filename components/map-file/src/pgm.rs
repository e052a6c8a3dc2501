//! Reads binary PGM pictures (`P5`, up to 8 bits).

/// Bytes of a picture: 4000 × 4000 cells and a header.
pub(crate) const MOST_BYTES: usize = 16_000_000 + 1024;

/// A grey picture, its top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct GreyPicture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The value of white.
    pub white: u8,
    /// The pixels, at most `white`.
    pub pixels: Vec<u8>,
}

/// What is wrong with a picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PgmFault {
    /// Another format.
    #[error("it is no binary grey PGM (P5); save it as PGM, raw and grey")]
    NotP5,
    /// The header breaks the format.
    #[error("its header is not readable; it is P5, width, height and the value of white, 1 to 255")]
    Header,
    /// More pixels than any map needs.
    #[error("it has more than {} bytes; use a coarser map", MOST_BYTES)]
    TooLarge,
    /// There are fewer pixels than the header states.
    #[error("it ends after {found} of {wanted} pixels; save it again")]
    TooShort {
        /// Pixels in the file.
        found: usize,
        /// Pixels that the header promises.
        wanted: usize,
    },
}

/// Reads a picture.
pub(crate) fn parse(bytes: &[u8]) -> Result<GreyPicture, PgmFault> {
    if bytes.len() > MOST_BYTES {
        return Err(PgmFault::TooLarge);
    }
    let mut rest = bytes.strip_prefix(b"P5").ok_or(PgmFault::NotP5)?;
    let mut number = || header_number(&mut rest).ok_or(PgmFault::Header);
    let (width, height, white) = (number()?, number()?, number()?);
    let white = u8::try_from(white).ok().filter(|&w| w > 0).ok_or(PgmFault::Header)?;
    // One white space ends the header.
    let pixels = match rest {
        [space, pixels @ ..] if space.is_ascii_whitespace() => pixels,
        _ => return Err(PgmFault::Header),
    };
    let wanted = width.checked_mul(height).filter(|&w| w > 0).ok_or(PgmFault::Header)?;
    if wanted > MOST_BYTES {
        return Err(PgmFault::TooLarge);
    }
    let pixels = pixels
        .get(..wanted)
        .ok_or(PgmFault::TooShort { found: pixels.len(), wanted })?
        .iter()
        .map(|&pixel| pixel.min(white))
        .collect();
    Ok(GreyPicture { width, height, white, pixels })
}

/// Takes the next number, with white space and comments before it.
fn header_number(rest: &mut &[u8]) -> Option<usize> {
    loop {
        match rest {
            [b'#', ..] => {
                let end = rest.iter().position(|&byte| byte == b'\n')?;
                *rest = &rest[end..];
            }
            [space, after @ ..] if space.is_ascii_whitespace() => *rest = after,
            _ => break,
        }
    }
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let number = std::str::from_utf8(&rest[..digits]).ok()?.parse().ok()?;
    *rest = &rest[digits..];
    Some(number)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_picture_is_read_with_its_comments() {
        let grey = parse(b"P5\n# made by hand\n2 1 # wide\n200\n\x05\xff").expect("a picture");
        assert_eq!(grey, GreyPicture { width: 2, height: 1, white: 200, pixels: vec![5, 200] });
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        for (bytes, fault) in [
            (&b"P2\n1 1\n255\n0"[..], PgmFault::NotP5),
            (b"P5\n1", PgmFault::Header),
            (b"P5\n1 1\n65535\n00", PgmFault::Header),
            (b"P5\n0 1\n255\n", PgmFault::Header),
            (b"P5\n99999 99999\n255\n", PgmFault::TooLarge),
            (b"P5\n2 2\n255\nabc", PgmFault::TooShort { found: 3, wanted: 4 }),
        ] {
            assert_eq!(parse(bytes), Err(fault));
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            let _ = parse(&bytes);
            let _ = parse(&[b"P5\n".as_slice(), &bytes].concat());
        }
    }
}
