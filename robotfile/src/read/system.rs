//! `<system>` → [`System`].

use std::net::{Ipv6Addr, SocketAddrV6};
use std::sync::Arc;

use armor_wire::gate::{ANNOUNCED, GATE_PORT};
use armor_wire::keep::{Keep, Wake};
use armor_wire::remote_process::CutOff;

use crate::code::Code;
use crate::fields::ElementFields;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{
    Clock, Component, Host, Link, LinkMode, Parameter, Restart, System, Transport, with_history,
};
use crate::read::limits::{MAX_ELEMENTS, MAX_FRAMES, MAX_LINKS, add_limited};
use crate::read::{frame, layout};
use crate::resources::{
    ResourceLimits, parse_cpu, parse_cpus, parse_memory, parse_nice, parse_realtime,
};
use crate::source::{Source, Spanned};
use crate::tree::Element;
use crate::unreadable::UnreadableParts;

/// Most messages that wait on a link with shared memory: the cells of its ring
/// (docs/protocol.md, Shared memory).
const MAX_IN_MEMORY: u32 = 32;

/// Most addresses of a host: those of its networks, and a name.
const MAX_ADDRESSES: usize = 8;

pub(super) fn read(element: &Element, source: &Arc<Source>, findings: &mut Findings) -> System {
    let mut fields = ElementFields::new(element, source, findings);
    let (name, at) = (fields.name("name"), Some(fields.at()));
    let group = fields.converted("group", parse_group);
    let mut system = System { name, group, at, ..System::default() };
    for child in fields.finish(&["clock", "host", "frame", "component", "link", "layout"]) {
        let at = child.at(source);
        match child.name.as_str() {
            "host" => match read_host(child, source, findings) {
                Some(host) => add_limited(&mut system.hosts, host, MAX_ELEMENTS, &at, findings),
                None => system.unreadable.add_element(child),
            },
            "component" => {
                let read = read_component(child, source, findings);
                record_doubt(child, read.as_ref(), &mut system.unreadable);
                if let Some(component) = read {
                    add_limited(&mut system.components, component, MAX_ELEMENTS, &at, findings);
                }
            }
            "link" => match read_link(child, source, findings) {
                Some(link) => add_limited(&mut system.links, link, MAX_LINKS, &at, findings),
                None => system.unreadable.add_link(child),
            },
            "frame" => match frame::read(child, source, findings) {
                Some(frame) => add_limited(&mut system.frames, frame, MAX_FRAMES, &at, findings),
                None => system.unreadable.add_element(child),
            },
            "clock" => read_clock(child, source, &mut system, findings),
            _ => layout::read(child, source, &mut system.layout),
        }
    }
    system
}

/// Records the parts of a component that could not be read.
fn record_doubt(element: &Element, read: Option<&Component>, unreadable: &mut UnreadableParts) {
    unreadable.add_if_misnamed(element, read.map(|component| component.name.value.as_str()));
    let Some(read) = read else { return };
    let is_rate_lost = read.rate_hz.is_none() && element.attribute("rate").is_some();
    if is_rate_lost || element.elements().count() > read.parameters.len() {
        unreadable.add_half_read(&read.name.value);
    }
}

fn read_host(element: &Element, source: &Arc<Source>, findings: &mut Findings) -> Option<Host> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let is_there = element.attribute("at").is_some();
    let addresses = fields.converted("at", parse_addresses);
    if !is_there {
        fields.required("at");
    }
    let cut_off = fields.choice("cut-off", &CutOff::ALL);
    let patience = fields.longer_than_nothing("patience").map(|patience| patience.value);
    fields.finish(&[]);
    let cut_off = cut_off.map(|cut_off| cut_off.value).unwrap_or_default();
    Some(Host { name: name?, addresses: addresses?, cut_off, patience })
}

/// Reads the addresses of a host's agent, which are tried in turn.
fn parse_addresses(text: &str) -> Result<Vec<String>, String> {
    let texts: Vec<_> = text.split_whitespace().collect();
    if texts.len() > MAX_ADDRESSES {
        return Err(format!("at most {MAX_ADDRESSES} addresses"));
    }
    let mut addresses = Vec::new();
    for text in texts {
        let address = parse_address(text)?;
        if !addresses.contains(&address) {
            addresses.push(address);
        }
    }
    if addresses.is_empty() { parse_address("").map(|_| addresses) } else { Ok(addresses) }
}

/// Reads one of them: a name or an address, and a port, or the usual one; or the word for wherever the
/// agent announces itself.
fn parse_address(text: &str) -> Result<String, String> {
    let wrong = || {
        format!(
            "an address such as arm.local, 10.0.0.2:{GATE_PORT} or [fd00::2]:7410, or {ANNOUNCED} \
             for where the agent announces itself, or several with spaces between them"
        )
    };
    let is_plain = |host: &str| {
        let is_part = |letter: char| letter.is_ascii_alphanumeric() || ".-_".contains(letter);
        !host.is_empty() && host.chars().all(is_part)
    };
    if text == ANNOUNCED {
        return Ok(text.to_owned());
    }
    if text.parse::<Ipv6Addr>().is_ok() {
        return Ok(format!("[{text}]:{GATE_PORT}"));
    }
    if text.parse::<SocketAddrV6>().is_ok_and(|address| address.port() > 0) {
        return Ok(text.to_owned());
    }
    match text.rsplit_once(':') {
        None if is_plain(text) => Ok(format!("{text}:{GATE_PORT}")),
        Some((host, port)) if is_plain(host) && port.parse::<u16>().is_ok_and(|port| port > 0) => {
            Ok(text.to_owned())
        }
        _ => Err(wrong()),
    }
}

fn read_component(
    element: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<Component> {
    let mut fields = ElementFields::new(element, source, findings);
    let name = fields.required_name("name");
    let kind = fields.required_name("kind");
    let host = fields.name("host");
    let rate_hz = fields.rate_hz("rate");
    let restart = fields.choice(
        "restart",
        &[
            ("always", Restart::Always),
            ("on-failure", Restart::OnFailure),
            ("never", Restart::Never),
        ],
    );
    let watchdog = fields.longer_than_nothing("watchdog");
    let controllable = fields.flag("controllable", true);
    let variables = fields.converted("env", parse_variables);
    let resources = ResourceLimits {
        nice: fields.converted("nice", parse_nice),
        realtime: fields.converted("realtime", parse_realtime),
        cpus: fields.converted("cpus", parse_cpus),
        cpu: fields.converted("cpu", parse_cpu),
        memory: fields.converted("memory", parse_memory),
    };
    let children = fields.finish(&["parameter"]);
    let parameters =
        children.iter().filter_map(|child| read_parameter(child, source, findings)).collect();
    Some(Component {
        name: name?,
        kind: kind?,
        host,
        rate_hz,
        restart: restart.map(|restart| restart.value).unwrap_or_default(),
        watchdog,
        controllable,
        variables,
        resources,
        parameters,
    })
}

fn read_parameter(
    element: &Element,
    source: &Arc<Source>,
    findings: &mut Findings,
) -> Option<Parameter> {
    let mut fields = ElementFields::new(element, source, findings);
    let parameter = assignment(&mut fields, source);
    fields.finish(&[]);
    parameter
}

/// `name="…" value="…"`, of a component or of a place.
pub(super) fn assignment(fields: &mut ElementFields<'_, '_>, source: &Source) -> Option<Parameter> {
    let (name, value) = (fields.required_name("name"), fields.required("value"));
    Some(Parameter { name: name?, value: value?, folder: source.folder() })
}

fn read_link(element: &Element, source: &Arc<Source>, findings: &mut Findings) -> Option<Link> {
    let mut fields = ElementFields::new(element, source, findings);
    let from = fields.required_dotted("from");
    let to = fields.required_dotted("to");
    let mode = fields.choice("mode", &[("push", LinkMode::Push), ("pull", LinkMode::Pull)]);
    let keep = fields.word_or("keep", &["latest", "all"], parse_keep);
    let patience = fields.longer_than_nothing("patience");
    let wake = fields.word_or("wake", &["sleep", "spin"], str::parse);
    let transport = fields.choice("transport", &Transport::NAMED);
    let history = fields.count("history", 1);
    let keep_at = keep.as_ref().map(at);
    let transport_at = transport.as_ref().map(at);
    let pulls = mode.as_ref().is_some_and(|mode| mode.value == LinkMode::Pull);
    if pulls && keep.as_ref().is_some_and(|keep| keep.value != Keep::Latest) {
        fields.without_effect(
            "keep",
            "a link that pulls fetches only the newest data: remove keep, or make it push",
        );
    }
    if pulls && wake.as_ref().is_some_and(|wake| wake.value == Wake::Spin) {
        fields.without_effect(
            "wake",
            "a link that pulls wakes no reader: remove wake, or make it push",
        );
    }
    let mut keep = keep.map(|keep| keep.value).unwrap_or_default();
    if transport.as_ref().is_some_and(|transport| transport.value == Transport::Shm) {
        let stored = history.as_ref().map_or(1, |history| history.value);
        let count = match with_history(keep, stored) {
            Keep::Last { count } if !pulls => count,
            _ => 0,
        };
        if count > MAX_IN_MEMORY {
            let name = if stored > MAX_IN_MEMORY { "history" } else { "keep" };
            let advice = format!(
                "shared memory holds at most {MAX_IN_MEMORY} messages that wait: write \
                 {name}=\"{MAX_IN_MEMORY}\" or less, or remove transport"
            );
            fields.without_effect("transport", &advice);
        }
    }
    if transport.as_ref().is_some_and(|transport| transport.value == Transport::Udp) {
        if pulls {
            fields.without_effect(
                "transport",
                "a link that pulls uses TCP: remove transport, or make it push",
            );
        } else if wake.as_ref().is_some_and(|wake| wake.value == Wake::Spin) {
            fields.without_effect(
                "wake",
                "datagrams are waited for asleep: remove wake, or use another transport",
            );
        }
    }
    match (&mut keep, patience) {
        (Keep::All { patience_ms }, Some(patience)) => {
            *patience_ms = u32::try_from(patience.value.as_millis()).unwrap_or(u32::MAX).max(1);
        }
        (_, Some(_)) => fields.without_effect(
            "patience",
            "the sender waits for no consumer: write keep=\"all\", or remove patience",
        ),
        (_, None) => {}
    }
    fields.finish(&[]);
    Some(Link {
        from: from?,
        to: to?,
        mode: mode.map(|mode| mode.value).unwrap_or_default(),
        keep,
        wake: wake.map(|wake| wake.value).unwrap_or_default(),
        transport: transport.map(|transport| transport.value).unwrap_or_default(),
        history: history.map_or(1, |history| history.value),
        keep_at,
        transport_at,
    })
}

fn at<T>(value: &Spanned<T>) -> crate::source::Location {
    value.at.clone()
}

/// Reads the name of a group of users, as useradd(8) and groupadd(8) allow it.
fn parse_group(text: &str) -> Result<String, String> {
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || "_.-".contains(letter);
    if !text.is_empty() && text.len() <= 32 && !text.starts_with('-') && text.chars().all(is_part) {
        Ok(text.to_owned())
    } else {
        Err("the name of a group of users, such as \"robotics\"".into())
    }
}

/// Reads names of environment variables with spaces between them.
fn parse_variables(text: &str) -> Result<Vec<String>, String> {
    let is_name = |name: &str| {
        name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
    };
    if text.split_whitespace().all(is_name) && !text.trim().is_empty() {
        Ok(text.split_whitespace().map(str::to_owned).collect())
    } else {
        Err("names of environment variables, such as \"MAP_TOKEN CUDA_VISIBLE_DEVICES\"".into())
    }
}

fn parse_keep(text: &str) -> Result<Keep, String> {
    // A count is written without sign and leading zeros, as the schema has it, and the patience as
    // an attribute of its own.
    let text = if text.starts_with(['+', '0']) || text.contains(',') { "" } else { text };
    if text == "pull" {
        return Err("write mode=\"pull\"".into());
    }
    text.parse()
}

fn read_clock(
    element: &Element,
    source: &Arc<Source>,
    system: &mut System,
    findings: &mut Findings,
) {
    let mut fields = ElementFields::new(element, source, findings);
    let at = fields.at();
    let data = fields.required_dotted("source");
    fields.finish(&[]);
    let Some(data) = data else { return };
    match &system.clock {
        Some(first) => {
            let finding = Finding::new(Code::DuplicateElement, &at, "<clock> occurs twice");
            findings
                .push(finding.remedy("keep one of them").related(&first.source.at, "first here"));
        }
        None => system.clock = Some(Clock { source: data }),
    }
}
