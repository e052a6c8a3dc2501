//! Runs the commands of the book and of the README, and compares their output where a page shows
//! it. What cannot run in a test is compared with the programs' own options instead.
//!
//! A word after the three backticks and `sh` states which: `in=SCENE` (`book/scene.rs` lists the
//! scenes), or `parsed=REASON` ([`REASONS`]). Code within the text, such as `armor ps`, is compared
//! with the options, too. The tutorial has its own test, `tutorial.rs`.

mod page;
mod scene;
mod usage;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use crate::fixture::{free_port, wait_for};
use crate::tutorial::page::matches;
use crate::tutorial::terminal::{Program, Terminal};
use page::{Block, Page, Treatment, command_lines, read_book};
use scene::{Scene, is_scene, make_folder, scene_names};
use usage::{Usage, words_of};

const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The number of pages that are followed at the same time. Each runs a system or two.
const READERS: usize = 4;

/// Why commands of the book are not run here.
const REASONS: [(&str, &str); 7] = [
    (
        "build",
        "it builds or tests for minutes; the gate does the same, or it is for this repository",
    ),
    ("measure", "it measures for minutes, and its figures are for a quiet machine"),
    ("window", "it opens a window; tests/windows does the tasks in a display of its own"),
    ("hosts", "it needs further computers; tests/keys.rs and tests/hosts.rs play them"),
    ("port", "it takes the default port, which another system of this host may have"),
    ("install", "it changes the computer of the reader"),
    ("reader", "it needs a file or program of the reader's"),
];

/// Commands that stay until Ctrl-C and print immediately, unless they have one of the options.
const UNENDING: [(&str, &[&str]); 9] = [
    ("armor echo", &["--once", "--count"]),
    ("armor hz", &["--count", "--for"]),
    ("armor bw", &["--count", "--for"]),
    ("armor delay", &["--count", "--for"]),
    ("armor watch", &[]),
    ("armor logs -f", &[]),
    ("armor host", &[]),
    ("armor gate", &[]),
    ("armor mission show --follow", &[]),
];
/// Those of them that may have nothing to print.
const QUIET: [&str; 1] = ["armor logs -f"];
/// Commands that other commands of the block need, until its end or the next of them.
const STAYING: [&str; 3] = ["armor run", "armor play", "armor web"];
/// Time in which a command that reads prints what a page shows.
const REPEATED: Duration = Duration::from_secs(20);
/// A recording of this size has messages, not only its beginning.
const RECORDED_BYTES: u64 = 20_000;
/// Commands that end by themselves after a while, meanwhile the next ones are run.
const LATER: [&str; 1] = ["armor plot"];

#[test]
fn every_block_of_commands_states_how_it_is_tested() {
    let reasons: Vec<_> = REASONS.iter().map(|(name, _)| *name).collect();
    let mut faults = Vec::new();
    let mut used = BTreeSet::new();
    for page in read_book().into_iter().filter(|page| !page.is_run_elsewhere()) {
        for block in page.blocks {
            let at = format!("{}:{}", page.path, block.line);
            match block.treatment {
                Treatment::Run { scene, .. } if is_scene(&scene) => drop(used.insert(scene)),
                Treatment::Write { .. } => {}
                Treatment::Parse { reason } if reasons.contains(&reason.as_str()) => {
                    used.insert(reason);
                }
                other => faults.push(format!("{at}: {other:?}")),
            }
        }
    }
    let scenes = scene_names();
    assert!(
        faults.is_empty(),
        "write `sh in=SCENE` ({}) or `sh parsed=REASON` ({}) at\n{}",
        scenes.join(", "),
        reasons.join(", "),
        faults.join("\n")
    );
    for name in scenes.into_iter().chain(reasons) {
        assert!(used.contains(name), "no block has {name}");
    }
}

#[test]
fn every_command_of_the_book_exists_with_its_options() {
    let mut usage = Usage::read("book-options");
    let mut faults = Vec::new();
    for page in &read_book() {
        for block in &page.blocks {
            let is_file = matches!(block.treatment, Treatment::Write { .. });
            let lines = if is_file { Vec::new() } else { command_lines(&block.commands) };
            for line in lines {
                if !line.starts_with("armor ") && is_of_reader(page, block) {
                    continue;
                }
                if let Err(fault) = usage.check_line(&line) {
                    faults.push(format!("{}:{}: {line}\n    {fault}", page.path, block.line));
                }
            }
        }
        for (line, span) in &page.spans {
            let words = words_of(span);
            if words.first().is_some_and(|word| word == "armor")
                && let Err(fault) = usage.check_line(span)
            {
                faults.push(format!("{}:{line}: {span}\n    {fault}", page.path));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a block may have commands of a project that the reader has made, or, in the tutorial, is
/// text.
fn is_of_reader(page: &Page, block: &Block) -> bool {
    let is_theirs = matches!(&block.treatment, Treatment::Parse { reason } if reason == "reader");
    is_theirs || page.is_run_elsewhere() && block.treatment == Treatment::Undeclared
}

// Slow (half a minute): simulated robots drive while the commands are run.
#[test]
fn every_command_of_the_book_runs_as_it_is_written() {
    let is_run = |block: &Block| matches!(block.treatment, Treatment::Run { .. });
    let pages = read_book().into_iter().filter(|page| !page.is_run_elsewhere());
    let pages: Vec<_> = pages.filter(|page| page.blocks.iter().any(is_run)).collect();
    let next = Mutex::new(pages.iter().enumerate());
    let take_next = || next.lock().expect("no reader panics while it takes a page").next();
    thread::scope(|scope| {
        for _ in 0..READERS {
            scope.spawn(|| {
                while let Some((number, page)) = take_next() {
                    follow(page, number);
                }
            });
        }
    });
}

/// Runs the blocks of a page in one folder, in their order.
fn follow(page: &Page, number: usize) {
    let needs_recording = page.blocks.iter().any(|block| {
        matches!(block.treatment, Treatment::Run { .. }) && block.commands.contains("drive.mcap")
    });
    let folder = make_folder(&format!("book-{number}"), needs_recording);
    let terminal = Terminal::at_home(&folder);
    let start = Instant::now();
    let web = format!("127.0.0.1:{}", free_port());
    let mut scene: Option<(String, Scene)> = None;
    for block in &page.blocks {
        if let Treatment::Write { file } = &block.treatment {
            terminal.write(file, &block.commands);
        }
        let Treatment::Run { scene: name, fails } = &block.treatment else { continue };
        let at = format!("{}:{}", page.path, block.line);
        if scene.as_ref().is_none_or(|(present, _)| present != name) {
            if let Some((_, mut before)) = scene.take() {
                before.end();
            }
            scene = Some((name.clone(), Scene::begin(&terminal, name, &web)));
        }
        run_block(&terminal, block, *fails, &web, &at);
    }
    if let Some((_, mut last)) = scene {
        last.end();
    }
    println!("{}: {:.1} s", page.path, start.elapsed().as_secs_f64());
}

/// What runs while the commands of a block do.
struct Running<'a> {
    staying: Scene<'a>,
    /// The commands that print until Ctrl-C.
    unending: Vec<(String, Program)>,
    /// Those that end by themselves.
    later: Vec<(String, Program)>,
}

fn run_block(terminal: &Terminal, block: &Block, fails: bool, web: &str, at: &str) {
    let commands = command_lines(&block.commands.replace("127.0.0.1:8080", web));
    let mut running =
        Running { staying: Scene::empty(terminal, web), unending: Vec::new(), later: Vec::new() };
    let mut printed = None;
    for (number, command) in commands.iter().enumerate() {
        let is_one_of = |starts: &[&str]| starts.iter().any(|start| command.starts_with(start));
        printed = None;
        if is_one_of(&STAYING) {
            if !command.starts_with("armor web") {
                running.staying.end();
            }
            running.staying.start(command, at);
        } else if command.starts_with("armor record") {
            record(terminal.start(command), terminal, &format!("{at}: {command}"));
        } else if is_unending(command) {
            running.unending.push((command.clone(), terminal.start(command)));
        } else if is_one_of(&LATER) {
            running.later.push((command.clone(), terminal.start(command)));
        } else {
            let is_last = number + 1 == commands.len();
            printed = Some(terminal.run(command, fails && is_last, at));
        }
    }
    if let Some(shown) = &block.shown {
        let printed = printed.unwrap_or_else(|| {
            panic!("{at}: only of a last command that ends by itself may the output be shown")
        });
        compare(terminal, commands.last().expect("a command"), printed, shown, at);
    }
    running.end(terminal, at);
}

impl Running<'_> {
    /// Ends all of them, each once it has done what the page promises.
    fn end(mut self, terminal: &Terminal, at: &str) {
        for (command, program) in self.unending {
            let at = format!("{at}: {command}");
            let words = words_of(&command);
            let file =
                words.iter().position(|word| word == ">").and_then(|sign| words.get(sign + 1));
            wait_for(&format!("{at} prints"), || {
                let has_printed = match file {
                    Some(file) => terminal.len_of(Path::new(file)) > 0,
                    None if QUIET.iter().any(|start| command.starts_with(start)) => {
                        program.waits_as("armor")
                    }
                    None => !program.output().is_empty(),
                };
                (has_printed || program.has_ended()).then_some(())
            });
            program.interrupt_reader(&at);
        }
        for (command, program) in self.later {
            program.wait_for_success(&format!("{at}: {command}"));
        }
        self.staying.end();
    }
}

/// Waits until a recorder has written messages, and ends it.
fn record(program: Program, terminal: &Terminal, at: &str) {
    wait_for(&format!("{at}: messages in the file"), || {
        let output = program.output();
        let file = output.split("recording into ").nth(1).and_then(|rest| rest.split(';').next());
        let has_messages =
            file.is_some_and(|file| terminal.len_of(Path::new(file)) > RECORDED_BYTES);
        (has_messages || program.has_ended()).then_some(())
    });
    program.interrupt(at);
}

fn is_unending(command: &str) -> bool {
    let words = words_of(command);
    let is_repeated = command.starts_with("armor data pub") && words.iter().any(|w| w == "--rate");
    is_repeated
        || UNENDING.iter().any(|(start, bounds)| {
            command.starts_with(start) && !words.iter().any(|word| bounds.contains(&word.as_str()))
        })
}

/// Compares the output with the page. A command that only reads may have run too early: it is
/// repeated, as a reader does.
fn compare(terminal: &Terminal, command: &str, printed: String, shown: &str, at: &str) {
    let start = Instant::now();
    let mut last = printed;
    while !matches(shown, &last) && start.elapsed() < REPEATED {
        last = terminal.try_run(command).1;
    }
    assert!(
        matches(shown, &last),
        "{at}: the page shows\n{shown}\nbut `{command}` printed\n{last}"
    );
}
