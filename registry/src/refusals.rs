//! Every refusal of the registry, with its explanation for people.

use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::name::{MAX_NAME_LEN, is_name};
use armor_wire::registry::{ComponentEntry, DataEntry};
use armor_wire::schema::{self, ANY_SCHEMA};

use crate::limits::{MAX_HOST_LEN, MAX_REFUSAL_LEN, MAX_SCHEMA_LEN, MAX_TYPE_NAME_LEN};

/// Names that only the program of that name may take.
const RESERVED: [&str; 5] = ["registry", "configd", "configuration", "executive", "launcher"];

pub(crate) fn build_refusal(code: RefusalCode, mut text: String) -> Refusal {
    if text.len() > MAX_REFUSAL_LEN {
        text.truncate(text.floor_char_boundary(MAX_REFUSAL_LEN));
        text.push('…');
    }
    Refusal::new(code, text)
}

pub(crate) fn refuse_malformed(text: impl Into<String>) -> Refusal {
    build_refusal(RefusalCode::Malformed, text.into())
}

pub(crate) fn refuse_limit(what: &str, most: usize) -> Refusal {
    build_refusal(
        RefusalCode::Limit,
        format!("there are {most} {what} already, and no more are kept"),
    )
}

/// Returns whether only the program of that name may take it.
pub(crate) fn is_reserved(name: &str) -> bool {
    RESERVED.contains(&name)
}

pub(crate) fn refuse_reserved(name: &str) -> Refusal {
    let text = match is_reserved(name) {
        true => {
            format!("the name `{name}` belongs to a process that the launcher of this run starts")
        }
        false => format!(
            "the name `{name}` belongs to the component that the launcher of this run starts; \
             `armor stop {name}` gives it free, or take another name"
        ),
    };
    build_refusal(RefusalCode::DuplicateName, text)
}

/// Another host asks for data that the file leads to none of its components.
pub(crate) fn refuse_reader(host: &str, components: &[String], data: &str) -> Refusal {
    let (data, there) = (quote_text(data), components.join(", "));
    let to = components.first().map_or("COMPONENT", |component| component);
    let text = format!(
        "reading {data} is not for the host {host}: no link of the file leads it to a component there \
         ({there}), and none of these reads all data; add a link to one of them, such as \
         to=\"{to}.INPUT\""
    );
    build_refusal(RefusalCode::Role, text)
}

/// Describes a process for people: "lidar (kind sim, process 12 on robot, at 127.0.0.1:4000)".
pub(crate) fn describe_process(entry: &ComponentEntry) -> String {
    let ComponentEntry { name, kind, pid, host, endpoint, .. } = entry;
    format!("`{name}` (kind {kind}, process {pid} on {host}, at {endpoint})")
}

/// Checks whether a process may register under this entry.
pub(crate) fn check_component(entry: &ComponentEntry) -> Result<(), Refusal> {
    for (what, name) in [("name", &entry.name), ("kind", &entry.kind)] {
        if !is_name(name) {
            return Err(refuse_malformed(format!(
                "the {what} {} is not one: letters, digits, _ and -, a letter first, at most \
                 {MAX_NAME_LEN}",
                quote_text(name)
            )));
        }
    }
    if RESERVED.contains(&entry.name.as_str()) && entry.kind != entry.name {
        return Err(refuse_malformed(format!(
            "the name `{}` is reserved for Armor's own program of that name",
            entry.name
        )));
    }
    if entry.host.len() > MAX_HOST_LEN || entry.host.chars().any(char::is_control) {
        return Err(refuse_malformed(format!(
            "the host {} is not a host's name",
            quote_text(&entry.host)
        )));
    }
    // In a system of several hosts it begins with the name of its host.
    let port = entry.endpoint.strip_prefix(&entry.host).and_then(|it| it.strip_prefix(':'));
    let is_of_host = port.is_some_and(|port| port.parse::<u16>().is_ok());
    if !is_of_host && entry.endpoint.parse::<std::net::SocketAddr>().is_err() {
        return Err(refuse_malformed(format!(
            "the endpoint {} is not an address with a port, nor `{}:PORT`",
            quote_text(&entry.endpoint),
            quote_text(&entry.host)
        )));
    }
    if entry.instance == 0 {
        return Err(refuse_malformed(
            "instance 0 stands for any; a process start needs one of its own",
        ));
    }
    Ok(())
}

/// Checks whether the process `owner` may publish this output.
pub(crate) fn check_data(entry: &DataEntry, owner: &ComponentEntry) -> Result<(), Refusal> {
    let port = entry.data.strip_prefix(&owner.name).and_then(|rest| rest.strip_prefix('.'));
    if !port.is_some_and(is_name) {
        return Err(refuse_malformed(format!(
            "data of `{}` is named `{}.OUTPUT`, not {}",
            owner.name,
            owner.name,
            quote_text(&entry.data)
        )));
    }
    if entry.type_name.is_empty()
        || entry.type_name.len() > MAX_TYPE_NAME_LEN
        || entry.type_name.chars().any(char::is_control)
    {
        return Err(refuse_malformed(format!(
            "the type of `{}` needs a name of 1 to {MAX_TYPE_NAME_LEN} bytes",
            entry.data
        )));
    }
    if entry.schema == ANY_SCHEMA {
        return Err(refuse_malformed(format!(
            "`{}` has no type yet: provide it when the type of what it passes on is known",
            entry.data
        )));
    }
    if entry.schema.len() > MAX_SCHEMA_LEN {
        return Err(build_refusal(
            RefusalCode::Limit,
            format!("the schema of `{}` is longer than {MAX_SCHEMA_LEN} bytes", entry.data),
        ));
    }
    schema::parse(&entry.schema)
        .map(|_| ())
        .map_err(|error| refuse_malformed(format!("the schema of `{}`: {error}", entry.data)))
}

pub(crate) fn refuse_duplicate_component(holder: &ComponentEntry) -> Refusal {
    build_refusal(
        RefusalCode::DuplicateName,
        format!(
            "the name is taken by {}; stop that one or take another name",
            describe_process(holder)
        ),
    )
}

pub(crate) fn refuse_duplicate_data(data: &str, holder: &ComponentEntry) -> Refusal {
    build_refusal(
        RefusalCode::DuplicateName,
        format!("`{data}` is provided already, by {}", describe_process(holder)),
    )
}

pub(crate) fn refuse_mismatch(
    asker: (&str, &str),
    entry: &DataEntry,
    provider: &ComponentEntry,
) -> Refusal {
    let difference = schema::difference(asker, (&provider.name, &entry.schema));
    build_refusal(
        RefusalCode::TypeMismatch,
        format!(
            "`{}` is of type {} at {}, and not what `{}` expects:\n{difference}",
            entry.data,
            entry.type_name,
            describe_process(provider),
            asker.0
        ),
    )
}

pub(crate) fn refuse_unknown(
    data: &str,
    near: &[&str],
    component: Option<&ComponentEntry>,
) -> Refusal {
    let mut text = format!("no component provides {}", quote_text(data));
    if let Some(component) = component {
        text += &format!("; {} runs, but has no such output", describe_process(component));
    }
    if !near.is_empty() {
        text += &format!("; there is `{}`", near.join("`, `"));
    }
    build_refusal(RefusalCode::UnknownData, text)
}

/// Returns text of a peer in a form that is safe to show: without control characters, and
/// shortened.
pub(crate) fn quote_text(text: &str) -> String {
    const SHOWN: usize = 80;
    let shown: String = text.chars().take(SHOWN).flat_map(char::escape_debug).collect();
    let more = if text.chars().nth(SHOWN).is_some() { "…" } else { "" };
    format!("`{shown}{more}`")
}
