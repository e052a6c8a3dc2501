//! Changes of a file, each with its expected result. Most make the file invalid, each with a
//! finding that differs from all others; the rest keep it valid.

use std::fmt::Write;

use crate::dice::Dice;

/// The expected result of a change.
#[derive(Clone, Debug)]
pub enum Fate {
    /// The file is valid: a new version.
    Taken,
    /// The file is refused with a finding of this code. The finding is in the given line, or its
    /// message contains the given word.
    Refused { code: &'static str, sign: Sign },
}

/// What distinguishes a finding from those of other changes.
#[derive(Clone, Debug)]
pub enum Sign {
    Line(usize),
    Word(String),
}

/// A file after a change.
#[derive(Clone, Debug)]
pub struct Changed {
    pub what: &'static str,
    pub bytes: Vec<u8>,
    pub fate: Fate,
}

/// The lines of a file while it is changed.
pub struct Draft<'a> {
    lines: Vec<String>,
    dice: &'a mut Dice,
    /// The number of the change. Every invented name contains it, so that no two findings are
    /// equal.
    n: usize,
}

type Way = (&'static str, fn(&mut Draft<'_>) -> Option<Fate>);

/// Makes one random change of `text`. Blank lines before the root element shift the lines, so that
/// findings of this change and of the previous one are in different lines.
pub fn change(text: &str, n: usize, dice: &mut Dice) -> Changed {
    loop {
        // Three of four changes make the file invalid.
        let ways = if dice.throw(4) == 0 { VALID } else { BROKEN };
        let (what, way) = ways[dice.throw(ways.len())];
        if let Some((bytes, fate)) = apply(text, n, dice, way) {
            return Changed { what, bytes, fate };
        }
    }
}

fn apply(
    text: &str,
    n: usize,
    dice: &mut Dice,
    way: fn(&mut Draft<'_>) -> Option<Fate>,
) -> Option<(Vec<u8>, Fate)> {
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    let root = lines.iter().position(|line| line.starts_with("<armor"))?;
    let blank = std::iter::repeat_n(String::new(), n % 97);
    lines.splice(root..root, blank.chain([format!("<!-- save {n} -->")]));
    let mut draft = Draft { lines, dice, n };
    let fate = way(&mut draft)?;
    let mut text = draft.lines.join("\n");
    text.push('\n');
    // `lines` can hold only UTF-8, so a placeholder marks the place of an invalid byte until here.
    let bytes = text.into_bytes();
    let bad = BAD_BYTE.as_bytes();
    let at = bytes.windows(bad.len()).position(|window| window == bad);
    let bytes = match at {
        Some(at) => [&bytes[..at], b"\xff", &bytes[at + bad.len()..]].concat(),
        None => bytes,
    };
    Some((bytes, fate))
}

const BAD_BYTE: &str = "@bad-byte@";

impl Draft<'_> {
    /// Chooses a line at random among those that contain all of `words`.
    fn any(&mut self, words: &[&str]) -> Option<usize> {
        let has = |line: &&String| words.iter().all(|word| line.contains(word));
        let count = self.lines.iter().filter(has).count();
        let nth = self.dice.throw(count);
        let mut having = self.lines.iter().enumerate().filter(|(_, line)| has(line));
        having.nth(nth).map(|(at, _)| at)
    }

    fn first(&self, word: &str) -> Option<usize> {
        self.lines.iter().position(|line| line.contains(word))
    }

    /// Returns the value of an attribute in a line.
    fn value(&self, at: usize, attribute: &str) -> Option<String> {
        let (_, rest) = self.lines[at].split_once(&format!(" {attribute}=\""))?;
        rest.split_once('"').map(|(value, _)| value.to_owned())
    }

    fn set(&mut self, at: usize, attribute: &str, value: &str) -> Option<()> {
        let old = format!(" {attribute}=\"{}\"", self.value(at, attribute)?);
        self.lines[at] = self.lines[at].replacen(&old, &format!(" {attribute}=\"{value}\""), 1);
        Some(())
    }

    /// Writes an attribute at the end of the tag in a line.
    fn add(&mut self, at: usize, attribute: &str) {
        let line = &mut self.lines[at];
        let end = line.find("/>").or_else(|| line.find('>')).unwrap_or(line.len());
        line.insert_str(end, &format!(" {attribute}"));
    }

    /// Chooses a line inside the system or the mission.
    fn inside(&mut self) -> Option<usize> {
        let at = self.any(&["<link "]).or_else(|| self.any(&["<transition "]))?;
        Some(at)
    }

    fn insert(&mut self, at: usize, line: impl Into<String>) {
        self.lines.insert(at, line.into());
    }
}

fn word(code: &'static str, word: impl Into<String>) -> Option<Fate> {
    Some(Fate::Refused { code, sign: Sign::Word(word.into()) })
}

/// A finding in the line with this index, which counts from 0.
fn line(code: &'static str, at: usize) -> Option<Fate> {
    Some(Fate::Refused { code, sign: Sign::Line(at + 1) })
}

const BROKEN: &[Way] = &[
    // The bytes and the XML.
    ("nothing at all", |d| {
        d.lines.clear();
        line("E0004", 0)
    }),
    ("cut off", |d| {
        let (root, at) = (d.first("<armor")?, d.inside()?);
        d.lines.truncate(at);
        line("E0012", root)
    }),
    ("a tag that is not closed", |d| {
        let (at, n) = (d.inside()?, d.n);
        d.insert(at, format!("<open-{n}>"));
        word("E0012", format!("open-{n}"))
    }),
    ("an end tag too much", |d| {
        let (at, n) = (d.inside()?, d.n);
        d.insert(at, format!("</stray-{n}>"));
        word("E0012", format!("stray-{n}"))
    }),
    ("a byte that is no UTF-8", |d| {
        let at = d.inside()?;
        d.insert(at, format!("<!-- {BAD_BYTE} -->"));
        line("E0002", at)
    }),
    ("a control character", |d| {
        let at = d.inside()?;
        d.insert(at, "<!-- \u{7} -->");
        line("E0010", at)
    }),
    ("an unknown entity", |d| {
        let (at, n) = (d.inside()?, d.n);
        d.insert(at, format!("<x y=\"&entity{n};\"/>"));
        word("E0009", format!("entity{n}"))
    }),
    ("a DOCTYPE", |d| {
        let at = d.first("<armor")?;
        d.insert(at, "<!DOCTYPE armor [<!ENTITY a \"b\">]>");
        line("E0005", at)
    }),
    ("an attribute twice", |d| {
        let at = d.any(&["<component ", " rate="])?;
        d.add(at, "rate=\"1Hz\"");
        line("E0011", at)
    }),
    ("too long", |d| {
        let at = d.inside()?;
        d.insert(at, format!("<!-- {} -->", "long ".repeat(1 << 18)));
        line("E0001", 0)
    }),
    // The vocabulary.
    ("an unknown element", |d| {
        let (at, n) = (d.inside()?, d.n);
        d.insert(at, format!("<gadget-{n}/>"));
        word("E0015", format!("gadget-{n}"))
    }),
    ("an unknown attribute", |d| {
        let at = d.inside()?;
        d.add(at, &format!("colour-{}=\"red\"", d.n));
        word("E0016", format!("colour-{}", d.n))
    }),
    ("text in between", |d| {
        let at = d.inside()?;
        d.insert(at, "and then");
        // The text node begins at the end of the previous line, so the finding's line is not `at`.
        word("E0014", "")
    }),
    ("another version of the format", |d| {
        let at = d.first("<armor")?;
        let version = format!("2.{}", d.n);
        d.set(at, "version", &version)?;
        word("E0020", version)
    }),
    ("a component without a kind", |d| {
        let at = d.any(&["<component ", " kind="])?;
        let kind = d.value(at, "kind")?;
        d.lines[at] = d.lines[at].replace(&format!(" kind=\"{kind}\""), "");
        line("E0017", at)
    }),
    ("a name that is none", |d| {
        let (at, n) = (d.any(&["<place "])?, d.n);
        d.set(at, "name", &format!("{n} places"))?;
        word("E0018", format!("{n} places"))
    }),
    ("a rate that is none", |d| {
        let (at, n) = (d.any(&["<component ", " rate="])?, d.n);
        d.set(at, "rate", &format!("{n}parsec"))?;
        word("E0019", format!("{n}parsec"))
    }),
    // The system.
    ("two components of one name", |d| {
        let (at, n) = (d.any(&["<component "])?, d.n);
        for _ in 0..2 {
            d.insert(at, format!("<component name=\"twin{n}\" kind=\"homing\"/>"));
        }
        word("E0101", format!("twin{n}"))
    }),
    ("a parameter twice", |d| {
        let at = d.any(&["<parameter "])?;
        d.insert(at, d.lines[at].clone());
        line("E0102", at + 1)
    }),
    ("a link from an unknown component", |d| {
        let (at, n) = (d.any(&["<link "])?, d.n);
        let from = d.value(at, "from")?;
        let port = from.split_once('.')?.1;
        d.set(at, "from", &format!("unknown{n}.{port}"))?;
        word("E0103", format!("unknown{n}"))
    }),
    ("a link twice", |d| {
        let at = d.any(&["<link "])?;
        d.insert(at, d.lines[at].clone());
        line("E0104", at + 1)
    }),
    ("an unknown kind", |d| {
        let (at, n) = (d.any(&["<component "])?, d.n);
        d.set(at, "kind", &format!("kind{n}"))?;
        word("E0105", format!("kind{n}"))
    }),
    ("an unknown port", |d| {
        let (at, n) = (d.any(&["<link "])?, d.n);
        let to = d.value(at, "to")?;
        let component = to.split_once('.')?.0;
        d.set(at, "to", &format!("{component}.port{n}"))?;
        word("E0106", format!("port{n}"))
    }),
    ("a link the wrong way round", |d| {
        let at = d.any(&["<link "])?;
        let (from, to) = (d.value(at, "from")?, d.value(at, "to")?);
        d.set(at, "from", &to)?;
        d.set(at, "to", &from)?;
        line("E0107", at)
    }),
    ("a link between different types", |d| {
        let at = d.any(&["<link ", " from=\"mapper.map\""])?;
        d.set(at, "from", "mapper.pose")?;
        line("E0108", at)
    }),
    ("a required input that is not fed", |d| {
        let at = d.any(&["<link ", " to=\"driver."]).filter(|at| !d.lines[*at].contains(".map"))?;
        let to = d.value(at, "to")?;
        d.lines.remove(at);
        word("E0109", to)
    }),
    ("a component taken out", |d| {
        let at = d.any(&["<component ", "/>"])?;
        let name = d.value(at, "name")?;
        d.lines.remove(at);
        word("E0103", name)
    }),
    ("a frame in none", |d| {
        let (at, n) = (d.any(&["<frame "])?, d.n);
        d.set(at, "in", &format!("part{n}"))?;
        word("E0146", format!("part{n}"))
    }),
    ("a frame without a unit", |d| {
        let (at, n) = (d.any(&["<frame "])?, d.n);
        d.set(at, "x", &format!("0.{n}"))?;
        word("E0019", format!("0.{n}"))
    }),
    ("an unknown parameter", |d| {
        let (at, n) = (d.any(&["<parameter "])?, d.n);
        d.set(at, "name", &format!("parameter{n}"))?;
        word("E0110", format!("parameter{n}"))
    }),
    ("a parameter that must be there is not", |d| {
        let at = d.any(&["name=\"world\""])?;
        d.lines.remove(at);
        word("E0111", "world")
    }),
    ("a value of another type", |d| {
        let (at, n) = (d.any(&["<parameter ", "acceleration"])?, d.n);
        d.set(at, "value", &format!("far{n}"))?;
        word("E0112", format!("far{n}"))
    }),
    ("a value in another unit", |d| {
        let (at, n) = (d.any(&["<parameter ", "m/s"])?, d.n);
        d.set(at, "value", &format!("{n}kg"))?;
        word("E0112", format!("{n}kg"))
    }),
    ("a value out of range", |d| {
        let (at, n) = (d.any(&["<parameter ", "m/s"])?, d.n + 10_000);
        d.set(at, "value", &format!("{n}m/s")).filter(|()| !d.lines[at].contains("turn"))?;
        if d.lines[at].contains("acceleration") {
            d.set(at, "value", &format!("{n}m/s2"))?;
        }
        word("E0113", n.to_string())
    }),
    // The mission.
    ("two places of one name", |d| {
        let (at, n) = (d.any(&["<place "])?, d.n);
        for _ in 0..2 {
            d.insert(at, format!("<place name=\"spot{n}\"/>"));
        }
        word("E0201", format!("spot{n}"))
    }),
    ("two transitions of one name", |d| {
        let at = d.any(&["<transition "])?;
        d.insert(at, d.lines[at].clone());
        line("E0202", at + 1)
    }),
    ("a transition to nowhere", |d| {
        let (at, n) = (d.any(&["<transition "])?, d.n);
        d.set(at, "to", &format!("place{n}"))?;
        word("E0203", format!("place{n}"))
    }),
    ("a goal that is no place", |d| {
        let (at, n) = (d.any(&["<mission "])?, d.n);
        d.set(at, "goal", &format!("goal{n}"))?;
        word("E0203", format!("goal{n}"))
    }),
    ("no initial place", |d| {
        let at = d.any(&[" initial=\"true\""])?;
        d.lines[at] = d.lines[at].replace(" initial=\"true\"", "");
        word("E0204", "")
    }),
    ("exclusive components together", |d| {
        let at = d.any(&["<place ", "homing driver"])?;
        d.set(at, "components", "homing explorer")?;
        line("E0207", at)
    }),
    ("a component twice in a place", |d| {
        let at = d.any(&["<place ", "explorer driver"])?;
        d.set(at, "components", "explorer explorer driver")?;
        line("E0208", at)
    }),
];

const VALID: &[Way] = &[
    ("a comment", |d| {
        let (at, n) = (d.inside()?, d.n);
        d.insert(at, format!("<!-- no. {n} -->"));
        Some(Fate::Taken)
    }),
    ("another speed", |d| {
        let (at, n) = (d.any(&["<parameter ", "\"speed\""])?, d.n % 100);
        d.set(at, "value", &format!("0.9{n:02}m/s"))?;
        Some(Fate::Taken)
    }),
    ("another unit", |d| {
        let at = d.any(&["<frame "])?;
        let mm = 10 + d.n % 90;
        d.set(at, "x", &format!("{mm}mm"))?;
        Some(Fate::Taken)
    }),
    ("a parameter taken out", |d| {
        let at = d.any(&["<parameter ", "acceleration"])?;
        d.lines.remove(at);
        Some(Fate::Taken)
    }),
    ("another rate", |d| {
        let at = d.any(&["<component ", " rate=\"5Hz\""])?;
        let hz = 2 + d.dice.throw(8);
        d.set(at, "rate", &format!("{hz}Hz"))?;
        Some(Fate::Taken)
    }),
    ("another queue", |d| {
        let at = d.any(&["<link ", " keep=\"50\""])?;
        let keep = (60 + d.dice.throw(100)).to_string();
        d.set(at, "keep", &keep)?;
        Some(Fate::Taken)
    }),
    ("another timeout", |d| {
        let at = d.any(&["<transition ", " timeout="])?;
        let s = (3000 + d.dice.throw(500)).to_string();
        d.set(at, "timeout", &format!("{s}s"))?;
        Some(Fate::Taken)
    }),
    ("a component more", |d| {
        let (at, n) = (d.any(&["<component "])?, d.n);
        let mut text = format!("<component name=\"more{n}\" kind=\"homing\" rate=\"5Hz\"/>\n");
        let _ = write!(text, "<link from=\"mapper.pose\" to=\"more{n}.pose\"/>");
        d.insert(at, text);
        Some(Fate::Taken)
    }),
    ("an attribute of another element", |d| {
        let (root, at, n) = (d.first("<armor")?, d.inside()?, d.n);
        d.add(root, "xmlns:note=\"urn:note\"");
        d.add(at, &format!("note:seen=\"{n}\""));
        Some(Fate::Taken)
    }),
    ("other quotes", |d| {
        let at = d.inside()?;
        d.lines[at] = d.lines[at].replace('"', "'");
        Some(Fate::Taken)
    }),
    ("another indentation", |d| {
        let by = d.dice.throw(9);
        for line in d.lines.iter_mut().filter(|line| line.starts_with(' ')) {
            *line = format!("{}{}", " ".repeat(by), line.trim_start());
        }
        Some(Fate::Taken)
    }),
    ("Windows' line ends", |d| {
        d.lines.iter_mut().for_each(|line| line.push('\r'));
        Some(Fate::Taken)
    }),
    ("two links change places", |d| {
        let (a, b) = (d.any(&["<link "])?, d.any(&["<link "])?);
        d.lines.swap(a, b);
        Some(Fate::Taken)
    }),
    ("a place of another name", |d| {
        let name = format!("somewhere{}", d.n);
        for line in &mut d.lines {
            *line = line.replace("\"hold\"", &format!("\"{name}\""));
        }
        Some(Fate::Taken)
    }),
];
