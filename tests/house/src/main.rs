//! Prints the figures of docs/house.md: `cargo run -p armor-house`. With `circles`, `types` or
//! `functions` it prints what stands behind one of them.

use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_house::{
    CrateModules, circles_of, count_words, find_crates, measure_names, read_modules, workspace_root,
};

fn main() -> ExitCode {
    match run(std::env::args().nth(1).as_deref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(what: Option<&str>) -> Result<()> {
    let root = workspace_root().canonicalize()?;
    std::env::set_current_dir(&root)?;
    let mut all: Vec<(String, CrateModules)> = Vec::new();
    for sources in find_crates(std::path::Path::new("."))? {
        for file in &sources.roots {
            all.push((file.display().to_string(), read_modules(file)?));
        }
    }
    match what {
        None => print_table(&all),
        Some("circles") => {
            for circle in all.iter().flat_map(|(_, modules)| circles_of(modules)) {
                println!("{circle}");
            }
            Ok(())
        }
        Some("types") => {
            for shared in measure_names(all.iter().map(|(_, modules)| modules)).shared {
                let files: Vec<_> = shared.files.iter().map(|f| f.display().to_string()).collect();
                println!("{} {}: {}", shared.files.len(), shared.name, files.join(" "));
            }
            Ok(())
        }
        Some("functions") => {
            for (root, modules) in &all {
                let figures = measure_names([modules]);
                let (percent, mean) = (figures.one_word_percent(), figures.mean_length());
                println!("{percent:5.1} % of {:4}, {mean:4.1} letters: {root}", figures.functions);
            }
            Ok(())
        }
        Some(other) => bail!("{other}: write nothing, circles, types or functions"),
    }
}

fn print_table(all: &[(String, CrateModules)]) -> Result<()> {
    let figures = measure_names(all.iter().map(|(_, modules)| modules));
    let circles: Vec<_> = all.iter().flat_map(|(_, modules)| circles_of(modules)).collect();
    let largest = circles.iter().map(|circle| circle.files.len()).max().unwrap_or(1);
    let (words, comments) = count_words(std::path::Path::new("."))?;
    println!("| figure | value |");
    println!("| --- | ---: |");
    println!("| functions | {} |", figures.functions);
    println!("| one-word function names | {:.0} % |", figures.one_word_percent());
    println!("| mean length of a function's name | {:.1} letters |", figures.mean_length());
    println!("| types | {} |", figures.types);
    println!("| types that share their name | {:.0} % |", figures.shared_percent());
    println!("| circles of modules | {} |", circles.len());
    println!("| largest circle | {largest} modules |");
    println!("| lines of `//` comment | {comments:.1} % |");
    for count in words {
        println!("| lines with *{}* | {} |", count.word, count.lines);
    }
    Ok(())
}
