//! A page of the tutorial as a list of steps, and the loose comparison of its output with the real
//! one.

use std::path::Path;

use super::REPOSITORY;
use crate::fixture::free_port;

/// A step that a reader takes.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Writes a file.
    Write { path: String, text: String },
    /// Runs commands to their end; `fails`: the last one exits with an error.
    Run { commands: String, fails: bool },
    /// Starts a command in a terminal of its own.
    Start { command: String },
    /// Presses Ctrl-C in the terminal opened last.
    Interrupt,
    /// Compares the output with the page.
    Expect { text: String },
    /// Compares the output so far of the terminal opened last.
    ExpectOther { text: String },
}

/// The language that a reader writes components in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Built with cargo.
    Rust,
    /// Scripts.
    Python,
    /// Built with CMake.
    Cpp,
}

impl Language {
    /// As the word of a block states it.
    fn named(word: &str) -> Option<Self> {
        match word {
            "for=rust" => Some(Self::Rust),
            "for=python" => Some(Self::Python),
            "for=cpp" => Some(Self::Cpp),
            _ => None,
        }
    }
}

/// A page.
pub struct Page {
    /// Its file, without `.md`.
    pub name: String,
    /// Line and step.
    pub steps: Vec<(usize, Step)>,
}

impl Page {
    /// Reads a page of `docs/tutorial`, without what is for readers of other languages.
    pub fn read(name: &str, language: Language) -> Self {
        let path = Path::new(REPOSITORY).join(format!("docs/tutorial/{name}.md"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        // A page uses one fixed port. Replace it, because other tests may run on this host.
        let text = text.replace(":7500", &format!(":{}", free_port()));
        Self { name: name.into(), steps: steps(&text, language) }
    }
}

fn steps(text: &str, language: Language) -> Vec<(usize, Step)> {
    let mut steps = Vec::new();
    let mut lines = text.lines().zip(1..);
    while let Some((line, number)) = lines.next() {
        if line.contains("<!-- Ctrl-C -->") {
            steps.push((number, Step::Interrupt));
        }
        let Some(info) = line.strip_prefix("```") else { continue };
        let block: Vec<&str> =
            lines.by_ref().map(|(line, _)| line).take_while(|line| *line != "```").collect();
        let block = block.join("\n") + "\n";
        let mut words: Vec<&str> = info.split_whitespace().collect();
        let reader = words.iter().find_map(|word| Language::named(word));
        if reader.is_some_and(|reader| reader != language) {
            continue;
        }
        words.retain(|word| Language::named(word).is_none());
        let step = match words[..] {
            ["sh"] => Step::Run { commands: block, fails: false },
            ["sh", "fails"] => Step::Run { commands: block, fails: true },
            ["sh", "background"] => Step::Start { command: block },
            ["text"] => Step::Expect { text: block },
            ["text", "background"] => Step::ExpectOther { text: block },
            // A session that the reader types by hand; the test skips it.
            ["console"] => continue,
            [_, file] if file.starts_with("file=") => {
                Step::Write { path: file["file=".len()..].into(), text: block }
            }
            _ => panic!("line {number}: no test would fail if this block, `{info}`, were wrong"),
        };
        steps.push((number, step));
    }
    steps
}

/// Whether `output` matches the text on the page. A number matches any number, a time matches a
/// time in any unit, `…` matches any text, and one space matches several. That a command had to wait
/// for its data depends on the moment of the call, so it is left out.
pub fn matches(shown: &str, output: &str) -> bool {
    let is_waiting = |line: &str| line.contains(" so far: ") && line.ends_with("; waiting");
    // On a busy host a rehearsal begins again, slower.
    let is_notice =
        |line: &str| is_waiting(line) || line.contains(" on this host: rehearsing again at ");
    let lines: Vec<_> = output.lines().filter(|line| !is_notice(line)).collect();
    let output = loosened(&lines.join("\n"));
    let shown = loosened(shown);
    let mut pieces: Vec<&str> = shown.split('…').map(str::trim).collect();
    let last = pieces.pop().unwrap_or_default();
    let mut rest = output.as_str();
    for (number, piece) in pieces.iter().enumerate() {
        let Some(at) = rest.find(piece).filter(|at| number > 0 || *at == 0) else { return false };
        rest = &rest[at + piece.len()..];
    }
    if pieces.is_empty() { rest == last } else { rest.ends_with(last) }
}

fn loosened(text: &str) -> String {
    let lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    let mut text = without_numbers(lines.collect::<Vec<_>>().join("\n").trim());
    for time in ["# us", "# ms", "# min # s"] {
        text = text.replace(time, "# s");
    }
    text
}

/// Replaces each number that is not part of a word, with its sign, fraction and exponent, by `#`.
fn without_numbers(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(next) = rest.chars().next() {
        let in_word = out.ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let number = if in_word { 0 } else { number_len(rest) };
        if number > 0 {
            out.push('#');
            rest = &rest[number..];
        } else {
            out.push(next);
            rest = &rest[next.len_utf8()..];
        }
    }
    out
}

fn number_len(text: &str) -> usize {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let sign = usize::from(text.starts_with(['-', '+']));
    let whole = digits(&text[sign..]);
    if whole == 0 {
        return 0;
    }
    let mut len = sign + whole;
    for (mark, signed) in [('.', false), ('e', true)] {
        let Some(after) = text[len..].strip_prefix(mark) else { continue };
        let minus = usize::from(signed && after.starts_with('-'));
        let more = digits(&after[minus..]);
        if more > 0 {
            len += 1 + minus + more;
        }
    }
    len
}

#[test]
fn numbers_and_spaces_may_differ_and_words_may_not() {
    let check = |shown: &str, output: &str, expected: bool| {
        assert_eq!(matches(shown, output), expected, "{shown:?} {output:?}");
    };
    check("up 3.5 s\n", "up   12 s", true);
    check("up +3.5 s\n", "up -12 s", true);
    check("up 3.5 s\n", "down 3.5 s", false);
    check("a -1e-3 b", "a 0.25 b", true);
    check("27 us", "1 min 02 s", true);
    check("E0104", "E0105", false);
    check("first\n…\nlast", "first\nother\nlast\n", true);
    check("first\n…\nlast", "first\nother\nlast\nmore\n", false);
    check("first\n…", "before\nfirst\nother", false);
    check("… middle …", "the middle of it", true);
    check("x", "x y", false);
    check("x", "no a.b so far: `a` is active; waiting\nx", true);
}

#[test]
fn a_page_is_split_into_its_steps() {
    let text = "# T\n```sh\na\nb\n```\n```text\nc\n```\n```rust file=x/y.rs\nd\n```\n\
                ```sh background\ne\n```\nPress Ctrl-C. <!-- Ctrl-C -->\n```console\nf\n```\n";
    let steps = steps(text, Language::Rust);
    let own = String::from;
    assert_eq!(
        steps,
        [
            (2, Step::Run { commands: own("a\nb\n"), fails: false }),
            (6, Step::Expect { text: own("c\n") }),
            (9, Step::Write { path: own("x/y.rs"), text: own("d\n") }),
            (12, Step::Start { command: own("e\n") }),
            (15, Step::Interrupt),
        ]
    );
}

#[test]
fn blocks_of_other_languages_are_left_out() {
    let text = "```sh for=rust\na\n```\n```sh background for=python\nb\n```\n\
                ```cpp file=x for=cpp\nc\n```\n```sh\nd\n```\n";
    let all = Step::Run { commands: "d\n".into(), fails: false };
    let check = |language, own: (usize, Step)| {
        assert_eq!(steps(text, language), [own, (10, all.clone())]);
    };
    check(Language::Rust, (1, Step::Run { commands: "a\n".into(), fails: false }));
    check(Language::Python, (4, Step::Start { command: "b\n".into() }));
    check(Language::Cpp, (7, Step::Write { path: "x".into(), text: "c\n".into() }));
}
