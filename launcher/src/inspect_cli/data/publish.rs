//! `armor data pub NAME TYPE FIELD=VALUE…`: publishes data by hand, in the place of a component that
//! does not run. The inputs that the file feeds with the data get them.

mod deliveries;

use std::collections::BTreeSet;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow, bail};
use armor_inspect::run_control::AbsentState;
use armor_inspect::words::format_bytes;
use armor_inspect::{MessageDraft, ObservedSystem};
use armor_sdk::AnyMessage;
use armor_sdk::Latched;
use armor_sdk::directory::Listing;
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_wire::control::Status;
use armor_wire::schema::parse;
use clap::Args;
use serde_json::json;

use super::message_types::MessageTypes;
use crate::arguments::{OutputFormat, RunningSystem, parse_data_name};
use crate::exit::CommandEnding;
use crate::inspect_cli::absence::list_absent;
use crate::inspect_cli::select_system;
use crate::inspect_cli::time_source::find_time_source;
use crate::print::{end_printing, print_line, print_notice};
use crate::system;
use deliveries::{Delivery, DeliveryOutcome, ExpectedInput};

/// The kind under which the command registers.
const KIND: &str = "data-pub";
/// Time within which the registry must accept the process, and the system's time must be known.
const JOIN_WITHIN: Duration = Duration::from_secs(5);
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// The name of the executive, which plays the mission.
const EXECUTIVE: &str = "executive";

/// Publish data by hand: once, or at a rate, in the place of a component that does not run.
///
/// NAME may be the output of a component of the file that is stopped: the inputs that are linked to it
/// get the data. It may also be a name that the file does not have: tools can read it. A name that a
/// running component has is refused.
///
/// Fields that are not given are 0, empty or absent; a `stamp` that is not given is the present time.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor stop driver; armor data pub driver.velocity Twist linear.x=0.3
  armor data pub driver.velocity Twist '{\"linear\": {\"x\": 0.3}}' --rate 10
  armor data pub test.speed Twist linear.x=0.3 --latched --rate 1 -n 60")]
pub struct PublishArguments {
    /// Unique name of the data, COMPONENT.OUTPUT.
    #[arg(value_parser = parse_data_name)]
    name: String,
    /// Name of the message type.
    #[arg(value_name = "TYPE")]
    type_name: String,
    /// Fields, such as linear.x=0.3, or a JSON object.
    #[arg(value_name = "FIELD=VALUE")]
    fields: Vec<String>,
    /// Publish so many times per second, instead of once.
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    rate: Option<f64>,
    /// Stop after N messages; needs --rate.
    #[arg(long, short = 'n', value_name = "N", requires = "rate")]
    count: Option<u64>,
    /// Give a later subscriber the last message, as long as the command runs.
    #[arg(long)]
    latched: bool,
    /// Longest time to wait for the inputs that are linked to the data.
    #[arg(long, value_name = "TIME", value_parser = crate::arguments::parse_duration, default_value = "3s")]
    within: Duration,
    #[command(flatten)]
    running: RunningSystem,
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix("Hz").unwrap_or(text).trim().parse::<f64>();
    match number {
        Ok(rate_hz) if rate_hz > 0.0 && rate_hz <= 10_000.0 => Ok(rate_hz),
        _ => Err("write a rate in hertz, above 0 and at most 10000, such as 10".into()),
    }
}

/// Publishes, and prints which inputs have received the data.
///
/// # Errors
/// If no system is found, the name is taken, the type is unknown, the fields do not fit it, or the
/// registry refuses the process.
pub fn publish_by_hand(
    arguments: &PublishArguments,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let PublishArguments { name, type_name, fields, running, within, .. } = arguments;
    if armor_socket::has_proxy() {
        bail!(
            "a key does not allow it: `armor data pub` registers a process, which no role may do \
             from another host (docs/security.md); log in there with ssh and run it on that host"
        );
    }
    let observed = select_system(running, "data")?;
    let statuses = ask_statuses(&observed)?;
    let listing = observed.list()?;
    check_place(running, &listing, &statuses, name)?;
    let types = MessageTypes::gather(running, &listing)?;
    let inputs = ExpectedInput::list(&statuses, &types, name);
    let preferred: BTreeSet<_> = inputs.iter().filter_map(|it| it.schema.clone()).collect();
    let schema_text = types.find_schema(type_name, &preferred)?;
    check_inputs(&inputs, name, type_name, schema_text)?;
    let schema = parse(schema_text)?;
    let draft = MessageDraft::parse(&schema, fields).map_err(|faults| {
        let faults: Vec<_> = faults.iter().map(|fault| format!("  {fault}")).collect();
        anyhow!("this is no {type_name}:\n{}", faults.join("\n"))
    })?;
    let encode = |now_s| draft.encode(now_s).map_err(|faults| anyhow!("{}", faults[0]));

    let node = join_system(arguments, &find_registry(running)?)?;
    follow_time(&node, &statuses)?;
    node.give_outputs_type(type_name, schema_text);
    deliveries::await_links(&node, &inputs, *within);
    let output = name.split_once('.').map_or("", |(_, output)| output);
    let armor = node.armor();
    let publish = || -> Result<usize> {
        let now_s = armor.timestamp();
        let message = AnyMessage::encoded(type_name, schema_text, now_s, encode(now_s)?);
        Ok(armor.send_data(output, &message)?.to)
    };
    let len = encode(0.0)?.len();
    if let Some(rate_hz) = arguments.rate {
        print_notice(format_args!(
            "publishing {name} ({type_name}, {}) at {rate_hz} Hz; Ctrl-C ends it",
            format_bytes(len as f64)
        ));
    }
    let published = publish_all(arguments, publish)?;
    let deliveries = deliveries::await_deliveries(&observed, &node, &inputs, *within);
    let others = node.outputs().iter().flat_map(|it| &it.links).filter(|it| it.sent > 0).count();
    print_result(arguments, (published, len), &deliveries, others, format)
}

fn ask_statuses(observed: &ObservedSystem) -> Result<Vec<Status>> {
    let sightings = observed.ask_statuses()?;
    Ok(sightings.into_iter().filter_map(|sighting| sighting.status.ok()).collect())
}

/// Checks that this command may take the place of the component.
fn check_place(
    running: &RunningSystem,
    listing: &Listing,
    statuses: &[Status],
    name: &str,
) -> Result<()> {
    let component = name.split('.').next().unwrap_or_default();
    if let Some(advice) = advise_for_input(listing, statuses, name) {
        bail!("{advice}");
    }
    let holder = listing.components.iter().find(|entry| entry.name == component);
    let is_provided = listing.data.iter().any(|entry| entry.data == name);
    if let Some(holder) = holder {
        let (kind, pid) = (&holder.kind, holder.pid);
        let what = match is_provided {
            true => format!("{name} is provided already"),
            false => format!("only {component} itself can publish {name}"),
        };
        bail!(
            "{what}: {component} runs (kind {kind}, process {pid}); `armor stop {component}` makes \
             room, or publish under another name"
        );
    }
    let absent = list_absent(running).into_iter().find(|absent| absent.component == component);
    let Some(absent) = absent else { return Ok(()) };
    if absent.state == AbsentState::Starting {
        bail!(
            "{component} is being started ({}): `armor stop {component}` first, or wait",
            absent.reason
        );
    }
    if listing.components.iter().any(|entry| entry.name == EXECUTIVE) {
        bail!(
            "{component} is a component of the file, and while a mission runs no other process may \
             take its place: the executive would take that for the component"
        );
    }
    Ok(())
}

/// Returns what to do in place of publishing an input: data are published by outputs.
fn advise_for_input(listing: &Listing, statuses: &[Status], name: &str) -> Option<String> {
    let (component, port) = name.split_once('.')?;
    let status = statuses.iter().find(|status| status.name == component)?;
    let fed = status.inputs.iter().filter(|input| input.id == port).map(|input| &input.data);
    let sources: Vec<_> = fed.collect();
    let source = sources.first()?;
    let what = format!("{name} is an input, and data are published under the name of an output");
    let Some((provider, _)) = source.split_once('.') else {
        return Some(format!(
            "{what}: no link of the file feeds it. Link an output to it, and publish that"
        ));
    };
    let is_provided = listing.components.iter().any(|entry| entry.name == provider);
    Some(match is_provided {
        true => format!(
            "{what}: the file links {source} to it. `armor stop {provider}` makes room for publishing \
             {source} (not while a mission runs)"
        ),
        false => format!("{what}: the file links {source} to it; publish {source}"),
    })
}

/// Refuses a type that an input which the file links to the data does not take.
fn check_inputs(inputs: &[ExpectedInput], name: &str, type_name: &str, schema: &str) -> Result<()> {
    let differs = |input: &&ExpectedInput| input.schema.as_deref().is_some_and(|it| it != schema);
    let Some(input) = inputs.iter().find(differs) else { return Ok(()) };
    let given = (name, schema);
    let declared = (input.port.as_str(), input.schema.as_deref().unwrap_or_default());
    let how = armor_wire::schema::difference(declared, given);
    let expected = &input.type_name;
    bail!(
        "{}, which the file links to {name}, takes a {expected}, not this {type_name}:\n{how}",
        input.port
    )
}

fn find_registry(running: &RunningSystem) -> Result<String> {
    Ok(system::find_registry(running)?.to_string())
}

/// Registers under the name of the component, with the one output, which has no type yet.
fn join_system(arguments: &PublishArguments, registry: &str) -> Result<SystemNode> {
    let (component, output) = arguments.name.split_once('.').unwrap_or_default();
    let options =
        NodeOptions { name: component.into(), kind: KIND.into(), registry: registry.into() };
    let declare = |armor: &armor_sdk::Armor| {
        match arguments.latched {
            true => armor.provide::<Latched<AnyMessage>>(output)?,
            false => armor.provide::<AnyMessage>(output)?,
        }
        Ok(())
    };
    SystemNode::start(&options, JOIN_WITHIN, declare)
        .map_err(|fault| anyhow!("{} cannot be published: {fault}", arguments.name))
}

/// Lets the stamps have the time of the system, if that follows data.
fn follow_time(node: &SystemNode, statuses: &[Status]) -> Result<()> {
    let Some(source) = find_time_source(statuses) else { return Ok(()) };
    node.follow_time(&source, |_, _| {})?;
    let start = Instant::now();
    while node.armor().timestamp() <= 0.0 {
        if start.elapsed() > JOIN_WITHIN {
            bail!("the time of the system follows {source}, which has published nothing");
        }
        thread::sleep(LOOK_EVERY);
    }
    Ok(())
}

/// Publishes as many times as is asked for. Returns that number.
fn publish_all(arguments: &PublishArguments, publish: impl Fn() -> Result<usize>) -> Result<u64> {
    let Some(rate_hz) = arguments.rate else {
        publish()?;
        return Ok(1);
    };
    let start = Instant::now();
    let count = arguments.count.unwrap_or(u64::MAX);
    for number in 0..count {
        let due = Duration::from_secs_f64(number as f64 / rate_hz);
        thread::sleep(due.saturating_sub(start.elapsed()));
        publish()?;
    }
    Ok(count)
}

/// Prints where the data went. Fails if they reached nothing.
fn print_result(
    arguments: &PublishArguments,
    (published, len): (u64, usize),
    deliveries: &[Delivery],
    links: usize,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let PublishArguments { name, type_name, .. } = arguments;
    let is_received = deliveries.iter().any(|it| it.outcome == DeliveryOutcome::Received);
    end_printing(match format {
        OutputFormat::Json => print_line(json!({
            "data": name,
            "type": type_name,
            "published": published,
            "bytes": len,
            "links": links,
            "inputs": deliveries,
        })),
        _ => {
            let times = if published == 1 { "once".into() } else { format!("{published} times") };
            let size = format_bytes(len as f64);
            let lines = deliveries.iter().map(|delivery| format!("\n  {delivery}"));
            print_line(format!(
                "{name} ({type_name}, {size}) published {times}{}",
                lines.collect::<String>()
            ))
        }
    })?;
    if is_received || links > 0 {
        return Ok(CommandEnding::Fine);
    }
    if deliveries.is_empty() {
        print_notice(format_args!("nothing is linked to {name}: no process has received it"));
    }
    Ok(CommandEnding::Failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_a_number_of_hertz() {
        assert_eq!(parse_rate("10"), Ok(10.0));
        assert_eq!(parse_rate("0.5Hz"), Ok(0.5));
        for wrong in ["0", "-1", "fast", "1e9", "NaN"] {
            assert!(parse_rate(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_input_of_another_type_is_named_with_the_difference() {
        let input = ExpectedInput {
            component: "wheels".into(),
            port: "wheels.speed".into(),
            type_name: "Speed".into(),
            schema: Some("Speed{x:f64(m/s)}".into()),
            received: 0,
        };
        let check = |schema| check_inputs(std::slice::from_ref(&input), "a.b", "Twist", schema);
        assert!(check("Speed{x:f64(m/s)}").is_ok());
        let error = check("Twist{x:f64(rad/s)}").expect_err("they differ").to_string();
        assert!(
            error.starts_with("wheels.speed, which the file links to a.b, takes a Speed"),
            "{error}"
        );
        assert!(error.contains("rad/s"), "{error}");
    }
}
