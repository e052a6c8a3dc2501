//! `armor check FILE`: the whole proof of a file, and all findings at once.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use armor_executive::{PLAYED, Plan};
use armor_missions::{Colours, Configuration, Finding, Override, Reading};

use crate::arguments::{self, Format};
use crate::exit::Ending;
use crate::kinds::Catalogue;
use crate::print;

/// A file with all that was found.
pub struct Checked {
    reading: Reading,
    /// The kinds it was checked against.
    pub catalogue: Catalogue,
}

/// Prints the findings; fails on errors.
///
/// # Errors
/// If the component directories cannot be read.
pub fn run(arguments: &arguments::Check, format: Format) -> Result<Ending> {
    let checked = load(&arguments.file, &arguments.overrides, &arguments.kinds)?;
    checked.print_problems(format);
    if checked.accepted().is_none() {
        return Ok(Ending::Failed);
    }
    if format != Format::Json {
        println!("{} is fine", arguments.file.display());
    }
    Ok(Ending::Fine)
}

/// Reads the file and checks it against every kind there is.
///
/// # Errors
/// If the component directories cannot be read. What is wrong with the file is in the findings.
pub fn load(file: &Path, sets: &[String], kinds: &arguments::Kinds) -> Result<Checked> {
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let mut reading = armor_missions::load(file);
    let (overrides, malformed) = overrides(sets, &folder);
    reading.findings.extend(malformed);
    let files = reading.files.clone();
    let catalogue = Catalogue::gather(&kinds.directories, files.iter().map(AsRef::as_ref))?;
    reading.findings.extend(catalogue.findings(reading.configuration.as_ref()));
    let mut reading = armor_missions::check(reading, &overrides, Some(&catalogue.manifests()));
    if let Some(configuration) = &reading.configuration {
        configuration.refuse_unplayed(PLAYED, &mut reading.findings);
    }
    // What only the executive can say of a mission, it says of one that is sound otherwise.
    if reading.is_valid()
        && let Some(Configuration { system, mission: Some(mission), .. }) = &reading.configuration
        && let Err(findings) = Plan::compile(system, mission)
    {
        reading.findings.extend(findings);
    }
    Ok(Checked { reading, catalogue })
}

/// The `--set` of a command line, and what is wrong with them.
pub fn overrides(sets: &[String], folder: &Path) -> (Vec<Override>, Vec<Finding>) {
    let mut overrides = Vec::new();
    let mut malformed = Vec::new();
    for set in sets {
        match Override::parse(set, folder) {
            Ok(set) => overrides.push(set),
            Err(finding) => malformed.push(*finding),
        }
    }
    (overrides, malformed)
}

impl Checked {
    /// The configuration, if it is free of errors.
    pub fn accepted(&self) -> Option<&Configuration> {
        self.reading.configuration.as_ref().filter(|_| self.reading.is_valid())
    }

    /// Prints what was found: for people on stderr, for programs as JSON Lines on stdout.
    pub fn print_problems(&self, format: Format) {
        let (mut out, mut err) = (std::io::stdout().lock(), std::io::stderr().lock());
        // Whoever closed the stream does not want to know.
        let _ = if format == Format::Json {
            self.reading.findings.iter().try_for_each(|finding| writeln!(out, "{}", json(finding)))
        } else {
            let colours = if print::coloured(&err) { Colours::Yes } else { Colours::No };
            write!(err, "{}", self.reading.findings.render(colours))
        };
    }
}

fn json(finding: &Finding) -> String {
    serde_json::to_string(finding).unwrap_or_else(|error| error.to_string())
}
