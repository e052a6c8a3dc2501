//! Texts that are made from the command line itself: `armor completions SHELL`, the completion script
//! of a shell, and `armor man [DIR]`, the manual pages of all commands.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::command_line::build_command;
use crate::print::{end_printing, print_line, print_text};
use crate::verb::Verb;

/// Print a completion script for a shell.
#[derive(Args, Debug)]
pub struct CompletionsArguments {
    /// The shell.
    pub shell: Shell,
}

impl Verb for CompletionsArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        // Internal commands are completed no more than they are listed.
        let whole = build_command();
        let listed = whole.get_subcommands().filter(|it| !it.is_hide_set()).cloned();
        let mut program =
            Command::new("armor").args(whole.get_arguments().cloned()).subcommands(listed);
        // Into memory first: the generator panics when stdout is closed.
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut program, "armor", &mut script);
        Ok(end_printing(print_text(String::from_utf8_lossy(&script)))?.into())
    }
}

/// Write the manual pages of all commands into a folder. Without DIR: print the page of `armor`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor man ~/.local/share/man/man1    then: man armor-data-pub
  armor man | man -l -                 the page of armor itself")]
pub struct ManArguments {
    /// The folder; it is made if it does not exist.
    dir: Option<PathBuf>,
}

impl Verb for ManArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let mut pages = list_pages();
        let printed = match &self.dir {
            None => {
                let page = pages.swap_remove(0);
                print_text(String::from_utf8_lossy(&page.render()?))
            }
            Some(dir) => {
                write_pages(dir, &pages)?;
                let (count, dir) = (pages.len(), dir.display().to_string());
                match format {
                    OutputFormat::Json => print_line(json!({"pages": count, "folder": dir})),
                    _ => print_line(format_args!("{count} manual pages are in {dir}")),
                }
            }
        };
        Ok(end_printing(printed)?.into())
    }
}

/// One page.
struct ManualPage {
    /// Its name without its section, such as `armor-data-list`.
    name: String,
    command: Command,
}

impl ManualPage {
    fn render(&self) -> Result<Vec<u8>> {
        // Into memory first, so that a closed pipe is noticed where it is written.
        let mut page = Vec::new();
        Man::new(self.command.clone()).title(self.name.to_uppercase()).render(&mut page)?;
        Ok(page)
    }
}

/// Returns the pages of all commands that are listed, that of `armor` first.
fn list_pages() -> Vec<ManualPage> {
    let mut whole = build_command().disable_help_subcommand(true);
    whole.build();
    let mut pages = Vec::new();
    push_pages(whole, "armor", &mut pages);
    pages
}

fn push_pages(command: Command, name: &str, pages: &mut Vec<ManualPage>) {
    let nested: Vec<_> =
        command.get_subcommands().filter(|it| !it.is_hide_set()).cloned().collect();
    pages.push(ManualPage { name: name.into(), command });
    for command in nested {
        let name = format!("{name}-{}", command.get_name());
        push_pages(command, &name, pages);
    }
}

fn write_pages(dir: &Path, pages: &[ManualPage]) -> Result<()> {
    std::fs::create_dir_all(dir)
        .with_context(|| format!("the folder {} cannot be made", dir.display()))?;
    for page in pages {
        let path = dir.join(format!("{}.1", page.name));
        std::fs::write(&path, page.render()?)
            .with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_command_has_a_page_with_its_exit_codes() {
        let pages = list_pages();
        assert_eq!(pages[0].name, "armor");
        let page = |name: &str| {
            let page = pages.iter().find(|page| page.name == name).expect(name);
            String::from_utf8(page.render().expect("it is rendered")).expect("text")
        };
        for (name, part) in [
            ("armor-data-pub", "linear.x=0.3"),
            ("armor-top", "interval"),
            ("armor-mission-fire", "transition"),
        ] {
            let text = page(name);
            assert!(text.contains(".TH ARMOR") || text.contains(".TH \"ARMOR"), "{text}");
            for part in [part, "Exit codes", "SYNOPSIS"] {
                assert!(text.contains(part), "{name}: {part}: {text}");
            }
        }
        let hidden = ["armor-guard", "armor-group-killer", "armor-help"];
        assert!(pages.iter().all(|page| !hidden.contains(&page.name.as_str())));
    }
}
