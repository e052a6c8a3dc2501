//! `armor guard PARENT -- PROGRAM …`: becomes PROGRAM, in a process group of its own, and is killed
//! by the kernel when the thread that started it ends. So nothing outlives a killed launcher, not
//! even an executable that knows nothing of Armor.

use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
use clap::Args;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal, setpgid};

use crate::arguments::OutputFormat;
use crate::run::process::OWN_PROGRAM;
use crate::verb::Verb;

/// Run a program that does not outlive its parent.
#[derive(Args, Debug)]
pub struct GuardArguments {
    /// Process id of the parent that must be alive.
    pub parent: i32,
    /// The program and its arguments.
    #[arg(last = true, required = true)]
    pub program: Vec<OsString>,
}

impl Verb for GuardArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        become_program(&self)
    }
}

/// Becomes the program. Returns only if that is not possible.
fn become_program(guard: &GuardArguments) -> Result<ExitCode> {
    set_parent_process_death_signal(Some(Signal::KILL)).context("asking for the death signal")?;
    // The parent may have died before the signal was asked for; then it never comes.
    if getppid() != Pid::from_raw(guard.parent) {
        bail!("process {}, which started this one, has ended", guard.parent);
    }
    setpgid(None, None).context("making a process group")?;
    let (program, arguments) =
        guard.program.split_first().context("no program is given after `--`")?;
    let mut command = Command::new(program);
    if program == OWN_PROGRAM
        && let Some(own) = std::env::args_os().next()
    {
        command.arg0(own);
    }
    let error = command.args(arguments).exec();
    Err(error).with_context(|| format!("{} cannot be started", program.to_string_lossy()))
}

/// Returns the arguments that start `program` under the guard of process `parent`.
pub fn list_arguments<'a>(
    parent: u32,
    program: &'a OsString,
    arguments: &'a [OsString],
) -> impl Iterator<Item = OsString> + 'a {
    ["guard".into(), parent.to_string().into(), "--".into(), program.clone()]
        .into_iter()
        .chain(arguments.iter().cloned())
}
