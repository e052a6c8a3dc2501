//! The command line: the list of all commands, in the order of `armor --help`. A command's
//! arguments, help and code are in the file of its type; a new command is that file, its `mod` line,
//! and its import and its entry here.

use std::process::ExitCode;

use anyhow::Result;
use clap::{Command, CommandFactory, Parser, Subcommand};

use crate::arguments::OutputFormat;
use crate::check::CheckArguments;
use crate::command_texts::{CompletionsArguments, ManArguments};
use crate::component_cli::ComponentArguments;
use crate::component_orders::{LogArguments, RestartArguments, StopArguments, WatchArguments};
use crate::connect_cli::ConnectArguments;
use crate::daemon::configd::ConfigdArguments;
use crate::daemon::executive::ExecutiveArguments;
use crate::daemon::gate::GateArguments;
use crate::daemon::player::PlayerArguments;
use crate::daemon::registry::RegistryArguments;
use crate::doctor::DoctorArguments;
use crate::evaluate_cli::EvalArguments;
use crate::exit_codes::add_exit_codes;
use crate::explain::ExplainArguments;
use crate::fmt::FmtArguments;
use crate::guard::GuardArguments;
use crate::host_agent::HostArguments;
use crate::inspect_cli::bw::BwArguments;
use crate::inspect_cli::data::DataCommand;
use crate::inspect_cli::delay::DelayArguments;
use crate::inspect_cli::describe::DescribeArguments;
use crate::inspect_cli::echo::EchoArguments;
use crate::inspect_cli::graph::GraphArguments;
use crate::inspect_cli::hz::HzArguments;
use crate::inspect_cli::mission::arguments::MissionCommand;
use crate::inspect_cli::ps::PsArguments;
use crate::keys_cli::KeysCommand;
use crate::logs_cli::LogsArguments;
use crate::map_cli::MapCommand;
use crate::message_cli::MessageCommand;
use crate::new::NewArguments;
use crate::new::sdk::SdkArguments;
use crate::param::arguments::ParamCommand;
use crate::petri_cli::arguments::NetCommand;
use crate::playback_cli::arguments::PlayArguments;
use crate::playback_cli::orders::PlaybackCommand;
use crate::plot_cli::PlotArguments;
use crate::recording_cli::bag::BagCommand;
use crate::recording_cli::record::RecordArguments;
use crate::run::arguments::RunArguments;
use crate::run::group_killer::GroupKillerArguments;
use crate::top::TopArguments;
use crate::trace_cli::TraceArguments;
use crate::verb::Verb;
use crate::web_cli::WebArguments;

/// Robots from components: independent processes, direct links, and a mission that activates and
/// freezes them.
#[derive(Debug, Parser)]
#[command(name = "armor", version, propagate_version = true)]
pub struct CommandLine {
    /// What is printed: text for people, or JSON Lines on stdout for programs.
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORMAT")]
    pub format: OutputFormat,
    /// What to do.
    #[command(subcommand)]
    pub command: ArmorCommand,
}

/// Returns the parser of the command line, with the exit codes in the help of each command.
pub fn build_command() -> Command {
    add_exit_codes(CommandLine::command())
}

/// Declares the commands and carries out the chosen one.
macro_rules! commands {
    ($($(#[$attribute:meta])* $name:ident($arguments:ty),)*) => {
        /// A command and its arguments.
        #[derive(Debug, Subcommand)]
        pub enum ArmorCommand {
            $($(#[$attribute])* $name($arguments),)*
        }

        impl ArmorCommand {
            /// Carries out the command, and returns the exit code.
            ///
            /// # Errors
            /// If the command fails.
            pub fn run_command(self, format: OutputFormat) -> Result<ExitCode> {
                match self {
                    $(Self::$name(arguments) => arguments.run_verb(format),)*
                }
            }
        }
    };
}

commands! {
    Run(RunArguments),
    Check(CheckArguments),
    Explain(ExplainArguments),
    Fmt(FmtArguments),
    Doctor(DoctorArguments),
    Ps(PsArguments),
    Top(TopArguments),
    #[command(subcommand)] Data(DataCommand),
    Describe(DescribeArguments),
    #[command(subcommand)] Message(MessageCommand),
    Graph(GraphArguments),
    Echo(EchoArguments),
    Hz(HzArguments),
    Bw(BwArguments),
    Delay(DelayArguments),
    Plot(PlotArguments),
    Trace(TraceArguments),
    Watch(WatchArguments),
    Restart(RestartArguments),
    Stop(StopArguments),
    Logs(LogsArguments),
    Log(LogArguments),
    #[command(subcommand)] Mission(MissionCommand),
    Record(RecordArguments),
    Play(PlayArguments),
    #[command(subcommand)] Playback(PlaybackCommand),
    #[command(subcommand)] Bag(BagCommand),
    Eval(EvalArguments),
    #[command(subcommand)] Net(NetCommand),
    #[command(subcommand)] Map(MapCommand),
    #[command(subcommand)] Param(ParamCommand),
    Web(WebArguments),
    Connect(ConnectArguments),
    #[command(subcommand)] Keys(KeysCommand),
    New(NewArguments),
    Sdk(SdkArguments),
    Completions(CompletionsArguments),
    Man(ManArguments),
    Registry(RegistryArguments),
    Configd(ConfigdArguments),
    Executive(ExecutiveArguments),
    Gate(GateArguments),
    Host(HostArguments),
    Component(ComponentArguments),
    #[command(hide = true)] Player(PlayerArguments),
    #[command(hide = true)] Guard(GuardArguments),
    #[command(hide = true)] GroupKiller(GroupKillerArguments),
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use clap::{Command, CommandFactory};

    use super::CommandLine;

    const BEGIN: &str = "<!-- begin commands -->\n";
    const END: &str = "<!-- end commands -->\n";

    /// Returns a row for each command that `armor --help` lists.
    fn command_table() -> String {
        let mut table = String::from("| command | |\n| --- | --- |\n");
        for command in CommandLine::command().get_subcommands().filter(|it| !it.is_hide_set()) {
            let about = command.get_about().map(ToString::to_string).unwrap_or_default();
            let below: Vec<_> = command.get_subcommands().map(Command::get_name).collect();
            let below =
                if below.is_empty() { String::new() } else { format!(" {}", below.join("\\|")) };
            let _ = writeln!(table, "| `{}{below}` | {about} |", command.get_name());
        }
        table
    }

    #[test]
    fn the_documentation_lists_every_command() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/command-line.md");
        let page = std::fs::read_to_string(&path).unwrap();
        let (before, rest) = page.split_once(BEGIN).unwrap();
        let (_, after) = rest.split_once(END).unwrap();
        let expected = format!("{before}{BEGIN}{}{END}{after}", command_table());
        if std::env::var_os("ARMOR_BLESS").is_some() {
            std::fs::write(&path, &expected).unwrap();
        } else {
            assert!(page == expected, "docs/command-line.md: run with ARMOR_BLESS=1");
        }
    }
}
