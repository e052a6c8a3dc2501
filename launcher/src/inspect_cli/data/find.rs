//! `armor data find WORD`: the ports of a type, or whose name or fields contain a word.

use anyhow::{Result, bail};
use armor_sdk::directory::Listing;
use armor_wire::control::Status;
use serde::Serialize;

use super::message_types::MessageTypes;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::inspect_cli::describe::fields::list_fields;
use crate::inspect_cli::select_system;
use crate::print::{Table, end_printing, print_line, terminal_width};

/// Most fields of one port that a table lists.
const MAX_FIELDS: usize = 3;

/// A port of a running component.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct FoundPort {
    /// `COMPONENT.PORT`.
    port: String,
    direction: Direction,
    #[serde(rename = "type")]
    type_name: String,
    /// What has the word: the type, the port's name, or the paths of fields.
    matches: Vec<String>,
    #[serde(skip)]
    schema: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
enum Direction {
    Output,
    Input,
}

/// Prints the ports that have the word; fails if there are none.
///
/// # Errors
/// If no system is found, its registry does not answer, or no port has the word.
pub fn find_ports(
    running: &RunningSystem,
    word: &str,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let observed = select_system(running, "data")?;
    let sightings = observed.ask_statuses()?;
    let statuses: Vec<_> = sightings.into_iter().filter_map(|it| it.status.ok()).collect();
    let listing = observed.list()?;
    let types = MessageTypes::gather(running, &listing)?;
    let ports = list_ports(&listing, &statuses, &types);
    let found = match_ports(ports, word);
    if found.is_empty() {
        bail!(
            "no output or input of a running component has `{word}` in its name, its type or its \
             fields; `armor data list` shows all outputs"
        );
    }
    end_printing(if format == OutputFormat::Json {
        found.iter().try_for_each(|port| print_line(serde_json::to_string(port)?))
    } else {
        let rows = found.iter().map(format_row).collect();
        let table = Table::new(&["PORT", "", "TYPE", "FIELDS"], rows);
        print_line(table.dispensable(&["FIELDS"]).format(terminal_width()).trim_end())
    })
}

/// Returns all ports. The type of an input is that of what feeds it, or that which its kind declares.
fn list_ports(listing: &Listing, statuses: &[Status], types: &MessageTypes) -> Vec<FoundPort> {
    let outputs = listing.data.iter().map(|entry| FoundPort {
        port: entry.data.clone(),
        direction: Direction::Output,
        type_name: entry.type_name.clone(),
        matches: Vec::new(),
        schema: entry.schema.clone(),
    });
    let mut ports: Vec<FoundPort> = outputs.collect();
    for status in statuses {
        for input in &status.inputs {
            let fed = listing.data.iter().find(|entry| entry.data == input.data);
            let declared = types.find_input(&status.kind, &input.id).filter(|port| !port.is_any());
            let (type_name, schema) = match (declared, fed) {
                (Some(port), _) => (port.type_name.clone(), port.schema.clone()),
                (None, Some(entry)) => (entry.type_name.clone(), entry.schema.clone()),
                (None, None) => (String::new(), String::new()),
            };
            let port = format!("{}.{}", status.name, input.id);
            let direction = Direction::Input;
            ports.push(FoundPort { port, direction, type_name, matches: Vec::new(), schema });
        }
    }
    ports.sort_by(|a, b| (a.direction, &a.port).cmp(&(b.direction, &b.port)));
    // An input that several links feed is listed once.
    ports.dedup_by(|a, b| (a.direction, &a.port) == (b.direction, &b.port));
    ports
}

/// Returns the ports with the type `word`, if there are any; otherwise all that have the word in a
/// name.
fn match_ports(ports: Vec<FoundPort>, word: &str) -> Vec<FoundPort> {
    let word = word.to_lowercase();
    let has = |text: &str| text.to_lowercase().contains(&word);
    if ports.iter().any(|port| port.type_name.to_lowercase() == word) {
        let of_type = ports.into_iter().filter(|port| port.type_name.to_lowercase() == word);
        return of_type.map(|port| FoundPort { matches: vec!["type".into()], ..port }).collect();
    }
    let matched = ports.into_iter().map(|port| {
        let mut matches = Vec::new();
        if has(&port.type_name) {
            matches.push("type".into());
        }
        if has(&port.port) {
            matches.push("name".into());
        }
        if !port.schema.is_empty() {
            let fields = list_fields(&port.schema).into_iter();
            matches.extend(fields.map(|(path, _)| path).filter(|path| has(path)));
        }
        FoundPort { matches, ..port }
    });
    matched.filter(|port| !port.matches.is_empty()).collect()
}

fn format_row(port: &FoundPort) -> Vec<String> {
    let fields = port.matches.iter().filter(|it| !matches!(it.as_str(), "type" | "name"));
    let mut fields: Vec<_> = fields.map(String::as_str).collect();
    if fields.len() > MAX_FIELDS {
        fields.truncate(MAX_FIELDS);
        fields.push("…");
    }
    let direction = match port.direction {
        Direction::Output => "output",
        Direction::Input => "input",
    };
    let type_name = if port.type_name.is_empty() { "-" } else { &port.type_name };
    vec![port.port.clone(), direction.into(), type_name.into(), fields.join(", ")]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn port(port: &str, direction: Direction, type_name: &str, schema: &str) -> FoundPort {
        let (port, type_name, schema) = (port.into(), type_name.into(), schema.into());
        FoundPort { port, direction, type_name, matches: Vec::new(), schema }
    }

    #[test]
    fn a_type_is_found_alone_and_a_word_in_every_name() {
        let ports = vec![
            port("driver.velocity", Direction::Output, "Twist", "Twist{linear:f64(m/s)}"),
            port("simulator.velocity", Direction::Input, "Twist", "Twist{linear:f64(m/s)}"),
            port("limits.twisted", Direction::Output, "Limit", "Limit{velocity:f64(m/s),at:f64}"),
            port("mapper.unfed", Direction::Input, "", ""),
        ];
        let found = |word| {
            let found = match_ports(ports.clone(), word);
            found.into_iter().map(|it| format!("{} {}", it.port, it.matches.join("+"))).collect()
        };
        let check = |word, expected: &[&str]| {
            let found: Vec<String> = found(word);
            assert_eq!(found, expected, "{word}");
        };
        check("twist", &["driver.velocity type", "simulator.velocity type"]);
        check("TWIS", &["driver.velocity type", "simulator.velocity type", "limits.twisted name"]);
        check(
            "veloc",
            &["driver.velocity name", "simulator.velocity name", "limits.twisted velocity"],
        );
        check("unfed", &["mapper.unfed name"]);
        check("nothing", &[]);
    }
}
