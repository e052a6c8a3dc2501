//! Follows the tutorial exactly: writes its files, runs its commands, and compares their output
//! with the page. `docs/tutorial/README.md` states the conventions.

pub mod page;
pub mod terminal;

use std::os::unix::fs::symlink;
use std::path::Path;

use crate::fixture::{Folder, wait_for};
use page::{Language, Page, Step};
use terminal::{Program, Terminal};

/// The pages that one reader follows in one folder.
const READERS: [&[&str]; 3] = [
    &["1-run"],
    &["2-component", "3-inputs", "4-system", "5-mission", "6-when-it-stands-still"],
    &["7-replay"],
];
/// The reader who writes components.
const WRITER: usize = 1;
const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Creates the folder of one reader. It contains `missions`, as a clone of the repository does.
fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    let missions = Path::new(REPOSITORY).join("missions");
    symlink(missions.canonicalize().expect("it is there"), folder.path().join("missions"))
        .expect("a link");
    folder
}

// Slow (one to two minutes): the office mission runs in real time, as for a reader.
#[test]
fn the_first_run_is_as_the_tutorial_shows_it() {
    read(0, Language::Rust);
}

// Slow (minutes): it builds a component with `cargo`, as the page asks its reader to do.
#[test]
fn the_tutorial_leads_from_nothing_to_the_users_own_mission() {
    read(WRITER, Language::Rust);
}

// `.ci/run` runs it where the package is: PATH has a Python with it.
#[test]
#[ignore = "needs the Python package `armor`: python3 in PATH has it"]
fn the_tutorial_leads_there_in_python_too() {
    read(WRITER, Language::Python);
}

// `.ci/run` runs it where the package is: CMAKE_PREFIX_PATH leads to it.
#[test]
#[ignore = "needs the package for C and C++: `sdk/c/install.sh PREFIX`, CMAKE_PREFIX_PATH=PREFIX"]
fn the_tutorial_leads_there_in_cpp_too() {
    read(WRITER, Language::Cpp);
}

#[test]
fn a_recorded_log_becomes_a_map_as_the_tutorial_shows_it() {
    read(2, Language::Rust);
}

#[test]
fn every_page_is_read_and_in_the_index() {
    let pages = Path::new(REPOSITORY).join("docs/tutorial");
    let index = std::fs::read_to_string(pages.join("README.md")).expect("an index");
    for entry in std::fs::read_dir(pages).expect("it is there") {
        let file = entry.expect("readable").file_name().into_string().expect("UTF-8");
        let page = file.strip_suffix(".md").expect("a page");
        if page != "README" {
            assert!(READERS.concat().contains(&page), "no test reads {file}");
            assert!(index.contains(&format!("({file})")), "the index lacks {file}");
        }
    }
}

fn read(reader: usize, language: Language) {
    let folder = folder(&format!("tutorial-{reader}-{language:?}"));
    let mut terminal = Terminal::new(&folder);
    for page in READERS[reader] {
        follow(&mut terminal, &Page::read(page, language));
    }
}

/// The output with which the next expected block is compared.
enum Printed {
    Nothing,
    By { commands: String, output: String },
    InOtherTerminal,
    AtEnd { output: String },
}

fn follow(terminal: &mut Terminal, page: &Page) {
    let mut programs: Vec<Program> = Vec::new();
    let mut actual = Printed::Nothing;
    for (line, step) in &page.steps {
        let at = format!("{}.md:{line}", page.name);
        match step {
            Step::Write { path, text } => terminal.write(path, text),
            Step::Run { commands, fails } => {
                let output = terminal.run(commands, *fails, &at);
                actual = Printed::By { commands: commands.clone(), output };
            }
            Step::Start { command } => {
                programs.push(terminal.start(command));
                actual = Printed::InOtherTerminal;
            }
            Step::Interrupt => {
                let program = programs.pop().unwrap_or_else(|| panic!("{at}: nothing runs"));
                actual = Printed::AtEnd { output: program.interrupt(&at) };
            }
            Step::ExpectOther { text } => {
                expect(terminal, programs.last(), &Printed::InOtherTerminal, text, &at);
            }
            Step::Expect { text } => expect(terminal, programs.last(), &actual, text, &at),
        }
    }
    while let Some(program) = programs.pop() {
        program.interrupt(&page.name);
    }
}

fn expect(terminal: &Terminal, program: Option<&Program>, actual: &Printed, text: &str, at: &str) {
    let check = |output: &str| {
        assert!(page::matches(text, output), "{at}: expected\n{text}\nbut it printed\n{output}");
    };
    match actual {
        Printed::Nothing => panic!("{at}: nothing was run before"),
        Printed::AtEnd { output } => check(output),
        Printed::InOtherTerminal => {
            let program = program.expect("it was started");
            wait_for(&format!("{at}: {text}"), || {
                let output = program.output();
                let as_expected = page::matches(text, &output);
                if program.has_ended() {
                    check(&output);
                }
                as_expected.then_some(())
            });
        }
        // A command that only reads the state may have run too early; repeat it, as a reader does.
        Printed::By { commands, output } if only_looks(commands) => {
            if page::matches(text, output) {
                return;
            }
            let mut last = output.clone();
            let start = std::time::Instant::now();
            while !page::matches(text, &last) && start.elapsed() < crate::fixture::DEADLINE {
                last = terminal.try_run(commands).1;
            }
            check(&last);
        }
        Printed::By { output, .. } => check(output),
    }
}

fn only_looks(commands: &str) -> bool {
    let looks = ["armor ps", "armor graph", "armor echo", "armor hz", "armor mission", "grep"];
    commands.lines().count() == 1 && looks.iter().any(|look| commands.starts_with(look))
}
