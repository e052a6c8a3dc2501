//! Whether a command that is written in the book exists: its verb and options in the help of
//! `armor`, its package, test or script in the repository. Nothing is run but `--help`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::REPOSITORY;
use crate::fixture::{Folder, run_to_end};

/// Programs of the system that commands in the book use. What they do is not tested.
const OTHER_PROGRAMS: [&str; 32] = [
    ".",
    "alias",
    "apt",
    "apt-get",
    "awk",
    "cd",
    "chmod",
    "cp",
    "curl",
    "cut",
    "eval",
    "export",
    "grep",
    "gzip",
    "head",
    "kill",
    "ls",
    "man",
    "mkdir",
    "nohup",
    "pip",
    "rm",
    "rustup",
    "scp",
    "sh",
    "source",
    "ssh",
    "systemd-run",
    "tail",
    "tar",
    "taskset",
    "xmllint",
];

/// Commands that no help lists: `armor` starts them itself.
const HIDDEN: [&str; 1] = ["group-killer"];

/// Options of cargo that no value follows.
const NO_VALUE: [&str; 6] =
    ["--release", "--workspace", "--all-targets", "--lib", "--locked", "--quiet"];

/// The helps of `armor` that were read, and the packages of the repository.
pub struct Usage {
    folder: Folder,
    helps: BTreeMap<Vec<String>, String>,
    /// The name of each package with its folder.
    packages: BTreeMap<String, PathBuf>,
}

impl Usage {
    /// Reads the packages; `name` is that of the test.
    pub fn read(name: &str) -> Self {
        let mut packages = BTreeMap::new();
        let mut folders = vec![PathBuf::from(REPOSITORY)];
        while let Some(folder) = folders.pop() {
            let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
            if let Some(name) = manifest.lines().find_map(|line| line.strip_prefix("name = ")) {
                packages.insert(name.trim_matches('"').to_owned(), folder.clone());
            }
            for entry in std::fs::read_dir(folder).expect("readable").flatten() {
                let name = entry.file_name().into_string().unwrap_or_default();
                let is_other = ["target", "out", "book", "src", "docs"].contains(&name.as_str());
                let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
                if is_folder && !is_other && !name.starts_with('.') {
                    folders.push(entry.path());
                }
            }
        }
        Self { folder: Folder::new(name), helps: BTreeMap::new(), packages }
    }

    /// What is wrong with a line of commands.
    pub fn check_line(&mut self, line: &str) -> Result<(), String> {
        let mut words = words_of(line);
        while let Some(sign) = words.iter().position(|word| word == ">") {
            words.drain(sign..words.len().min(sign + 2));
        }
        let is_end = |word: &String| ["|", "&&", "||", ";", "&", "(", ")"].contains(&word.as_str());
        for command in words.split(is_end) {
            self.check_command(command)?;
        }
        Ok(())
    }

    /// What is wrong with one command.
    fn check_command(&mut self, words: &[String]) -> Result<(), String> {
        let is_setting = |word: &String| {
            word.split_once('=').is_some_and(|(name, _)| {
                !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c == '_')
            })
        };
        let start = words.iter().position(|word| word != "sudo" && !is_setting(word));
        let Some(start) = start else { return Ok(()) };
        let words = &words[start..];
        let program = words[0].rsplit('/').next().unwrap_or_default();
        match program {
            "armor" => self.check_armor(&words[1..]),
            "cargo" => self.check_cargo(&words[1..]),
            "python3" => self.check_script(&words[1..]),
            program if self.packages.contains_key(program) => {
                self.check_options_in_sources(program, &words[1..])
            }
            program if OTHER_PROGRAMS.contains(&program) || words[0].contains('=') => Ok(()),
            _ if Path::new(REPOSITORY).join(&words[0]).is_file() => Ok(()),
            program => {
                Err(format!("`{program}` is neither of this repository nor in the list of others"))
            }
        }
    }

    /// Compares a command of `armor` with the help of its verb.
    pub fn check_armor(&mut self, words: &[String]) -> Result<(), String> {
        // What follows is another command, such as in `armor connect … -- armor ps`.
        let (words, inner) = match words.iter().position(|word| word == "--") {
            Some(at) => (&words[..at], &words[at + 1..]),
            None => (words, &[][..]),
        };
        let mut path: Vec<String> = Vec::new();
        let mut rest = words.iter().peekable();
        while let Some(word) = rest.peek().copied() {
            let commands = commands_in(self.help(&path)?);
            let is_name = word.chars().all(|c| c.is_ascii_lowercase() || c == '-' || c == '|');
            if commands.is_empty() || !is_name || word.starts_with('-') {
                break;
            }
            rest.next();
            let is_known =
                |name: &str| HIDDEN.contains(&name) || commands.iter().any(|known| known == name);
            let unknown = word.split('|').find(|name| !is_known(name));
            if let Some(name) = unknown {
                return Err(format!("`armor {}` has no command `{name}`", path.join(" ")));
            }
            if HIDDEN.contains(&word.as_str()) {
                return Ok(());
            }
            path.push(word.split('|').next().unwrap_or_default().to_owned());
        }
        // A stock component is no command of clap, and has a help of its own.
        if path == ["component"]
            && let Some(kind) = rest.next()
        {
            path.push(kind.clone());
        }
        for word in rest {
            let option = word.split('=').next().unwrap_or_default();
            if option.starts_with('-')
                && is_option(option)
                && !has_option(self.help(&path)?, option)
            {
                return Err(format!("`armor {}` has no option `{option}`", path.join(" ")));
            }
        }
        let is_placeholder = |word: &String| word.chars().all(|c| c.is_ascii_uppercase());
        let has_command = inner.first().is_some_and(|word| !is_placeholder(word));
        if has_command { self.check_command(inner) } else { Ok(()) }
    }

    fn help(&mut self, path: &[String]) -> Result<&str, String> {
        if !self.helps.contains_key(path) {
            let mut arguments: Vec<&str> = path.iter().map(String::as_str).collect();
            arguments.push("--help");
            let (code, out, err) = run_to_end(&mut self.folder.armor(&arguments));
            if code != 0 {
                return Err(format!("`armor {}`: {err}", arguments.join(" ")));
            }
            self.helps.insert(path.to_owned(), out);
        }
        Ok(&self.helps[path])
    }

    /// Compares a command of cargo with the packages, tests and options of the repository.
    fn check_cargo(&mut self, words: &[String]) -> Result<(), String> {
        let (own, program) = match words.iter().position(|word| word == "--") {
            Some(at) => (&words[..at], &words[at + 1..]),
            None => (words, &[][..]),
        };
        let mut packages = Vec::new();
        let mut filters = Vec::new();
        let mut before = "";
        for word in &own[1..] {
            match before {
                "-p" => packages.push(word.as_str()),
                "--path" | "--manifest-path" if !Path::new(REPOSITORY).join(word).exists() => {
                    return Err(format!("there is no {word}"));
                }
                "--test" | "--example" | "--bench" | "--bin" => {
                    self.check_target(packages.last(), before, word)?;
                }
                _ if !word.starts_with('-') && !before.starts_with("--") => {
                    filters.push(word.clone());
                }
                _ => {}
            }
            before = if NO_VALUE.contains(&word.as_str()) { "" } else { word };
        }
        if let Some(unknown) = packages.iter().find(|name| !self.packages.contains_key(**name)) {
            return Err(format!("there is no package {unknown}"));
        }
        let package = packages.first().copied().unwrap_or("armor");
        match own[0].as_str() {
            "run" if package == "armor" => self.check_armor(program),
            "run" => self.check_options_in_sources(package, program),
            "test" => {
                let is_name =
                    |word: &&String| !word.starts_with('-') && word.parse::<u32>().is_err();
                let names: Vec<String> =
                    filters.into_iter().chain(program.iter().filter(is_name).cloned()).collect();
                names.iter().try_for_each(|name| self.check_test(package, name))
            }
            "uninstall" => match filters.iter().find(|name| !self.packages.contains_key(*name)) {
                Some(unknown) => Err(format!("there is no package {unknown}")),
                None => Ok(()),
            },
            "build" | "bench" | "install" | "publish" | "fmt" | "clippy" | "add" | "fetch" => {
                Ok(())
            }
            other => Err(format!("`cargo {other}` is not known to this test")),
        }
    }

    /// A test, example or bench is named in the manifest of its package, or is a file of that name.
    fn check_target(&self, package: Option<&&str>, option: &str, name: &str) -> Result<(), String> {
        let package = package.copied().unwrap_or("armor");
        let folder = self.packages.get(package).ok_or(format!("there is no package {package}"))?;
        let kind = option.trim_start_matches("--");
        let below = if kind == "bench" { "benches".into() } else { format!("{kind}s") };
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
        let is_named = manifest.contains(&format!("name = \"{name}\""));
        let file = folder.join(below).join(name);
        let is_there = is_named || file.is_dir() || file.with_extension("rs").is_file();
        if is_there { Ok(()) } else { Err(format!("there is no {kind} {name}")) }
    }

    /// A filter of `cargo test` is part of the name of a test or of a module.
    fn check_test(&self, package: &str, filter: &str) -> Result<(), String> {
        let last = filter.rsplit("::").next().unwrap_or_default();
        let is_in = |text: &str| {
            let mut lines = text.lines().map(str::trim_start);
            lines.any(|line| {
                let name = ["fn ", "mod ", "pub mod ", "async fn "]
                    .iter()
                    .find_map(|k| line.strip_prefix(k));
                name.is_some_and(|rest| {
                    rest.split(['(', ';', ' ']).next().unwrap_or("").contains(last)
                })
            })
        };
        let found = self.sources(package).iter().any(|text| is_in(text));
        if found {
            Ok(())
        } else {
            Err(format!("{package} has no test whose name contains `{filter}`"))
        }
    }

    /// The options of a program that is not built here must be in its sources.
    fn check_options_in_sources(&self, package: &str, words: &[String]) -> Result<(), String> {
        let sources = self.sources(package);
        for word in words {
            let option = word.split('=').next().unwrap_or_default();
            let Some(name) = option.strip_prefix("--").filter(|name| !name.is_empty()) else {
                continue;
            };
            let names = [
                format!("\"{option}\""),
                format!("{}:", name.replace('-', "_")),
                format!("\"{name}\""),
            ];
            if !sources.iter().any(|text| names.iter().any(|name| text.contains(name.as_str()))) {
                return Err(format!("{package} has no option `{option}`"));
            }
        }
        Ok(())
    }

    /// The texts of a package. The tests of whole systems belong to `armor`.
    fn sources(&self, package: &str) -> Vec<String> {
        let mut folders = vec![self.packages[package].clone()];
        if package == "armor" {
            folders.push(Path::new(REPOSITORY).join("tests"));
        }
        let mut texts = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("readable").flatten() {
                let path = entry.path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "rs") {
                    texts.push(std::fs::read_to_string(path).expect("UTF-8"));
                }
            }
        }
        texts
    }

    /// A script exists, and its text has each option.
    fn check_script(&self, words: &[String]) -> Result<(), String> {
        let Some(script) = words.first().filter(|word| !word.starts_with('-')) else {
            return Ok(());
        };
        let text = std::fs::read_to_string(Path::new(REPOSITORY).join(script))
            .map_err(|e| format!("{script}: {e}"))?;
        let is_unknown = |word: &&String| word.starts_with("--") && !text.contains(word.as_str());
        let unknown = words.iter().find(is_unknown);
        unknown.map_or(Ok(()), |option| Err(format!("{script} has no option `{option}`")))
    }
}

/// The commands that a help lists.
fn commands_in(help: &str) -> Vec<String> {
    let list = help.split("\nCommands:\n").nth(1).unwrap_or_default();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split([' ', ',']).next());
    names.filter(|name| !name.is_empty()).map(String::from).collect()
}

/// Whether a word is an option, and not a negative number or a lone dash.
fn is_option(word: &str) -> bool {
    word.trim_start_matches('-').starts_with(|c: char| c.is_ascii_alphabetic())
}

fn has_option(help: &str, option: &str) -> bool {
    let is_boundary = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
    let lines = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
    lines.flat_map(|line| line.split(is_boundary)).any(|word| word == option)
}

/// The words of a line for the shell. Quotes keep words together; a comment is left out. Signs of
/// the shell are words of their own.
pub fn words_of(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), String::new(), None);
    let mut end = |word: &mut String| {
        if !word.is_empty() {
            words.push(std::mem::take(word));
        }
    };
    let mut before = ' ';
    for c in line.chars() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), c) => word.push(c),
            (None, '\'' | '"') => quote = Some(c),
            (None, '#') if before == ' ' => break,
            (None, c) if c.is_whitespace() => end(&mut word),
            (None, '|' | '&' | ';' | '(' | ')' | '>')
                if !(c == '|' && before.is_alphanumeric()) =>
            {
                if before != c {
                    end(&mut word);
                }
                word.push(c);
                end(&mut word);
            }
            (None, c) => word.push(c),
        }
        before = c;
    }
    end(&mut word);
    words
}

#[test]
fn words_are_those_of_a_shell() {
    let words = words_of("A=1 armor echo 'a b'.c --csv >x.csv && ls | wc # why");
    assert_eq!(
        words,
        ["A=1", "armor", "echo", "a b.c", "--csv", ">", "x.csv", "&", "&", "ls", "|", "wc"]
    );
}

#[test]
fn a_command_that_does_not_exist_is_named() {
    let mut usage = Usage::read("book-usage");
    for fine in [
        "armor data list simulator",
        "armor data list|info NAME",
        "armor echo a.b --csv > x.csv",
        "ARMOR_LOG=debug armor logs -f -n 5",
        "armor connect robot --key a.key -- armor ps --format json",
        "sudo target/release/armor-bench --only soak --minutes 30",
        "cargo test -p armor --test system floods -- --nocapture",
        "python3 bench/observers.py --rounds 5",
    ] {
        assert_eq!(usage.check_line(fine), Ok(()), "{fine}");
    }
    for (wrong, part) in [
        ("armor psx", "`psx`"),
        ("armor data lists", "`lists`"),
        ("armor data list|inform NAME", "`inform`"),
        ("armor echo a.b --comma", "`--comma`"),
        ("armor connect robot -- armor pst", "`pst`"),
        ("cargo run -p armor-bench -- --onlyy soak", "`--onlyy`"),
        ("cargo run -p armor-bunch", "armor-bunch"),
        ("cargo test -p armor --test system no_such_test", "`no_such_test`"),
        ("python3 bench/no_such.py", "no_such.py"),
        ("armour ps", "`armour`"),
    ] {
        let fault = usage.check_line(wrong).expect_err(wrong);
        assert!(fault.contains(part), "{wrong}: {fault}");
    }
}
