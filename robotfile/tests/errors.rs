//! The catalogue in `docs/errors`: every code has a page, its example gives that code and nothing
//! else, prints what the page shows, and is clean in its fixed form.
//!
//! Beside this file, `errors/CODE.xml` is the example, `CODE.fixed.xml` the fixed one,
//! `CODE.NAME.xml` a file called `NAME.xml` that it names, `CODE.set` the `--set` of the command
//! line, `CODE.txt` what is printed. With `ARMOR_BLESS=1` the tests write `CODE.txt` and the blocks of
//! the pages instead of comparing them.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use armor_robotfile::{
    Code, Colours, Findings, Manifests, Override, Reading, check, needed_paths, passed_dates, read,
};
use armor_wire::manifest::Manifest;

/// What the example of a code is called in its findings.
const MAIN: &str = "robot.xml";
/// The data that there are beside the examples.
const THERE: [&str; 2] = ["run.log", "run & jump.log"];
/// Codes of component directories, which only the launcher looks into, and of what the executive
/// proves: their tests have the examples.
const ELSEWHERE: &[Code] = &[
    Code::BrokenExecutable,
    Code::KindTwice,
    Code::NoDirectory,
    Code::DescribeHangs,
    Code::ManifestVersion,
    Code::NotAProgram,
    Code::UnusableEntry,
    Code::KindTwiceUnused,
    Code::FillsWithoutEnd,
    Code::GoalNeverReached,
    Code::Standstill,
    Code::GoalLost,
    Code::TwoTokens,
    Code::MarkedTogether,
    Code::ValuesContradict,
    Code::ValuesOpen,
    Code::ValueOutside,
    Code::NotProven,
    Code::Takes,
    Code::CheckFails,
    Code::CheckUndecided,
];

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Faulty,
    Fixed,
}

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/errors")
}

fn pages() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/errors")
}

fn manifests() -> Manifests {
    let text = fs::read_to_string(examples().join("manifests.json")).unwrap();
    let manifests: Vec<Manifest> = serde_json::from_str(&text).unwrap();
    manifests.into_iter().map(|manifest| (manifest.kind.clone(), manifest)).collect()
}

/// Examples that are too long to keep: the system of a robot, written out.
fn written_out(code: Code, form: Form) -> Option<String> {
    let system = |inner: String| {
        format!("<armor version=\"1\">\n  <system>\n{inner}  </system>\n</armor>\n")
    };
    let is_faulty = form == Form::Faulty;
    let more = |limit: usize| if is_faulty { limit + 1 } else { limit };
    Some(match code {
        Code::TooLong => {
            let len = if is_faulty { armor_robotfile::MAX_FILE_BYTES } else { 1000 };
            system(format!("    <!-- {} -->\n", "log ".repeat(len / 4)))
        }
        Code::TooMany => {
            let line = |n| format!("    <component name=\"arm-{n}\" kind=\"arm\"/>\n");
            system((1..=more(armor_robotfile::MAX_ELEMENTS)).map(line).collect())
        }
        Code::More => {
            let count = if is_faulty { armor_robotfile::MAX_FINDINGS + 1 } else { 0 };
            system("    <componant/>\n".repeat(count))
        }
        _ => return None,
    })
}

/// The file beside this one that stands for `name` in the example.
fn example(code: Code, form: Form, name: &str) -> PathBuf {
    let code = code.as_str();
    let stem = match name.strip_suffix(".xml") {
        Some("robot") => code.to_owned(),
        Some(other) => format!("{code}.{other}"),
        None => format!("{code}.{name}"),
    };
    let fixed = examples().join(format!("{stem}.fixed.xml"));
    if form == Form::Fixed && fixed.exists() {
        fixed
    } else {
        examples().join(format!("{stem}.xml"))
    }
}

fn sets(code: Code, form: Form) -> Vec<String> {
    let fixed = if form == Form::Fixed { ".fixed" } else { "" };
    let path = examples().join(format!("{}{fixed}.set", code.as_str()));
    fs::read_to_string(path)
        .map(|text| text.lines().map(String::from).collect())
        .unwrap_or_default()
}

/// All that `armor check robot.xml` would find.
fn checked(code: Code, form: Form, manifests: &Manifests) -> Findings {
    let mut reading = read(Path::new(MAIN), &mut |path| {
        let name = path.to_str().unwrap();
        match written_out(code, form) {
            Some(text) => Ok(text.into_bytes()),
            None => fs::read(example(code, form, name)).map_err(|_| {
                io::Error::new(io::ErrorKind::NotFound, "No such file or directory (os error 2)")
            }),
        }
    });
    let mut overrides = Vec::new();
    for set in sets(code, form) {
        match Override::parse(&set, Path::new("")) {
            Ok(set) => overrides.push(set),
            Err(finding) => reading.findings.extend([*finding]),
        }
    }
    let Reading { configuration, mut findings, .. } = check(reading, &overrides, Some(manifests));
    if let Some(configuration) = configuration {
        let paths = needed_paths(&configuration, manifests);
        let missing =
            paths.iter().filter(|needed| !THERE.iter().any(|file| needed.path == Path::new(file)));
        findings.extend(missing.map(armor_robotfile::NeededPath::missing));
        findings.extend(passed_dates(&configuration, "2030-01-01T00:00Z".parse().unwrap()));
        if code == Code::NotPlayed {
            configuration.refuse_unplayed(&[], &mut findings);
        }
    }
    findings
}

fn is_blessing() -> bool {
    std::env::var_os("ARMOR_BLESS").is_some()
}

/// Compares with the file, or writes it.
fn same(path: &Path, text: &str) {
    if is_blessing() {
        fs::write(path, text).unwrap();
    }
    let wanted = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!(text, wanted, "{} is out of date", path.display());
}

#[test]
fn every_example_gives_its_code_as_its_page_shows_and_is_clean_when_fixed() {
    let manifests = manifests();
    for code in Code::ALL.iter().copied().filter(|code| !ELSEWHERE.contains(code)) {
        let findings = checked(code, Form::Faulty, &manifests);
        let shown = findings.render(Colours::No);
        let (own, others): (Vec<_>, Vec<_>) =
            findings.iter().partition(|finding| finding.code == code);
        let is_listed = code == Code::More && others.iter().all(|f| f.code == Code::UnknownElement);
        assert!(!own.is_empty() && (others.is_empty() || is_listed), "{code:?}:\n{shown}");
        let text: Vec<_> = own.iter().map(|finding| finding.render(Colours::No)).collect();
        same(&examples().join(format!("{}.txt", code.as_str())), &text.join("\n"));
        assert!(own.iter().all(|finding| !finding.remedy.is_empty()), "{code:?} has no remedy");
        let fixed = checked(code, Form::Fixed, &manifests);
        assert!(fixed.is_empty(), "{code:?}, fixed:\n{}", fixed.render(Colours::No));
        let path = pages().join(format!("{}.md", code.as_str()));
        let page = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        same(&path, &with_blocks(&page, &shown_files(code)));
    }
}

/// The text of a file as a page can show it.
fn shown(path: &Path) -> String {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let text = String::from_utf8_lossy(&bytes);
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{b7}' } else { c }).collect()
}

/// The files whose text the page shows, in its order: the example, what it names, what is
/// printed, and the same fixed.
fn shown_files(code: Code) -> Vec<PathBuf> {
    let code = code.as_str();
    let mut files: Vec<_> = fs::read_dir(examples())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with(code))
        .collect();
    let rank = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let kind = match name.strip_prefix(code).unwrap() {
            ".xml" => 0,
            ".set" => 2,
            ".txt" => 3,
            ".fixed.xml" => 4,
            ".fixed.set" => 6,
            other if other.ends_with(".fixed.xml") => 5,
            _ => 1,
        };
        (kind, name)
    };
    files.sort_by_key(rank);
    files
}

/// The page with the text of the files in its blocks.
fn with_blocks(page: &str, files: &[PathBuf]) -> String {
    let mut out = String::new();
    let mut files = files.iter();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        out += line;
        out.push('\n');
        if ["```xml", "```text", "```sh"].contains(&line) {
            let block: Vec<_> = lines.by_ref().take_while(|line| *line != "```").collect();
            if line == "```sh" && !block.concat().contains("--set") {
                out += &(block.join("\n") + "\n```\n");
                continue;
            }
            let file = files.next();
            let file = file.unwrap_or_else(|| panic!("a block without a file:\n{page}"));
            let text = shown(file);
            out += &match file.extension().unwrap().to_str() {
                Some("set") => format!("armor check robot.xml --set {text}"),
                _ => text,
            };
            out += "```\n";
        }
    }
    assert!(files.len() == 0, "not in the page: {files:?}\n{page}");
    out
}

#[test]
fn nothing_in_the_catalogue_is_orphaned_and_all_of_it_is_in_the_index() {
    let codes: BTreeSet<_> = Code::ALL.iter().map(|code| code.as_str()).collect();
    let index = fs::read_to_string(pages().join("README.md")).unwrap();
    for code in Code::ALL {
        let line = format!("| [{0}]({0}.md) | {1} |", code.as_str(), code.title());
        assert!(index.contains(&line), "the index lacks\n{line}");
        let page = fs::read_to_string(pages().join(format!("{}.md", code.as_str()))).unwrap();
        let head = format!("# {}: {}\n", code.as_str(), code.title());
        assert!(page.starts_with(&head), "a page does not start with\n{head}");
    }
    for folder in [examples(), pages()] {
        for entry in fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let known = codes.contains(name.split('.').next().unwrap());
            assert!(known || ["README.md", "manifests.json"].contains(&name.as_str()), "{name}");
        }
    }
}
