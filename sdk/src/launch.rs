//! From the command line to a running component, and to its end.

use std::collections::HashMap;
use std::ffi::OsString;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::random_id;
use armor_wire::config::{ComponentSettings, InputSettings};
use armor_wire::keep::{Keep, Wake};
use armor_wire::manifest::{Manifest, ManifestFaults};
use armor_wire::name;
use armor_wire::quantity;
use armor_wire::registry::DEFAULT_PORT;
use armor_wire::transport::Transport;
use lexopt::prelude::{Long, ValueExt};

use crate::armor::Armor;
use crate::background_thread::spawn_background;
use crate::call::Fault;
use crate::calls::CalledFunction;
use crate::component::Component;
use crate::configuration;
use crate::describe::{PanickedConstructor, catch_panic, construct, describe_kind};
use crate::following;
use crate::identity::ProcessIdentity;
use crate::kind_declaration::{KindDeclaration, ThreadScope};
use crate::link::input_reader::InputReader;
use crate::log;
use crate::node;
use crate::participant::Participant;
use crate::runtime::Runtime;
use crate::stdout_aside::run_with_stdout_aside;
use crate::thread_panics::report_thread_panics;
use crate::user_code::UserCode;

/// How long the registry and configd may take at the start.
const START_LIMIT: Duration = Duration::from_secs(20);
/// How long the last data and reports may take to leave at the end.
const LEAVE_LIMIT: Duration = Duration::from_millis(500);
/// Time between two looks at whether they have.
const LEAVE_PERIOD: Duration = Duration::from_millis(5);
/// Where the registry is, unless the command line specifies it.
const REGISTRY_VARIABLE: &str = "ARMOR_REGISTRY";
/// Exit codes of a process that has ended in order, of one that could not begin its work, and of one
/// whose command line is wrong.
const SUCCEEDED: u8 = 0;
const FAILED: u8 = 1;
const MISUSED: u8 = 2;
/// Exit code after a panic in the component's code, as Rust's own.
const PANICKED: u8 = 101;

#[derive(Default)]
struct ComponentOptions {
    describe: bool,
    name: String,
    registry: String,
    alone: bool,
    rate_hz: Option<f64>,
    links: Vec<InputSettings>,
    clock: Option<String>,
    set: HashMap<String, String>,
}

const USAGE: &str = "\
usage: [--describe] [--name NAME] [--registry HOST:PORT]
  --describe              print the manifest as JSON and exit
  --name NAME             name in the system (default: the kind)
  --registry HOST:PORT    the registry (default: $ARMOR_REGISTRY, else 127.0.0.1:7411)
on another host than the system, through ssh -D 1080 -R PORT:127.0.0.1:PORT:
  ARMOR_VIA=127.0.0.1:1080  reach the system through this SOCKS5 proxy
  ARMOR_PORT=PORT           listen on this port, so that the others reach this one
without configd, for trying a component by hand:
  --alone                 ask no configd
  --rate 10Hz             rate at which exec is called
  --link INPUT=DATA[,keep=all][,patience=1s][,wake=spin][,transport=tcp]
  --clock COMPONENT.OUTPUT  time follows this data
  --set PARAMETER=VALUE";

/// Runs a component as this process, by its command line. `main` returns the result: the exit code
/// of the process.
#[must_use = "return it from `main`: fn main() -> std::process::ExitCode { armor_sdk::run::<…>() }"]
pub fn run<C: Component>() -> ExitCode {
    run_with::<C>(std::env::args_os().skip(1))
}

/// As [`run`], with the arguments after the program's name.
pub fn run_with<C: Component>(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    ExitCode::from(run_kind(&KindDeclaration::of::<C>(), construct::<C>, arguments))
}

/// As [`run_with`], for a kind that is declared while it runs. Returns the exit code of the process.
pub(crate) fn run_kind(
    kind: &KindDeclaration,
    constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
    arguments: impl IntoIterator<Item = OsString>,
) -> u8 {
    let options = match parse_arguments(&kind.kind, arguments) {
        Ok(Some(options)) => options,
        Ok(None) => {
            // A closed stream is no error: the reader has seen enough.
            let _ = writeln!(std::io::stdout(), "{}: {}\n{USAGE}", kind.kind, kind.summary);
            return SUCCEEDED;
        }
        Err(error) => {
            eprintln!("{error}\n{USAGE}");
            return MISUSED;
        }
    };
    if options.describe {
        return print_manifest(kind, constructor);
    }
    log::init();
    match run_component(kind, constructor, &options) {
        Ok(code) => code,
        Err(fault) => {
            tracing::error!("{fault}");
            FAILED
        }
    }
}

fn print_manifest(
    kind: &KindDeclaration,
    constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
) -> u8 {
    let name = &kind.kind;
    let manifest = describe_aside(kind, constructor);
    let manifest = manifest.and_then(|m| Ok(serde_json::to_string_pretty(&m)?));
    match manifest.and_then(|text| Ok(writeln!(std::io::stdout(), "{text}")?)) {
        Ok(()) => SUCCEEDED,
        Err(fault) if fault.is::<PanickedConstructor>() => {
            eprintln!("{name}: {fault}");
            PANICKED
        }
        Err(fault) => {
            if let Some(ManifestFaults(faults)) = fault.downcast_ref()
                && let [_, _, ..] = faults.as_slice()
            {
                faults.iter().for_each(|fault| eprintln!("  {fault}"));
                let (count, first) = (faults.len(), &faults[0]);
                eprintln!("{name}: {count} faults, the first: {first}");
            } else {
                eprintln!("{name}: {fault}");
            }
            FAILED
        }
    }
}

/// Returns the manifest of a constructor that prints nothing on stdout.
fn describe_aside(
    kind: &KindDeclaration,
    constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
) -> Result<Manifest, Fault> {
    let describe = || catch_panic(|| describe_kind(kind, constructor));
    let (manifest, printed) = run_with_stdout_aside(describe)?;
    let manifest = manifest??;
    match printed.lines().find(|line| !line.trim().is_empty()) {
        None => Ok(manifest),
        Some(line) => Err(format!(
            "the constructor prints on stdout, where only the manifest may be: {line:?}; print on \
             stderr (eprintln!), or log with tracing"
        )
        .into()),
    }
}

fn parse_arguments(
    kind: &str,
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<Option<ComponentOptions>, lexopt::Error> {
    let variable = std::env::var(REGISTRY_VARIABLE).ok().filter(|registry| !registry.is_empty());
    let mut registry_source = REGISTRY_VARIABLE;
    let registry = variable.unwrap_or_else(|| format!("127.0.0.1:{DEFAULT_PORT}"));
    let mut options =
        ComponentOptions { name: kind.into(), registry, ..ComponentOptions::default() };
    let mut parser = lexopt::Parser::from_args(arguments);
    while let Some(argument) = parser.next()? {
        match argument {
            Long("help") => return Ok(None),
            Long("describe") => options.describe = true,
            Long("alone") => options.alone = true,
            Long("name") => options.name = parser.value()?.parse()?,
            Long("registry") => {
                options.registry = parser.value()?.parse()?;
                registry_source = "--registry";
            }
            Long("rate") => {
                let rate = parser.value()?.parse_with(quantity::hertz)?;
                options.rate_hz = Some(rate);
            }
            Long("clock") => options.clock = Some(parser.value()?.parse()?),
            Long("link") => options.links.push(parser.value()?.parse_with(parse_link)?),
            Long("set") => {
                let text: String = parser.value()?.parse()?;
                let (name, value) = text.split_once('=').ok_or("--set takes PARAMETER=VALUE")?;
                options.set.insert(name.into(), value.into());
            }
            other => return Err(other.unexpected()),
        }
    }
    // The name that counts is in the manifest, which is checked as a whole.
    if options.describe {
        return Ok(Some(options));
    }
    if !is_host_port(&options.registry) {
        let given = format!("{registry_source} {}", options.registry);
        return Err(format!("{given}: an address is HOST:PORT, such as localhost:7411").into());
    }
    if !name::is_name(kind) {
        let why = format!("KIND is `{kind}`, which is not a name; use letters, digits, _ and -");
        return Err(why.into());
    }
    if !name::is_name(&options.name) {
        return Err(
            format!("`{}` is not a name; use letters, digits, _ and -", options.name).into()
        );
    }
    Ok(Some(options))
}

/// Whether a text is an address. Port 0 of another host of the system is that of its registry.
fn is_host_port(text: &str) -> bool {
    let Some((host, port)) = text.rsplit_once(':') else { return false };
    let is_bracketed = host.starts_with('[') && host.ends_with(']');
    let is_wrong = |c: char| c.is_whitespace() || c == '/' || (c == ':' && !is_bracketed);
    !host.is_empty() && !host.contains(is_wrong) && port.parse::<u16>().is_ok()
}

fn parse_link(text: &str) -> Result<InputSettings, String> {
    let mut parts = text.split(',');
    let (id, data) = parts
        .next()
        .and_then(|link| link.split_once('='))
        .ok_or("a link is INPUT=COMPONENT.OUTPUT")?;
    let (id, data) = (id.to_owned(), data.to_owned());
    let (keep, wake, transport) = (Keep::Latest, Wake::Sleep, Transport::Auto);
    let mut settings = InputSettings { id, data, keep, wake, transport, history: 1 };
    for part in parts {
        match part.split_once('=') {
            Some(("keep", keep)) => settings.keep = keep.parse()?,
            Some(("patience", patience)) => {
                let seconds = quantity::seconds(patience).map_err(|error| error.to_string())?;
                let Keep::All { patience_ms } = &mut settings.keep else {
                    return Err("patience=… comes after keep=all".into());
                };
                // Saturates, as the file's does.
                *patience_ms = (seconds * 1e3).max(1.0) as u32;
            }
            Some(("wake", wake)) => settings.wake = wake.parse()?,
            Some(("transport", transport)) => settings.transport = transport.parse()?,
            Some(("history", count)) => {
                let count = count.parse().ok().filter(|count| *count >= 1);
                settings.history = count.ok_or("history is a number from 1")?;
            }
            _ => {
                return Err(format!(
                    "`{part}` is none of keep=…, patience=…, wake=…, transport=…, history=…"
                ));
            }
        }
    }
    Ok(settings)
}

fn run_component(
    kind: &KindDeclaration,
    constructor: impl FnOnce(Armor) -> Result<Box<dyn UserCode>, Fault>,
    options: &ComponentOptions,
) -> Result<u8, Fault> {
    let name = options.name.clone();
    let identity = ProcessIdentity { name, kind: kind.kind.clone(), instance: random_id() };
    let participant = Arc::new(Participant::new(identity, kind.declarations(), false)?);
    // Before it is registered: a tool that finds it may ask immediately.
    participant.ports.serve_calls();
    // Threads inherit the mark from the one that starts them: before any is started.
    participant.thread_panics.mark().mark_main_thread();
    participant.thread_panics.include_unmarked();
    end_on_signals(&participant)?;
    report_thread_panics(&participant);
    node::join_system(&participant, &options.registry, START_LIMIT)?;
    if participant.lifecycle.is_ending() {
        tracing::info!("ended before it has begun");
        participant.leave_system();
        return Ok(SUCCEEDED);
    }
    let settings =
        if options.alone { None } else { Some(configuration::client::start_client(&participant)?) };
    if options.alone {
        participant.parameters.answer_locally(options.set.clone(), "--set")?;
    }
    let running = participant.calls.begin_call(CalledFunction::New);
    let user = constructor(Armor { participant: Arc::clone(&participant) })?;
    drop(running);
    participant.parameters.wait_for_all(START_LIMIT)?;
    for parameter in participant.parameters.list_unrequested() {
        let name = &parameter.name;
        tracing::warn!(
            "{} declares the parameter `{name}` but has not requested it: its value reaches the \
             component only when it does; call get_parameter(\"{name}\") in `new`, or remove it \
             from PARAMETERS",
            kind.kind
        );
    }
    let settings = match settings {
        Some(settings) => settings
            .recv_timeout(START_LIMIT)
            .map_err(|_| format!("configd has not sent the links of `{}`", options.name))??,
        None => ComponentSettings {
            rate_hz: options.rate_hz,
            inputs: options.links.clone(),
            clock: options.clock.clone(),
            ..ComponentSettings::default()
        },
    };
    check_links(&participant, &settings, options.alone)?;
    apply_settings(&participant, &settings);
    if let Some(data) = &settings.clock {
        following::start_following(&participant, data, |_, _| {})?;
    }
    node::provide_outputs(&participant);
    let runtime = Arc::new(Runtime::new(user, Arc::clone(&participant), settings.rate_hz));
    start_input_readers(&runtime, kind.thread_scope)?;
    let has_crashed = runtime.run_main_loop();
    leave_system(&participant);
    Ok(if has_crashed { PANICKED } else { SUCCEEDED })
}

fn start_input_readers(runtime: &Arc<Runtime>, scope: ThreadScope) -> std::io::Result<()> {
    for (index, input) in runtime.participant.ports.inputs().into_iter().enumerate() {
        let name = format!("in {}", input.id);
        if let Some(reader) = InputReader::new(input, index, Arc::clone(runtime)) {
            let mut reader = Some(reader);
            let mut read = move || reader.take().into_iter().for_each(InputReader::read_links);
            std::thread::Builder::new().name(name).spawn(move || scope(&mut read))?;
        }
    }
    Ok(())
}

/// Refuses data for inputs that the component does not have. `is_alone`: `--link` states them, not
/// the file.
fn check_links(
    participant: &Participant,
    settings: &ComponentSettings,
    is_alone: bool,
) -> Result<(), Fault> {
    let (name, kind) = (&participant.identity.name, &participant.identity.kind);
    let inputs = participant.ports.inputs();
    let inputs: Vec<_> = inputs.iter().map(|input| input.id.as_str()).collect();
    let wrong = |fed: &&InputSettings| !inputs.contains(&fed.id.as_str());
    let Some(InputSettings { id, data, .. }) = settings.inputs.iter().find(wrong) else {
        return Ok(());
    };
    if !is_alone {
        let why = format!("the file feeds input `{name}.{id}`, which `{kind}` does not have");
        return Err(why.into());
    }
    let has = match inputs.as_slice() {
        [] => "no inputs at all".into(),
        inputs => format!("no input `{id}`, only: {}", inputs.join(", ")),
    };
    Err(format!("--link {id}={data}: `{kind}` has {has}").into())
}

fn apply_settings(participant: &Participant, settings: &ComponentSettings) {
    participant.lifecycle.set_controlled(settings.controlled);
    if participant.lifecycle.is_contradictory() {
        participant.reports.record_error(
            "the mission activates this component, but its code calls `set_non_controllable`: it \
             stays frozen; name it in no place",
        );
    }
    let watchdog = settings.watchdog_s.and_then(|time_s| Duration::try_from_secs_f64(time_s).ok());
    if let Some(watchdog) = watchdog {
        participant.set_watchdog(watchdog);
    }
    let name = &participant.identity.name;
    for fed in &settings.inputs {
        participant.ports.connect_input(fed);
    }
    let inputs = participant.ports.inputs();
    for input in inputs.iter().filter(|input| input.required && input.data().is_none()) {
        tracing::warn!("input `{name}.{}` is required but nothing feeds it", input.id);
    }
}

/// SIGTERM and SIGINT end the component in order: its actuators come to rest first.
fn end_on_signals(participant: &Arc<Participant>) -> std::io::Result<()> {
    let (mut reader, writer) = UnixStream::pair()?;
    signal_hook::low_level::pipe::register(signal_hook::consts::SIGTERM, writer.try_clone()?)?;
    signal_hook::low_level::pipe::register(signal_hook::consts::SIGINT, writer)?;
    let participant = Arc::clone(participant);
    spawn_background("signals", move || {
        let mut byte = [0];
        while std::io::Read::read(&mut reader, &mut byte).is_ok_and(|len| len > 0) {
            participant.lifecycle.request_end();
        }
    })
}

/// Waits until the last data and reports are sent, for a limited time, then leaves the registry.
fn leave_system(participant: &Participant) {
    let deadline = Instant::now() + LEAVE_LIMIT;
    while Instant::now() < deadline {
        if participant.ports.flush_outputs() && participant.reports.is_empty() {
            break;
        }
        std::thread::sleep(LEAVE_PERIOD);
    }
    participant.leave_system();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Flag;
    use crate::participant::Declarations;

    fn usage_error(registry: &str) -> Option<String> {
        let arguments = ["--registry", registry].map(Into::into);
        parse_arguments("belt", arguments).err().map(|error| error.to_string())
    }

    #[test]
    fn the_address_of_a_registry_is_checked_before_anything_waits_for_it() {
        for fine in ["localhost:7411", "robot:0", "127.0.0.1:7411", "[::1]:7411"] {
            assert_eq!(usage_error(fine), None, "{fine}");
        }
        for wrong in ["localhost", ":7411", "robot:70000", "::1:7411", "http://robot:80", "robot:"]
        {
            let why = usage_error(wrong).expect(wrong);
            let expected =
                format!("--registry {wrong}: an address is HOST:PORT, such as localhost:7411");
            assert_eq!(why, expected);
        }
    }

    #[test]
    fn a_link_to_an_input_that_does_not_exist_names_those_that_do() {
        let identity = ProcessIdentity { name: "b".into(), kind: "belt".into(), instance: 1 };
        let participant = Participant::new(identity, Declarations::default(), false);
        let participant = Arc::new(participant.expect("a process"));
        let settings = ComponentSettings {
            inputs: vec![parse_link("brak=sorter.brake").expect("a link")],
            ..ComponentSettings::default()
        };
        let refusal = |is_alone| {
            let refused = check_links(&participant, &settings, is_alone);
            refused.expect_err("there is no such input").to_string()
        };
        assert_eq!(refusal(true), "--link brak=sorter.brake: `belt` has no inputs at all");
        let armor = Armor { participant: Arc::clone(&participant) };
        armor.subscribe::<Flag>("brake").expect("it is declared");
        let expected = "--link brak=sorter.brake: `belt` has no input `brak`, only: brake";
        assert_eq!(refusal(true), expected);
        let expected = "the file feeds input `b.brak`, which `belt` does not have";
        assert_eq!(refusal(false), expected);
    }
}
