//! The forms that the text of a parameter may have to have, and what a path may have to lead to: a
//! closed list, so that a file is checked
//! by the same code with which its components read the text.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::name::is_name;
use crate::zone_text::{ZoneTextError, parse_zones};

/// Most items of a list. A route of a thousand points is generated, not written by hand.
pub const MAX_ITEMS: usize = 1000;
/// Most characters of a wrong item that an error repeats.
const MAX_SHOWN: usize = 40;

/// The form of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TextFormat {
    /// Points `x,y` in metres.
    Points,
    /// Numbers without units.
    Numbers,
    /// Names, such as those of events.
    Names,
    /// A host and a port, `HOST:PORT`.
    Address,
    /// The name of a `<frame>` of the file.
    Frame,
    /// The `<frame>`s of the file: the check fills a parameter of this format with them.
    Frames,
    /// Zones of a map: the check fills a parameter of this format with those of the mission's `<map>`,
    /// unless the file assigns it. The empty text has none.
    Zones,
    /// Of a path: a file. Whether it is there depends on the host, so that is not checked here.
    File,
    /// Of a path: a folder; as with a file.
    Folder,
}

impl TextFormat {
    /// All formats.
    pub const ALL: [Self; 9] = [
        Self::Points,
        Self::Numbers,
        Self::Names,
        Self::Address,
        Self::Frame,
        Self::Frames,
        Self::Zones,
        Self::File,
        Self::Folder,
    ];

    /// Returns the format with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// Returns its name, as a manifest has it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Numbers => "numbers",
            Self::Names => "names",
            Self::Address => "address",
            Self::Frame => "frame",
            Self::Frames => "frames",
            Self::Zones => "zones",
            Self::File => "file",
            Self::Folder => "folder",
        }
    }

    /// Returns whether it is about a path, and not about a text.
    pub const fn is_of_path(self) -> bool {
        matches!(self, Self::File | Self::Folder)
    }

    /// Returns a text of this form.
    pub const fn example(self) -> &'static str {
        match self {
            Self::Points => "4,1 9.5,-3",
            Self::Numbers => "0 0.5 -1.2",
            Self::Names => "explore home",
            Self::Address => "192.168.0.7:2000",
            Self::Frame => "laser",
            Self::Frames => "laser,base_link,0.08,0,0.3,0,0,0",
            Self::Zones => "school no-go margin=2m 3,4 9,4 9,8",
            Self::File => "logs/office.log",
            Self::Folder => "pictures",
        }
    }

    /// Returns what a text of this form is, in words.
    pub const fn describe(self) -> &'static str {
        match self {
            Self::Points => "points x,y in metres with spaces between them",
            Self::Numbers => "numbers with spaces between them",
            Self::Names => "names with spaces between them",
            Self::Address => "an address, HOST:PORT",
            Self::Frame => "the name of a <frame>",
            Self::Frames => {
                "fixed frames NAME,PARENT,x,y,z,roll,pitch,yaw in metres and radians with spaces \
                 between them"
            }
            Self::Zones => "zones NAME KIND SHAPE with ; between them",
            Self::File => "the path of a file",
            Self::Folder => "the path of a folder",
        }
    }

    /// Returns the same as the subject of a sentence in the singular.
    pub const fn describe_value(self) -> &'static str {
        match self {
            Self::Points => "a list of points",
            Self::Numbers => "a list of numbers",
            Self::Names => "a list of names",
            Self::Address => "an address",
            Self::Frame => "the name of a <frame>",
            Self::Frames => "a list of fixed frames",
            Self::Zones => "a list of zones",
            Self::File => "the path of a file",
            Self::Folder => "the path of a folder",
        }
    }

    /// Checks a text.
    ///
    /// # Errors
    /// [`TextFormatError`] about the first item that is wrong.
    pub fn check_text(self, text: &str) -> Result<(), TextFormatError> {
        match self {
            Self::Points => parse_points(text).map(drop),
            Self::Numbers => parse_numbers(text).map(drop),
            Self::Names => parse_names(text).map(drop),
            Self::Address => parse_address(text).map(drop),
            Self::Frame => check_frame_name(text),
            Self::Frames => parse_frames(text).map(drop),
            Self::Zones => Ok(parse_zones(text).map(drop)?),
            Self::File | Self::Folder => Ok(()),
        }
    }

    /// What one item of it is, and which form it has.
    const fn item(self) -> (&'static str, &'static str) {
        match self {
            Self::Points => ("point", "x,y in metres"),
            Self::Numbers => ("number", "a number"),
            Self::Names => ("name", "a name (letters, digits, _ and -, a letter first)"),
            Self::Address => ("address", "HOST:PORT"),
            Self::Frame => ("frame", "a name (letters, digits, _ and -, a letter first)"),
            Self::Frames => ("frame", "NAME,PARENT,x,y,z,roll,pitch,yaw"),
            Self::Zones => ("zone", "NAME KIND SHAPE"),
            Self::File => ("file", "a path"),
            Self::Folder => ("folder", "a path"),
        }
    }
}

impl fmt::Display for TextFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a text does not have its form.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TextFormatError {
    /// The text has no item.
    #[error("the text is empty; write {}, such as `{}`", .0.describe(), .0.example())]
    Empty(TextFormat),
    /// An item has another form.
    #[error(
        "{} {number}, `{text}`, is not {}; write {}, such as `{}`",
        .format.item().0, .format.item().1, .format.describe(), .format.example()
    )]
    WrongItem {
        /// The form that is expected.
        format: TextFormat,
        /// Counted from 1.
        number: usize,
        /// The beginning of the item.
        text: String,
    },
    /// The text is not the name of a frame.
    #[error("`{0}` is not the name of a frame; write one name, such as `laser`")]
    WrongFrame(String),
    /// The address is not one.
    #[error("`{0}` is not an address; write HOST:PORT, such as `192.168.0.7:2000`")]
    WrongAddress(String),
    /// The text has no zones.
    #[error(transparent)]
    WrongZones(#[from] ZoneTextError),
    /// The list is longer than any that is meant.
    #[error("the text has more than {MAX_ITEMS} {0}")]
    TooLong(TextFormat),
}

/// Reads points `x,y` in metres, with white space between them.
///
/// # Errors
/// [`TextFormatError`] about the first item that is no point.
pub fn parse_points(text: &str) -> Result<Vec<[f64; 2]>, TextFormatError> {
    parse_items(text, TextFormat::Points, |item| {
        let (x, y) = item.split_once(',')?;
        Some([parse_number(x)?, parse_number(y)?])
    })
}

/// Reads numbers with white space between them.
///
/// # Errors
/// [`TextFormatError`] about the first item that is no number.
pub fn parse_numbers(text: &str) -> Result<Vec<f64>, TextFormatError> {
    parse_items(text, TextFormat::Numbers, parse_number)
}

/// Reads names with white space between them.
///
/// # Errors
/// [`TextFormatError`] about the first item that is no name.
pub fn parse_names(text: &str) -> Result<Vec<String>, TextFormatError> {
    parse_items(text, TextFormat::Names, |item| is_name(item).then(|| item.to_owned()))
}

/// A frame that is fixed in another one: a `<frame>` of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedFrame {
    /// Its name.
    pub name: String,
    /// The frame that it is in.
    pub parent: String,
    /// Where its origin is in the parent: ahead, left, up, in metres (REP-103).
    pub translation_m: [f64; 3],
    /// Roll, pitch and yaw, in radians: the turns about the parent's x, then y, then z axis.
    pub rotation_rad: [f64; 3],
}

/// Writes it as an item of the format [`TextFormat::Frames`]; numbers are read back as they were.
impl fmt::Display for FixedFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.name, self.parent)?;
        self.translation_m.iter().chain(&self.rotation_rad).try_for_each(|it| write!(f, ",{it}"))
    }
}

/// Reads fixed frames with white space between them.
///
/// # Errors
/// [`TextFormatError`] about the first item that is no fixed frame.
pub fn parse_frames(text: &str) -> Result<Vec<FixedFrame>, TextFormatError> {
    parse_items(text, TextFormat::Frames, |item| {
        let mut parts = item.split(',');
        let mut next_name = || parts.next().filter(|name| is_name(name)).map(str::to_owned);
        let (name, parent) = (next_name()?, next_name()?);
        let mut numbers = [0.0; 6];
        for number in &mut numbers {
            *number = parse_number(parts.next()?)?;
        }
        let [x, y, z, roll, pitch, yaw] = numbers;
        let (translation_m, rotation_rad) = ([x, y, z], [roll, pitch, yaw]);
        parts.next().is_none().then_some(FixedFrame { name, parent, translation_m, rotation_rad })
    })
}

fn check_frame_name(text: &str) -> Result<(), TextFormatError> {
    match text {
        "" => Err(TextFormatError::Empty(TextFormat::Frame)),
        name if is_name(name) => Ok(()),
        other => Err(TextFormatError::WrongFrame(shorten(other))),
    }
}

/// Reads a host and a port. The host is a name, an IPv4 address, or an IPv6 address in brackets,
/// which are not part of the result; it is not looked up.
///
/// # Errors
/// [`TextFormatError`] if it is none.
pub fn parse_address(text: &str) -> Result<(String, u16), TextFormatError> {
    if text.is_empty() {
        return Err(TextFormatError::Empty(TextFormat::Address));
    }
    let read = || {
        let (host, port) = text.rsplit_once(':')?;
        let port: u16 = port.parse().ok().filter(|port| *port > 0)?;
        let bracketed = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
        let is_host = match bracketed {
            Some(host) => host.parse::<std::net::Ipv6Addr>().is_ok(),
            None => {
                let is_of_name = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
                !host.is_empty() && host.chars().all(is_of_name)
            }
        };
        is_host.then(|| (bracketed.unwrap_or(host).to_owned(), port))
    };
    read().ok_or_else(|| TextFormatError::WrongAddress(shorten(text)))
}

fn parse_items<T>(
    text: &str,
    format: TextFormat,
    parse: impl Fn(&str) -> Option<T>,
) -> Result<Vec<T>, TextFormatError> {
    let mut items = Vec::new();
    for (index, item) in text.split_whitespace().enumerate() {
        if index == MAX_ITEMS {
            return Err(TextFormatError::TooLong(format));
        }
        let wrong = || {
            let (number, text) = (index + 1, shorten(item));
            TextFormatError::WrongItem { format, number, text }
        };
        items.push(parse(item).ok_or_else(wrong)?);
    }
    if items.is_empty() { Err(TextFormatError::Empty(format)) } else { Ok(items) }
}

fn parse_number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

fn shorten(text: &str) -> String {
    text.chars().take(MAX_SHOWN).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn each_format_has_a_name_and_its_example() {
        for format in TextFormat::ALL {
            assert_eq!(format.check_text(format.example()), Ok(()), "{format}");
            assert_eq!(TextFormat::named(format.name()), Some(format));
            let json = serde_json::to_string(&format).expect("a word");
            assert_eq!(json, format!("\"{format}\""));
        }
        assert_eq!(TextFormat::named("regex"), None);
    }

    #[test]
    fn texts_of_the_right_form_are_read() {
        assert_eq!(parse_points(" 4,1\n 9.5,-1e0 "), Ok(vec![[4.0, 1.0], [9.5, -1.0]]));
        assert_eq!(parse_numbers("0 -.5\t2e3"), Ok(vec![0.0, -0.5, 2000.0]));
        assert_eq!(parse_names("explore home"), Ok(vec!["explore".into(), "home".into()]));
        assert_eq!(parse_address("laser.local:2112"), Ok(("laser.local".into(), 2112)));
        let laser = FixedFrame {
            name: "laser".into(),
            parent: "base_link".into(),
            translation_m: [0.08, 0.0, 0.3],
            rotation_rad: [0.0, 0.0, -1.5],
        };
        assert_eq!(parse_frames("laser,base_link,0.08,0,.3,0,0,-1.5 "), Ok(vec![laser]));
        assert_eq!(parse_address("[fe80::1]:80"), Ok(("fe80::1".into(), 80)));
    }

    #[test]
    fn what_people_write_instead_is_refused_with_an_example() {
        use TextFormat::{Address, Frame, Frames, Names, Numbers, Points};
        let wrong = [
            (Points, "3.6;1.5", "point 1, `3.6;1.5`, is not x,y in metres"),
            (Points, "4,1 9,1;0,0", "point 2, `9,1;0,0`,"),
            (Points, "4, 1", "point 1, `4,`,"),
            (Points, "4,1 (9,1)", "point 2, `(9,1)`,"),
            (Points, "4 1", "point 1, `4`,"),
            (Points, "1,2,3", "point 1, `1,2,3`,"),
            (Points, "1m,2m", "point 1, `1m,2m`,"),
            (Points, "1,nan", "point 1, `1,nan`,"),
            (Points, " ", "the text is empty"),
            (Numbers, "1, 2", "number 1, `1,`, is not a number"),
            (Numbers, "1 inf", "number 2, `inf`,"),
            (Numbers, "30deg", "number 1, `30deg`,"),
            (Names, "go,home", "name 1, `go,home`, is not a name"),
            (Names, "go 2nd", "name 2, `2nd`,"),
            (Address, "192.168.0.7", "`192.168.0.7` is not an address"),
            (Address, "http://robot:80", "is not an address"),
            (Address, "robot:0", "is not an address"),
            (Address, "robot:70000", "is not an address"),
            (Address, "fe80::1:80", "is not an address"),
            (Address, "", "the text is empty"),
            (Frame, "front laser", "`front laser` is not the name of a frame"),
            (Frame, "", "the text is empty"),
            (Frames, "laser", "frame 1, `laser`, is not NAME,PARENT,x,y,z,roll,pitch,yaw"),
            (Frames, "laser,base_link,0.08,0,0.3,0,0", "frame 1,"),
            (Frames, "laser,base_link,0.08m,0,0.3,0,0,0", "frame 1,"),
            (Frames, "laser,base_link,0,0,0,0,0,0,0", "frame 1,"),
            (Frames, "laser,base/link,0,0,0,0,0,0", "frame 1,"),
        ];
        for (format, text, expected) in wrong {
            let why = format.check_text(text).expect_err(text).to_string();
            assert!(why.contains(expected), "{why} instead of {expected}");
            assert!(why.contains(format.example()), "{why}");
        }
        let long = "1,1 ".repeat(MAX_ITEMS + 1);
        assert_eq!(parse_points(&long), Err(TextFormatError::TooLong(Points)));
    }

    proptest! {
        #[test]
        fn written_values_are_read_back(points in prop::collection::vec([-1e6..1e6, -1e6..1e6], 1..20)) {
            let text: Vec<_> = points.iter().map(|[x, y]| format!("{x},{y}")).collect();
            prop_assert_eq!(parse_points(&text.join(" ")), Ok(points));
        }

        #[test]
        fn written_frames_are_read_back(numbers in prop::array::uniform6(-1e3..1e3)) {
            let [x, y, z, roll, pitch, yaw] = numbers;
            let frame = FixedFrame {
                name: "laser".into(),
                parent: "base_link".into(),
                translation_m: [x, y, z],
                rotation_rad: [roll, pitch, yaw],
            };
            prop_assert_eq!(parse_frames(&frame.to_string()), Ok(vec![frame]));
        }

        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,60}") {
            for format in TextFormat::ALL {
                let _ = format.check_text(&text).map_err(|why| why.to_string());
            }
        }
    }
}
