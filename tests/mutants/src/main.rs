//! The mutation study of `armor check --strict`: `cargo run -p armor-mutants -- --help`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::thread;

use anyhow::{Context, Result, bail};
use armor_mutants::{
    CheckVerdict, Example, Mutant, Outcome, StudiedMutant, TrialGround, TrialResult, check_text,
    check_with_program, collect_manifests, compare_meaning, format_table, generate_mutants,
    judge_findings, missions_folder,
};
use armor_robotfile::{Colours, Manifests};
use lexopt::prelude::*;

const HELP: &str = "\
Checks mutations of the example missions as `armor check --strict` does, and prints a table.

  armor-mutants                    the table by kind of mutation
  armor-mutants show NUMBER        a mutant with its findings
  armor-mutants list               the mutants that pass with another meaning
  armor-mutants run                runs some of those, and appends the results to --results

  --seed N              the mutants of this seed (1)
  --count N             how many (2000)
  --sample N            how many are run (100)
  --only N,N            run these
  --results FILE        the results of the runs, one JSON object per line
  --armor FILE          the program that runs them (target/debug/armor)
  --checked-by FILE     check with this program armor, such as an older one
  --scratch DIR         where files are written (a folder in the system's temporary folder)
";

/// Runs at a time.
const AT_ONCE: usize = 2;
/// The registry of the first one; the others follow.
const FIRST_PORT: u16 = 7620;

struct Options {
    command: Option<String>,
    number: Option<usize>,
    seed: u64,
    count: usize,
    sample: usize,
    only: Vec<usize>,
    results: Option<PathBuf>,
    armor: PathBuf,
    checked_by: Option<PathBuf>,
    scratch: PathBuf,
}

fn main() -> ExitCode {
    match read_options().and_then(|options| options.map_or(Ok(()), |it| carry_out(&it))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn read_options() -> Result<Option<Options>> {
    let mut options = Options {
        command: None,
        number: None,
        seed: 1,
        count: 2000,
        sample: 100,
        only: Vec::new(),
        results: None,
        armor: "target/debug/armor".into(),
        checked_by: None,
        scratch: std::env::temp_dir().join(format!("armor-mutants-{}", std::process::id())),
    };
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("help") | Short('h') => {
                print!("{HELP}");
                return Ok(None);
            }
            Long("seed") => options.seed = parser.value()?.parse()?,
            Long("count") => options.count = parser.value()?.parse()?,
            Long("sample") => options.sample = parser.value()?.parse()?,
            Long("only") => {
                let numbers = parser.value()?.string()?;
                options.only = numbers.split(',').map(str::parse).collect::<Result<_, _>>()?;
            }
            Long("results") => options.results = Some(parser.value()?.into()),
            Long("armor") => options.armor = parser.value()?.into(),
            Long("checked-by") => options.checked_by = Some(parser.value()?.into()),
            Long("scratch") => options.scratch = parser.value()?.into(),
            Value(word) if options.command.is_none() => options.command = Some(word.string()?),
            Value(word) => options.number = Some(word.parse()?),
            _ => bail!("{}; see --help", argument.unexpected()),
        }
    }
    Ok(Some(options))
}

fn carry_out(options: &Options) -> Result<()> {
    let examples = Example::read_all(&missions_folder())?;
    let mutants = generate_mutants(&examples, options.seed, options.count);
    let manifests = collect_manifests()?;
    match options.command.as_deref() {
        Some("show") => {
            let number = options.number.context("which mutant? show NUMBER")?;
            let mutant = mutants.get(number).with_context(|| format!("no mutant {number}"))?;
            let example = &examples[mutant.example];
            print!("{}", mutant.text);
            println!("\n{}: {}", example.file_name(), mutant.what);
            let findings = check_text(&example.path, &mutant.text, &manifests);
            print!("{}", findings.without_notes().render(Colours::No));
            compare_meaning(example, &mutant.text).iter().for_each(|it| println!("{it}"));
            return Ok(());
        }
        None | Some("run" | "list") => {}
        Some(other) => bail!("{other}: write nothing, show, list or run"),
    }
    let studied = study_mutants(options, &examples, &mutants, &manifests)?;
    match options.command.as_deref() {
        Some("run") => run_sample(options, &examples, &studied),
        Some(_) => {
            for one in studied.iter().filter(|it| has_other_meaning(it)) {
                let Mutant { number, example, what, .. } = one.mutant;
                let missing = one.result.as_ref().map(|it| it.missing.join("; "));
                let missing = missing.unwrap_or_else(|| "not run".into());
                println!("{number} {}: {what} [{missing}]", examples[*example].file_name());
            }
            Ok(())
        }
        None => {
            print!("{}", format_table(&studied));
            Ok(())
        }
    }
}

fn study_mutants<'a>(
    options: &Options,
    examples: &[Example],
    mutants: &'a [Mutant],
    manifests: &Manifests,
) -> Result<Vec<StudiedMutant<'a>>> {
    let results = read_results(options.results.as_deref())?;
    let folder = options.scratch.join("checked");
    if options.checked_by.is_some() {
        copy_missions(&folder)?;
    }
    let mut studied = Vec::new();
    for mutant in mutants {
        let example = &examples[mutant.example];
        let verdict = match &options.checked_by {
            Some(armor) => check_with_program(armor, &folder, example, &mutant.text)?,
            None => judge_findings(&check_text(&example.path, &mutant.text, manifests)),
        };
        let changes = match verdict {
            CheckVerdict::Passed => compare_meaning(example, &mutant.text),
            _ => Vec::new(),
        };
        let result = results.get(&mutant.number).cloned();
        studied.push(StudiedMutant { mutant, verdict, changes, result });
    }
    Ok(studied)
}

fn has_other_meaning(studied: &StudiedMutant<'_>) -> bool {
    studied.verdict == CheckVerdict::Passed && !studied.changes.is_empty()
}

fn read_results(file: Option<&Path>) -> Result<BTreeMap<usize, TrialResult>> {
    let Some(file) = file.filter(|it| it.exists()) else { return Ok(BTreeMap::new()) };
    let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let results = text.lines().filter_map(TrialResult::from_json);
    Ok(results.map(|result| (result.number, result)).collect())
}

fn copy_missions(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)?;
    for entry in fs::read_dir(missions_folder())? {
        let path = entry?.path();
        let to = folder.join(path.file_name().unwrap_or_default());
        if path.is_file() {
            fs::copy(&path, &to)?;
        } else if !to.exists() {
            std::os::unix::fs::symlink(path.canonicalize()?, &to)?;
        }
    }
    Ok(())
}

/// Runs a seeded sample, each meaning once, and first the examples themselves.
fn run_sample(
    options: &Options,
    examples: &[Example],
    studied: &[StudiedMutant<'_>],
) -> Result<()> {
    let file = options.results.as_deref().context("--results FILE is needed")?;
    let results = Mutex::new(open_results(file)?);
    let ground = TrialGround {
        armor: options.armor.clone(),
        missions: missions_folder(),
        scratch: options.scratch.clone(),
    };
    let mut random = fastrand::Rng::with_seed(options.seed);
    let mut candidates: Vec<_> = if options.only.is_empty() {
        studied.iter().filter(|it| has_other_meaning(it)).collect()
    } else {
        studied.iter().filter(|it| options.only.contains(&it.mutant.number)).collect()
    };
    random.shuffle(&mut candidates);
    let mut meanings = BTreeSet::new();
    candidates.retain(|it| meanings.insert((it.mutant.example, it.changes.clone())));
    candidates.truncate(options.sample);
    candidates.retain(|it| !options.only.is_empty() || it.result.is_none());
    candidates.reverse();
    println!("{} runs", candidates.len());
    let needed: BTreeSet<_> = candidates.iter().map(|it| it.mutant.example).collect();
    let originals = Mutex::new(needed.into_iter().collect::<Vec<_>>());
    let outcomes = Mutex::new(BTreeMap::<usize, Outcome>::new());
    run_in_parallel(&|port| {
        while let Some(example) = take_last(&originals) {
            let outcome = ground.run_text(&examples[example], &examples[example].text, port)?;
            println!("{}: {}", examples[example].file_name(), outcome.ending);
            if let Ok(mut outcomes) = outcomes.lock() {
                outcomes.insert(example, outcome);
            }
        }
        Ok(())
    })?;
    let outcomes = outcomes.into_inner().unwrap_or_default();
    let queue = Mutex::new(candidates);
    run_in_parallel(&|port| {
        while let Some(one) = take_last(&queue) {
            let Mutant { number, example, what, text, .. } = one.mutant;
            let outcome = ground.run_text(&examples[*example], text, port)?;
            let result = TrialResult::compare(*number, &outcomes[example], &outcome);
            let name = examples[*example].file_name();
            println!("{number} {name}: {what}: {}", result.missing.join("; "));
            if let Ok(mut results) = results.lock() {
                writeln!(results, "{}", result.to_json(&format!("{name}: {what}")))?;
            }
        }
        Ok(())
    })
}

fn open_results(file: &Path) -> Result<File> {
    let opened = OpenOptions::new().create(true).append(true).open(file);
    opened.with_context(|| file.display().to_string())
}

fn take_last<T>(queue: &Mutex<Vec<T>>) -> Option<T> {
    queue.lock().ok()?.pop()
}

fn run_in_parallel(work: &(dyn Fn(u16) -> Result<()> + Sync)) -> Result<()> {
    thread::scope(|scope| {
        let ports = (FIRST_PORT..).take(AT_ONCE);
        let threads: Vec<_> = ports.map(|port| scope.spawn(move || work(port))).collect();
        threads.into_iter().try_for_each(|thread| match thread.join() {
            Ok(result) => result,
            Err(_) => bail!("a run panicked"),
        })
    })
}
