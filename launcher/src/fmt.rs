//! `armor fmt FILE...`: formats files. Content and comments stay.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_robotfile::{Code, Colours, Finding, Findings, MAX_FILE_BYTES};
use clap::Args;
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::check::STDIN;
use crate::exit::CommandEnding;
use crate::print;
use crate::print::StdoutClosed;
use crate::verb::Verb;

/// Format files: indentation, spaces, blank lines. The content does not change.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor fmt robot.xml
  armor fmt --check missions/*.xml    change nothing, fail if a file would change
  armor fmt - < robot.xml             from stdin to stdout")]
pub struct FmtArguments {
    /// The files; - is stdin, written to stdout.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Change nothing; print the files that would change, and exit with code 1 if there are any.
    #[arg(long)]
    pub check: bool,
}

impl Verb for FmtArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(format_files(&self, format)?.into())
    }
}

/// Formats the files in place, or stdin to stdout; with `--check` only names those that would
/// change. Continues with the next file after one that cannot be formatted.
///
/// # Errors
/// If stdout cannot be written, or stdin is formatted among other files.
fn format_files(arguments: &FmtArguments, format: OutputFormat) -> Result<CommandEnding> {
    let (mut out, mut err) = (io::stdout().lock(), io::stderr().lock());
    let colours = if print::wants_colours(&err) { Colours::Yes } else { Colours::No };
    let stdin = &mut io::stdin().lock();
    let mut formatter = Formatter { stdin, out: &mut out, err: &mut err, format, colours };
    let done = formatter.all(&arguments.files, arguments.check);
    // Files are read and saved with findings of their own: only a stream can be a broken pipe here.
    done.map_err(|error| match error.downcast_ref::<io::Error>() {
        Some(io) if io.kind() == io::ErrorKind::BrokenPipe => StdoutClosed.into(),
        _ => error,
    })
}

struct Formatter<'a> {
    stdin: &'a mut dyn Read,
    out: &'a mut dyn Write,
    err: &'a mut dyn Write,
    format: OutputFormat,
    colours: Colours,
}

impl Formatter<'_> {
    fn all(&mut self, files: &[PathBuf], check: bool) -> Result<CommandEnding> {
        let stdin = files.iter().filter(|file| file.as_os_str() == STDIN).count();
        if stdin > 1 || (stdin == 1 && files.len() > 1 && !check) {
            bail!("- (stdin) must be the only file: stdout takes one");
        }
        let mut ending = CommandEnding::Fine;
        for file in files {
            match self.formatted(file) {
                Err(findings) => {
                    self.print(&findings)?;
                    ending = CommandEnding::Failed;
                }
                Ok((_, new)) if file.as_os_str() == STDIN && !check => self.out.write_all(&new)?,
                Ok((old, new)) if old == new => {}
                Ok(_) if check => {
                    self.print_result(file, "would change")?;
                    ending = CommandEnding::Failed;
                }
                Ok((_, new)) => match armor_files::save_atomically(file, &new) {
                    Ok(()) => self.print_result(file, "formatted")?,
                    Err(error) => {
                        writeln!(self.err, "error: {error}")?;
                        ending = CommandEnding::Failed;
                    }
                },
            }
        }
        Ok(ending)
    }

    /// The bytes of a file before and after.
    fn formatted(&mut self, file: &Path) -> Result<(Vec<u8>, Vec<u8>), Findings> {
        let (name, read) = if file.as_os_str() == STDIN {
            let mut bytes = Vec::new();
            let limit = MAX_FILE_BYTES as u64 + 1;
            let read = self.stdin.take(limit).read_to_end(&mut bytes).map(|_| bytes);
            (Path::new("<stdin>"), read)
        } else {
            (file, armor_robotfile::read_bytes(file))
        };
        let old = read.map_err(|error| {
            let message = format!("{} cannot be read: {error}", name.display());
            let finding = Finding::of_file(Code::Unreadable, name, message);
            let mut findings = Findings::default();
            findings.push(finding.remedy("check the path and its permissions"));
            findings
        })?;
        let new = armor_robotfile::format(name, &old)?;
        Ok((old, new))
    }

    /// What became of a file: for people its name, for programs an object.
    fn print_result(&mut self, file: &Path, what: &str) -> Result<()> {
        if self.format == OutputFormat::Json {
            let line = json!({"file": file.to_string_lossy(), "result": what});
            writeln!(self.out, "{line}")?;
        } else {
            writeln!(self.out, "{} {what}", file.display())?;
        }
        Ok(())
    }

    fn print(&mut self, findings: &Findings) -> Result<()> {
        if self.format == OutputFormat::Json {
            for finding in findings {
                writeln!(self.out, "{}", serde_json::to_string(finding)?)?;
            }
        } else {
            write!(self.err, "{}", findings.render(self.colours))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;

    const UGLY: &str = "<armor version='1'><!-- c --><system/></armor>";
    const FINE: &str = "<armor version='1'> <!-- c -->\n  <system/>\n</armor>\n";

    /// Formats files, `stdin` being the content of stdin; returns the ending, stdout and stderr.
    fn fmt(files: &[&Path], check: bool, stdin: &str) -> (Result<CommandEnding>, String, String) {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let files: Vec<_> = files.iter().map(|file| file.to_path_buf()).collect();
        let ending = Formatter {
            stdin: &mut stdin.as_bytes(),
            out: &mut out,
            err: &mut err,
            format: OutputFormat::Text,
            colours: Colours::No,
        }
        .all(&files, check);
        let text = |bytes| String::from_utf8(bytes).expect("text");
        (ending, text(out), text(err))
    }

    #[test]
    fn files_are_formatted_once_and_checked_without_being_touched() {
        let scratch = ScratchFolder::new("fmt");
        let (ugly, fine) = (scratch.path().join("ugly.xml"), scratch.path().join("fine.xml"));
        std::fs::write(&ugly, UGLY).expect("written");
        std::fs::write(&fine, FINE).expect("written");
        let read = |path| std::fs::read_to_string(path).expect("it exists");

        let (ending, out, _) = fmt(&[&ugly, &fine], true, "");
        assert_eq!(ending.expect("checked"), CommandEnding::Failed);
        assert_eq!(out, format!("{} would change\n", ugly.display()));
        assert_eq!(read(&ugly), UGLY);

        let (ending, out, _) = fmt(&[&ugly, &fine], false, "");
        assert_eq!(ending.expect("formatted"), CommandEnding::Fine);
        assert_eq!(out, format!("{} formatted\n", ugly.display()));
        assert_eq!(read(&ugly), FINE);

        let (ending, out, err) = fmt(&[&ugly, &fine], true, "");
        assert_eq!(
            (ending.expect("checked"), out, err),
            (CommandEnding::Fine, String::new(), String::new())
        );
    }

    #[test]
    fn stdin_goes_to_stdout() {
        let (ending, out, _) = fmt(&[Path::new(STDIN)], false, UGLY);
        assert_eq!((ending.expect("formatted"), out.as_str()), (CommandEnding::Fine, FINE));
        let (ending, out, _) = fmt(&[Path::new(STDIN)], true, UGLY);
        assert_eq!(
            (ending.expect("checked"), out.as_str()),
            (CommandEnding::Failed, "- would change\n")
        );
        let (ending, ..) = fmt(&[Path::new(STDIN), Path::new("a.xml")], false, UGLY);
        assert!(ending.is_err());
    }

    #[test]
    fn what_is_no_xml_stays_and_the_others_are_formatted() {
        let scratch = ScratchFolder::new("fmt-bad");
        let (bad, ugly) = (scratch.path().join("bad.xml"), scratch.path().join("ugly.xml"));
        std::fs::write(&bad, "<armor>").expect("written");
        std::fs::write(&ugly, UGLY).expect("written");
        let (ending, _, err) = fmt(&[&bad, &scratch.path().join("gone.xml"), &ugly], false, "");
        assert_eq!(ending.expect("formatted"), CommandEnding::Failed);
        assert!(err.contains("bad.xml:1:2") && err.contains("E0012"), "{err}");
        assert!(err.contains("gone.xml cannot be read"), "{err}");
        assert_eq!(std::fs::read_to_string(&bad).expect("it exists"), "<armor>");
        assert_eq!(std::fs::read_to_string(&ugly).expect("it exists"), FINE);
    }
}
