//! Inputs by number: the same number gives the same bytes. Random bytes, random pieces of files,
//! examples with changes that know what a file looks like, and files made up from the vocabulary.

use crate::hostile::entry::EXAMPLES;

struct Dice(fastrand::Rng);

impl Dice {
    /// From 0 to `below` - 1; 0 for none.
    fn throw(&mut self, below: usize) -> usize {
        self.0.usize(..below.max(1))
    }

    fn of<'a, T: ?Sized>(&mut self, some: &[&'a T]) -> &'a T {
        some[self.throw(some.len())]
    }
}

/// The input with this number, of this seed.
pub fn input(seed: u64, number: u64) -> Vec<u8> {
    let seed = seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ number;
    let mut dice = Dice(fastrand::Rng::with_seed(seed));
    match dice.throw(10) {
        0 => (0..dice.throw(400)).map(|_| dice.throw(256) as u8).collect(),
        1 | 2 => (0..dice.throw(60)).map(|_| dice.of(WORDS)).collect::<String>().into_bytes(),
        3 | 4 => made_up(&mut dice).into_bytes(),
        _ => changed(&mut dice),
    }
}

const WORDS: &[&str] = &[
    "<armor version=\"1\">",
    "</armor>",
    "<system>",
    "</system>",
    "<mission safe=\"a\">",
    "</mission>",
    "<component name=\"a\" kind=\"k\">",
    "</component>",
    "<parameter name=\"p\" value=\"1\"/>",
    "<link from=\"a.x\" to=\"b.y\" keep=\"5\"/>",
    "<place name=\"a\" initial=\"true\"/>",
    "<transition name=\"t\" from=\"a b\" to=\"c\">",
    "</transition>",
    "<arc to=\"a\"/>",
    "<check>x</check>",
    "<mission system=\"gone\"/>",
    "<mission system=\"b.xml\">",
    "<submission ref=\"c.xml\" in=\"a\" out=\"b\"/>",
    "<exclusive components=\"a b\"/>",
    "<layout><x/></layout>",
    "<",
    ">",
    "/>",
    "</",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?",
    "?>",
    "<!DOCTYPE",
    "&lt;",
    "&#x41;",
    "&#0;",
    "&",
    ";",
    "\"",
    "'",
    "=",
    " ",
    "\n",
    "\r\n",
    "\t",
    "ä",
    "\u{feff}",
    "\u{0}",
    "xmlns:a=\"b\"",
    "a:b=\"c\"",
    "x",
];

/// Values that numbers, names, lists, dates and guards may stumble over.
const VALUES: &[&str] = &[
    "",
    " ",
    "0",
    "-1",
    "1e308",
    "1e-400",
    "9999999999999999999999",
    "0x10",
    "NaN",
    "inf",
    "10Hz",
    "0Hz",
    "1e9s",
    "-5min",
    "0.1 s",
    "30deg",
    "5parsec",
    "true",
    "false",
    "latest",
    "all",
    "50",
    "1000000",
    "a",
    "a.b",
    "a.b.c",
    ".",
    "..",
    "a b",
    " a  b ",
    "a a",
    "explore",
    "explore explore",
    "laser.scan",
    "slam.map",
    "explorer homing",
    "[1s,2s]",
    "[2s,1s]",
    "[0s,inf)",
    "(0s,1s]",
    "battery &lt; 30",
    "battery &lt; ((((((((1",
    "not not not a",
    "a and b or c",
    "1 + 1",
    "&gt;",
    "2026-11-21T14:30:00Z",
    "2026-13-41T25:61:61Z",
    "9999-12-31T23:59:59Z",
    "a.xml",
    "/dev/zero",
    "b.xml#x",
    "ä",
    "\u{1f916}",
    "&#10;",
    "always reachable(home)",
    "duration(home) &lt;= 20min",
];

const ELEMENTS: &[&str] = &[
    "system",
    "mission",
    "component",
    "parameter",
    "link",
    "clock",
    "place",
    "transition",
    "arc",
    "read",
    "inhibitor",
    "reset",
    "exclusive",
    "variable",
    "check",
    "layout",
    "block",
    "submission",
];

const ATTRIBUTES: &[&str] = &[
    "version",
    "name",
    "kind",
    "rate",
    "restart",
    "controllable",
    "value",
    "from",
    "to",
    "keep",
    "mode",
    "wake",
    "transport",
    "history",
    "source",
    "min",
    "max",
    "initial",
    "components",
    "class",
    "on-failure",
    "component",
    "on",
    "timeout",
    "when",
    "priority",
    "operator",
    "lost-link",
    "after",
    "interval",
    "not-before",
    "not-after",
    "missed",
    "overrun",
    "system",
    "goal",
    "safe",
    "resume",
    "period",
    "weight",
    "place",
    "ref",
    "in",
    "out",
    "autonomy",
    "of",
    "x",
    "y",
    "watchdog",
    "env",
    "nice",
    "realtime",
    "cpus",
    "cpu",
    "memory",
    "on-stop-fail",
    "on-start-fail",
    "answer-within",
    "unanswered",
];

/// A file of known elements in known places, mostly, with any attributes.
fn made_up(dice: &mut Dice) -> String {
    let mut out = String::from("<armor version=\"1\">");
    for section in ["system", "mission"] {
        if dice.throw(8) > 0 {
            out += &format!("<{section}");
            attributes(dice, &mut out);
            out += ">";
            for _ in 0..dice.throw(12) {
                element(dice, 0, &mut out);
            }
            out += &format!("</{section}>");
        }
    }
    out + "</armor>"
}

fn element(dice: &mut Dice, depth: usize, out: &mut String) {
    let name = dice.of(ELEMENTS);
    *out += &format!("<{name}");
    attributes(dice, out);
    if depth > 2 || dice.throw(3) > 0 {
        *out += "/>";
        return;
    }
    *out += ">";
    for _ in 0..dice.throw(4) {
        element(dice, depth + 1, out);
    }
    if dice.throw(4) == 0 {
        *out += dice.of(VALUES);
    }
    *out += &format!("</{name}>");
}

fn attributes(dice: &mut Dice, out: &mut String) {
    for _ in 0..dice.throw(6) {
        *out += &format!(" {}=\"{}\"", dice.of(ATTRIBUTES), dice.of(VALUES));
    }
}

/// An example with one to six changes.
fn changed(dice: &mut Dice) -> Vec<u8> {
    // The small one mostly: more inputs for the same time.
    let example = if dice.throw(3) > 0 { EXAMPLES[0] } else { dice.of(&EXAMPLES) };
    let mut bytes = example.as_bytes().to_vec();
    for _ in 0..=dice.throw(6) {
        change(dice, &mut bytes);
    }
    bytes
}

fn change(dice: &mut Dice, bytes: &mut Vec<u8>) {
    let at = dice.throw(bytes.len());
    match dice.throw(12) {
        0 if !bytes.is_empty() => bytes[at] ^= 1 << dice.throw(8),
        1 => drop(bytes.splice(at..at, dice.of(WORDS).bytes())),
        2 => {
            let end = (at + dice.throw(40)).min(bytes.len());
            bytes.drain(at..end);
        }
        3 => {
            // A piece of it a second time.
            let piece = bytes[at..(at + dice.throw(200)).min(bytes.len())].to_vec();
            let to = dice.throw(bytes.len());
            bytes.splice(to..to, piece);
        }
        4 => {
            let other = dice.of(&EXAMPLES).as_bytes();
            let from = dice.throw(other.len());
            let piece = &other[from..(from + dice.throw(300)).min(other.len())];
            bytes.splice(at..at, piece.iter().copied());
        }
        5 => bytes.truncate(at),
        6 | 7 => replace_value(dice, bytes, at),
        8 => {
            // A whole tag gone.
            if let Some((start, end)) = between(bytes, at, b'<', b'>') {
                bytes.drain(start..=end);
            }
        }
        9 => {
            // A whole tag twice.
            if let Some((start, end)) = between(bytes, at, b'<', b'>') {
                let tag = bytes[start..=end].to_vec();
                bytes.splice(start..start, tag);
            }
        }
        10 => {
            let attribute = format!(" {}=\"{}\"", dice.of(ATTRIBUTES), dice.of(VALUES));
            if let Some((start, _)) = between(bytes, at, b' ', b'"') {
                bytes.splice(start..start, attribute.bytes());
            }
        }
        _ => {
            let mut out = String::new();
            element(dice, 0, &mut out);
            if let Some((start, _)) = between(bytes, at, b'<', b'>') {
                bytes.splice(start..start, out.bytes());
            }
        }
    }
}

fn replace_value(dice: &mut Dice, bytes: &mut Vec<u8>, at: usize) {
    if let Some((start, end)) = between(bytes, at, b'"', b'"') {
        bytes.splice(start + 1..end, dice.of(VALUES).bytes());
    }
}

/// The first piece from `open` to `close` at or behind `at`.
fn between(bytes: &[u8], at: usize, open: u8, close: u8) -> Option<(usize, usize)> {
    let start = at + bytes.get(at..)?.iter().position(|byte| *byte == open)?;
    let end = start + 1 + bytes[start + 1..].iter().position(|byte| *byte == close)?;
    Some((start, end))
}
