//! A page of the book as its blocks of commands, each with the word of its fence that states how a
//! test treats it.

use std::path::{Path, PathBuf};

use super::REPOSITORY;

/// How the commands of a block are tested: a word after the three backticks and `sh`.
#[derive(Clone, Debug, PartialEq)]
pub enum Treatment {
    /// `in=SCENE`: the commands are run.
    Run { scene: String, fails: bool },
    /// `parsed=REASON`: the verbs and options are compared with the program's help.
    Parse { reason: String },
    /// `file=NAME`: the block is a file of the reader.
    Write { file: String },
    /// No word: refused, except for blocks that another test runs.
    Undeclared,
}

/// A block of commands.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The number of its first line.
    pub line: usize,
    pub treatment: Treatment,
    pub commands: String,
    /// The output that the page shows directly below it, as `text`.
    pub shown: Option<String>,
}

/// A page of the book, or the README of the repository.
pub struct Page {
    /// Its path from the root of the repository.
    pub path: String,
    pub blocks: Vec<Block>,
    /// Code within its text, with the numbers of the lines.
    pub spans: Vec<(usize, String)>,
}

impl Page {
    /// Returns whether another test runs the page: the tutorial, and the examples of the findings.
    pub fn is_run_elsewhere(&self) -> bool {
        self.path.starts_with("docs/tutorial/") || self.path.starts_with("docs/errors/")
    }
}

/// Reads the README and all pages that `docs/SUMMARY.md` names.
pub fn read_book() -> Vec<Page> {
    let root = Path::new(REPOSITORY);
    let read = |path: &str| {
        std::fs::read_to_string(root.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
    };
    let summary = read("docs/SUMMARY.md");
    let chapters = summary.split("](").skip(1).filter_map(|after| after.split(')').next());
    let chapters = chapters.map(|chapter| PathBuf::from("docs").join(chapter));
    let paths = std::iter::once(PathBuf::from("README.md")).chain(chapters);
    let pages = paths.map(|path| {
        let path = path.display().to_string();
        let (blocks, spans) = read_page(&read(&path));
        Page { path, blocks, spans }
    });
    pages.collect()
}

fn read_page(text: &str) -> (Vec<Block>, Vec<(usize, String)>) {
    let (mut blocks, mut spans) = (Vec::<Block>::new(), Vec::new());
    let mut lines = text.lines().zip(1..).peekable();
    // Whether the line before ended a block of commands.
    let mut follows = false;
    while let Some((line, number)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else {
            let code = line.split('`').skip(1).step_by(2);
            spans.extend(code.map(|span| (number, span.to_owned())));
            follows &= line.is_empty();
            continue;
        };
        let inside = lines.by_ref().map(|(line, _)| line).take_while(|line| *line != "```");
        let content = inside.map(|line| format!("{line}\n")).collect::<String>();
        let words: Vec<&str> = info.split_whitespace().collect();
        match words[..] {
            ["sh" | "console", ref rest @ ..] => {
                let treatment = treatment_of(rest);
                let block = Block { line: number, treatment, commands: content, shown: None };
                blocks.push(block);
                follows = true;
            }
            ["text"] if follows => {
                blocks.last_mut().expect("it follows one").shown = Some(content);
                follows = false;
            }
            [_, file] if file.starts_with("file=") => {
                let treatment = Treatment::Write { file: file["file=".len()..].into() };
                let block = Block { line: number, treatment, commands: content, shown: None };
                blocks.push(block);
                follows = false;
            }
            [] | ["text"] if has_command(&content, words.is_empty()) => {
                let treatment = Treatment::Undeclared;
                let block = Block { line: number, treatment, commands: content, shown: None };
                blocks.push(block);
                follows = false;
            }
            _ => follows = false,
        }
    }
    (blocks, spans)
}

/// Whether a block that is not marked as one of commands has some.
fn has_command(text: &str, is_unmarked: bool) -> bool {
    let programs = ["armor ", "cargo ", "python3 "];
    text.lines().any(|line| {
        let command = line.strip_prefix("$ ").or(is_unmarked.then_some(line));
        command.is_some_and(|command| programs.iter().any(|program| command.starts_with(program)))
    })
}

fn treatment_of(words: &[&str]) -> Treatment {
    let value = |key: &str| words.iter().find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
    let fails = words.contains(&"fails");
    match (value("in"), value("parsed")) {
        (Some(scene), None) => Treatment::Run { scene: scene.into(), fails },
        (None, Some(reason)) => Treatment::Parse { reason: reason.into() },
        _ => Treatment::Undeclared,
    }
}

/// The commands of a block, one per item: without the name of the host that a line begins with
/// (`robot$`), and with the lines of a command that continues.
pub fn command_lines(commands: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut continues = false;
    for line in commands.lines() {
        let line = match line.split_once("$ ") {
            Some((host, rest)) if host.chars().all(|c| c.is_ascii_lowercase()) => rest.trim_start(),
            _ => line.trim_start(),
        };
        let (text, goes_on) = line.strip_suffix('\\').map_or((line, false), |text| (text, true));
        match out.last_mut().filter(|_| continues) {
            Some(last) => *last += text,
            None => out.push(text.to_owned()),
        }
        continues = goes_on;
    }
    out.retain(|line| !line.trim().is_empty() && !line.starts_with('#'));
    out
}

#[test]
fn a_page_is_read_as_its_blocks() {
    let text = "# T\nrun `armor ps`\n```sh in=office\na\n```\n```text\nb\n```\nx\n```sh parsed=hosts\nc\n```\n\nand\n\
                ```text\nd\n```\n```sh\ne\n```\n";
    let (blocks, spans) = read_page(text);
    assert_eq!(spans, [(2, "armor ps".to_owned())]);
    let seen: Vec<_> =
        blocks.iter().map(|b| (b.line, b.treatment.clone(), b.shown.as_deref())).collect();
    let office = Treatment::Run { scene: "office".into(), fails: false };
    let hosts = Treatment::Parse { reason: "hosts".into() };
    let expected = [(3, office, Some("b\n")), (10, hosts, None), (18, Treatment::Undeclared, None)];
    assert_eq!(seen, expected);
}

#[test]
fn a_command_may_take_several_lines_and_name_its_host() {
    let lines = command_lines("# first\nrobot$   armor ps \\\n  --all\n\narmor run x.xml\n");
    assert_eq!(lines, ["armor ps --all", "armor run x.xml"]);
}
