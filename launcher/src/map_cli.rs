//! `armor map`: converts plans between the formats of planners, draws them into mission files and
//! back, fits maps to the world, draws map symbols, and describes the pictures that lie under a map.

#[cfg(test)]
mod command_tests;
mod drawing;
mod drawn_plan;
#[cfg(test)]
#[expect(clippy::print_stdout, clippy::print_stderr, reason = "figures, and what is skipped")]
mod exchange_tests;
mod export;
mod fit;
mod import;
mod insertion;
#[cfg(test)]
mod limit_tests;
mod marks;
mod plan_file;
mod planning;
mod play_order;
mod route_steps;
mod route_writing;
mod text_difference;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use armor_exchange::write_plan;
use armor_symbols::Symbol;
use clap::Subcommand;
use serde_json::{Value, json};

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::map_picture::print_picture;
use crate::print::{end_printing, print_line, print_notice};
use crate::verb::Verb;
use export::ExportArguments;
use fit::FitArguments;
use import::ImportArguments;
use plan_file::{format_of, load_plan, print_notes};

/// Convert plans of other planners, import them into mission files and export them from these, fit
/// maps to the world, draw map symbols, and describe pictures of maps.
#[derive(Debug, Subcommand)]
pub enum MapCommand {
    /// Write a plan in the format of the other file's name: .plan, .waypoints, .gpx, .geojson or
    /// .kml. What has no counterpart is named on stderr.
    Convert {
        /// The file that is read.
        from: PathBuf,
        /// The file that is written.
        to: PathBuf,
    },
    /// Print what a picture for a map is, and where it lies: its kind, reference, extent and levels.
    Info {
        /// A PNG or JPEG with a world file, a GeoTIFF, PMTiles, MBTiles, the YAML of a grid map, an
        /// SVG world or GeoJSON.
        picture: PathBuf,
    },
    Import(Box<ImportArguments>),
    Export(ExportArguments),
    Fit(FitArguments),
    /// Print what the code of a symbol means.
    Symbol {
        /// 20 digits of APP-6(D), or the older 15 letters.
        code: String,
        /// Write its drawing, as SVG.
        #[arg(long, value_name = "FILE.svg")]
        out: Option<PathBuf>,
    },
}

impl Verb for MapCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let ending = match self {
            Self::Convert { from, to } => convert_plan(&from, &to)?,
            Self::Info { picture } => print_picture(&picture, format)?,
            Self::Import(arguments) => import::import_plan(&arguments, format)?,
            Self::Export(arguments) => export::export_plan(&arguments, format)?,
            Self::Fit(arguments) => fit::print_fit(&arguments, format)?,
            Self::Symbol { code, out } => print_symbol(&code, out.as_deref(), format)?,
        };
        Ok(ending.into())
    }
}

/// Reads one file and writes the other.
///
/// # Errors
/// If a file cannot be read or written, or the other format has no place for the plan.
fn convert_plan(from: &Path, to: &Path) -> Result<CommandEnding> {
    let target = format_of(to)?;
    let plan = load_plan(from)?;
    let (text, lost) = write_plan(&plan, target).with_context(|| to.display().to_string())?;
    std::fs::write(to, text).with_context(|| format!("cannot write {}", to.display()))?;
    print_notes(from, &plan.notes);
    print_notes(to, &lost);
    Ok(CommandEnding::Fine)
}

/// Prints the meaning of a symbol's code, and writes its drawing.
///
/// # Errors
/// If the code cannot be read or the file not be written.
fn print_symbol(code: &str, out: Option<&Path>, format: OutputFormat) -> Result<CommandEnding> {
    let symbol = Symbol::parse(code)?;
    if let Some(out) = out {
        std::fs::write(out, symbol.to_svg())
            .with_context(|| format!("cannot write {}", out.display()))?;
    }
    let findings: Vec<String> = symbol.findings().iter().map(ToString::to_string).collect();
    end_printing(match format {
        OutputFormat::Json => print_line(describe_as_json(&symbol, &findings)),
        _ => print_line(describe_symbol(&symbol)),
    })?;
    if format != OutputFormat::Json {
        findings.iter().for_each(print_notice);
    }
    Ok(CommandEnding::Fine)
}

/// `10031000141211000000: Infantry, friend, land unit, platoon or detachment`.
fn describe_symbol(symbol: &Symbol) -> String {
    let mut parts = vec![
        symbol.name().to_owned(),
        plain_name(&symbol.code.identity),
        plain_name(&symbol.code.set),
        plain_name(&symbol.code.status),
    ];
    parts.extend(symbol.code.amplifier_name().map(str::to_owned));
    let headquarters = symbol.code.headquarters;
    for (is_so, name) in [
        (headquarters.is_headquarters(), "headquarters"),
        (headquarters.is_task_force(), "task force"),
        (headquarters.is_dummy(), "feint or dummy"),
    ] {
        parts.extend(is_so.then(|| name.to_owned()));
    }
    format!("{}: {}", symbol.code, parts.join(", "))
}

fn describe_as_json(symbol: &Symbol, findings: &[String]) -> Value {
    let code = &symbol.code;
    json!({
        "code": code.to_string(),
        "name": symbol.name(),
        "identity": plain_name(&code.identity),
        "set": plain_name(&code.set),
        "status": plain_name(&code.status),
        "context": plain_name(&code.context),
        "amplifier": code.amplifier_name(),
        "headquarters": code.headquarters.is_headquarters(),
        "task_force": code.headquarters.is_task_force(),
        "dummy": code.headquarters.is_dummy(),
        "findings": findings,
    })
}

/// The name of a value in words: `AssumedFriend` is `assumed friend`.
fn plain_name<T: std::fmt::Debug>(value: &T) -> String {
    let mut words = String::new();
    for letter in format!("{value:?}").chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_is_described_in_words() {
        let describe = |code| describe_symbol(&Symbol::parse(code).expect(code));
        assert_eq!(
            describe("SAGAUCI---AD---"),
            "10021012141211000000: Infantry, assumed friend, land unit, planned, platoon or detachment, headquarters"
        );
        let unknown = Symbol::parse("10031000009999990000").expect("its shape is valid");
        let value = describe_as_json(&unknown, &["x".into()]);
        assert_eq!((&value["name"], &value["findings"][0]), (&json!("Unknown"), &json!("x")));
    }

    #[test]
    fn a_plan_is_converted_by_the_ends_of_the_names() {
        let folder = tempfile::tempdir().expect("a folder");
        let [list, gpx, other] =
            ["a.waypoints", "a.gpx", "a.xml"].map(|name| folder.path().join(name));
        let text = "QGC WPL 110\n1\t0\t0\t16\t0\t0\t0\t0\t48.2\t11.6\t30\t1\n";
        std::fs::write(&list, text).expect("it is written");
        assert_eq!(convert_plan(&list, &gpx).expect("it is converted"), CommandEnding::Fine);
        let written = std::fs::read_to_string(&gpx).expect("it was written");
        assert!(written.contains("<rtept lat=\"48.2\" lon=\"11.6\"><ele>30</ele>"), "{written}");
        let error = convert_plan(&list, &other).expect_err("no format").to_string();
        assert!(error.contains(".plan, .waypoints, .gpx"), "{error}");
    }
}
