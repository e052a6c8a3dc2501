//! `armor-operator-view`: the operator's screen as a component, with the command line of any.

fn main() -> std::process::ExitCode {
    armor_operator_view::run()
}
