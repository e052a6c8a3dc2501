//! `armor-foxglove`: the live view for Foxglove as a component, with the command line of any.

fn main() -> std::process::ExitCode {
    armor_foxglove::run()
}
