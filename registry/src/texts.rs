//! Every reason the registry gives for a "no", in words.

use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::name::{MAX_NAME_LEN, is_name};
use armor_wire::registry::{ComponentEntry, DataEntry};
use armor_wire::schema;

use crate::limits::{MAX_HOST_LEN, MAX_REFUSAL_LEN, MAX_SCHEMA_LEN, MAX_TYPE_NAME_LEN};

/// Names that only the program of that name may take.
const RESERVED: [&str; 5] = ["registry", "configd", "configuration", "executive", "launcher"];

pub(crate) fn refusal(code: RefusalCode, mut text: String) -> Refusal {
    if text.len() > MAX_REFUSAL_LEN {
        text.truncate(text.floor_char_boundary(MAX_REFUSAL_LEN));
        text.push('…');
    }
    Refusal::new(code, text)
}

pub(crate) fn malformed(text: impl Into<String>) -> Refusal {
    refusal(RefusalCode::Malformed, text.into())
}

pub(crate) fn limit(what: &str, most: usize) -> Refusal {
    refusal(RefusalCode::Limit, format!("there are {most} {what} already, and no more are kept"))
}

/// Where somebody runs: "lidar (kind sim, process 12 on robot, at 127.0.0.1:4000)".
pub(crate) fn whereabouts(entry: &ComponentEntry) -> String {
    let ComponentEntry { name, kind, pid, host, endpoint, .. } = entry;
    format!("`{name}` (kind {kind}, process {pid} on {host}, at {endpoint})")
}

/// Whether a process may register so.
pub(crate) fn check_component(entry: &ComponentEntry) -> Result<(), Refusal> {
    for (what, name) in [("name", &entry.name), ("kind", &entry.kind)] {
        if !is_name(name) {
            return Err(malformed(format!(
                "the {what} {} is not one: letters, digits, _ and -, a letter first, at most \
                 {MAX_NAME_LEN}",
                quoted(name)
            )));
        }
    }
    if RESERVED.contains(&entry.name.as_str()) && entry.kind != entry.name {
        return Err(malformed(format!(
            "the name `{}` is reserved for Armor's own program of that name",
            entry.name
        )));
    }
    if entry.host.len() > MAX_HOST_LEN || entry.host.chars().any(char::is_control) {
        return Err(malformed(format!("the host {} is not a host's name", quoted(&entry.host))));
    }
    if entry.endpoint.parse::<std::net::SocketAddr>().is_err() {
        return Err(malformed(format!(
            "the endpoint {} is not an address with a port",
            quoted(&entry.endpoint)
        )));
    }
    if entry.instance == 0 {
        return Err(malformed("instance 0 stands for any; a process start needs one of its own"));
    }
    Ok(())
}

/// Whether the process `owner` may publish this.
pub(crate) fn check_data(entry: &DataEntry, owner: &ComponentEntry) -> Result<(), Refusal> {
    let port = entry.data.strip_prefix(&owner.name).and_then(|rest| rest.strip_prefix('.'));
    if !port.is_some_and(is_name) {
        return Err(malformed(format!(
            "data of `{}` is named `{}.OUTPUT`, not {}",
            owner.name,
            owner.name,
            quoted(&entry.data)
        )));
    }
    if entry.type_name.is_empty()
        || entry.type_name.len() > MAX_TYPE_NAME_LEN
        || entry.type_name.chars().any(char::is_control)
    {
        return Err(malformed(format!(
            "the type of `{}` needs a name of 1 to {MAX_TYPE_NAME_LEN} bytes",
            entry.data
        )));
    }
    if entry.schema.len() > MAX_SCHEMA_LEN {
        return Err(refusal(
            RefusalCode::Limit,
            format!("the schema of `{}` is longer than {MAX_SCHEMA_LEN} bytes", entry.data),
        ));
    }
    schema::parse(&entry.schema)
        .map(|_| ())
        .map_err(|error| malformed(format!("the schema of `{}`: {error}", entry.data)))
}

pub(crate) fn duplicate_component(holder: &ComponentEntry) -> Refusal {
    refusal(
        RefusalCode::DuplicateName,
        format!("the name is taken by {}; stop that one or take another name", whereabouts(holder)),
    )
}

pub(crate) fn duplicate_data(data: &str, holder: &ComponentEntry) -> Refusal {
    refusal(
        RefusalCode::DuplicateName,
        format!("`{data}` is provided already, by {}", whereabouts(holder)),
    )
}

pub(crate) fn mismatch(
    asker: (&str, &str),
    entry: &DataEntry,
    provider: &ComponentEntry,
) -> Refusal {
    let difference = schema::difference(asker, (&provider.name, &entry.schema));
    refusal(
        RefusalCode::TypeMismatch,
        format!(
            "`{}` is of type {} at {}, and not what `{}` expects:\n{difference}",
            entry.data,
            entry.type_name,
            whereabouts(provider),
            asker.0
        ),
    )
}

pub(crate) fn unknown(data: &str, near: &[&str], component: Option<&ComponentEntry>) -> Refusal {
    let mut text = format!("nobody provides {}", quoted(data));
    if let Some(component) = component {
        text += &format!("; {} is there without that output", whereabouts(component));
    }
    if !near.is_empty() {
        text += &format!("; there is `{}`", near.join("`, `"));
    }
    refusal(RefusalCode::UnknownData, text)
}

/// What somebody sent, fit for a message: without control characters, and not too long.
pub(crate) fn quoted(text: &str) -> String {
    const SHOWN: usize = 80;
    let shown: String = text.chars().take(SHOWN).flat_map(char::escape_debug).collect();
    let more = if text.chars().nth(SHOWN).is_some() { "…" } else { "" };
    format!("`{shown}{more}`")
}
