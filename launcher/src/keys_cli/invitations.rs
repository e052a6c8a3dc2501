//! Invitations to the page of a robot, in the folder of keys on the robot's host.

use std::io::{IsTerminal, stdout};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use armor_keys::expiry::{format_time, now_s};
use armor_keys::folder::FolderError;
use armor_keys::invitation_file::{InvitationFile, draw_secret};
use armor_keys::invitations::{
    CLOCK_REMEDY, Invitation, InvitationOrder, Invitations, MAX_DEVICES,
};
use armor_keys::page_port::read_page_port;
use armor_keys::{HostKeys, SiteName};
use armor_wire::acting::KeyRole;
use clap::Args;
use qrcode::QrCode;
use serde_json::{Value, json};

use super::{KeysDirectory, PAGE_PORT};
use crate::arguments::{OutputFormat, parse_access_time, parse_name};
use crate::print::{Table, print_line, print_wrapped, terminal_width};

#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor keys invite bob --role operator                  until 12 hours from now, for one browser
  armor keys invite bob --role observer --for 3d --devices 2
  armor keys invite bob --role operator --at robot.local:9000

Run it on the robot's host. The first who opens the link is logged in as this person: send it over a
private channel, or let the phone read the code from the terminal.")]
pub struct InviteArguments {
    /// Name of the person, under which their orders are journaled.
    #[arg(value_parser = parse_name)]
    name: String,
    /// What the person may do: observer, operator, engineer.
    #[arg(long, value_name = "ROLE")]
    role: KeyRole,
    /// For how long the link and the sessions of its browsers are valid, such as 30min, 12h or 3d.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_access_time, default_value = "12h")]
    time: Duration,
    /// How many browsers the link logs in.
    #[arg(long, value_name = "N", default_value_t = 1,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_DEVICES)))]
    devices: u32,
    /// The address in the link: one that the key of this host names, and the port of the page. Default:
    /// the first of the key, and the port on which the page was served last, 8443 before the first time.
    #[arg(long, value_name = "ADDRESS[:PORT]")]
    at: Option<String>,
    #[command(flatten)]
    directory: KeysDirectory,
}

/// Makes an invitation and prints its link.
pub(super) fn invite(arguments: &InviteArguments, format: OutputFormat) -> Result<()> {
    let InviteArguments { name, role, time, devices, at, directory } = arguments;
    let folder = directory.path()?;
    let keys = HostKeys::read(&folder).context(
        "invitations are made on the robot's host, in the folder with the key of the host",
    )?;
    let port = read_page_port(&folder).unwrap_or(PAGE_PORT);
    let address = choose_address(&keys, at.as_deref(), port)?;
    let (secret, now_s) = (draw_secret()?, now_s());
    check_clock(&keys, now_s)?;
    let for_s = i64::try_from(time.as_secs()).unwrap_or(i64::MAX);
    let order = InvitationOrder { name: name.clone(), role: *role, for_s, devices: *devices };
    let invitation = InvitationFile::open(&folder)?
        .change(|all| all.invite(&order, &secret, now_s).cloned().map_err(FolderError::Refused))?;
    let link = format!("https://{address}/#invite={}", secret.to_text());
    if format == OutputFormat::Json {
        let mut record = describe_invitation(&invitation, 0, now_s);
        record["link"] = json!(link);
        return print_line(record);
    }
    print_line(&link)?;
    if stdout().is_terminal() {
        print_line(draw_code(&link)?)?;
    }
    let browsers = match devices {
        1 => "the first browser that opens it is".to_owned(),
        count => format!("the first {count} browsers that open it are"),
    };
    print_wrapped(format_args!(
        "{browsers} logged in as {name} ({role}) until {}; `armor keys revoke {name}` ends that. The \
         link is secret",
        format_time(invitation.until_s)
    ))
}

/// Checks that the key of this host is valid now: an invitation of a host with a wrong clock would be
/// for another time.
fn check_clock(keys: &HostKeys, now_s: i64) -> Result<()> {
    let (facts, name) = (keys.facts(), keys.host_name());
    if now_s < facts.not_before_s {
        bail!(
            "this host's clock shows {}, and the key of {name} is valid from {}: {CLOCK_REMEDY}",
            format_time(now_s),
            format_time(facts.not_before_s)
        );
    }
    if facts.not_after_s < now_s {
        bail!(
            "the key of {name} expired at {} by this host's clock, so that no page is served: if the \
             clock is right, `armor keys renew {name}` where the authority's key is; otherwise \
             {CLOCK_REMEDY}",
            format_time(facts.not_after_s)
        );
    }
    Ok(())
}

/// Returns host and port for the link; `port` is that of an address without one.
fn choose_address(keys: &HostKeys, at: Option<&str>, port: u16) -> Result<String> {
    let (sites, name) = (keys.facts().sites, keys.host_name());
    let named: Vec<_> = sites.iter().map(SiteName::to_string).collect();
    let Some(first) = sites.first() else {
        bail!(
            "the key of {name} has no name or address that a browser could open; where the \
             authority's key is: armor keys renew {name} --at ADDRESS"
        );
    };
    let Some(at) = at else { return Ok(format!("{}:{port}", first.to_host())) };
    match SiteName::from_host(at) {
        Some(site) if sites.contains(&site) && at == site.to_host() => Ok(format!("{at}:{port}")),
        Some(site) if sites.contains(&site) => Ok(at.to_owned()),
        _ => bail!(
            "--at {at}: the key of {name} does not name this address (it names {}); where the \
             authority's key is: armor keys renew {name} --at ADDRESS",
            named.join(", ")
        ),
    }
}

/// Draws the link so that a phone can read it: two squares of the code in one character.
fn draw_code(link: &str) -> Result<String> {
    let code = QrCode::new(link.as_bytes()).context("the link cannot be drawn")?;
    let width = code.width();
    let squares = code.to_colors();
    // Light squares are drawn, as terminals are mostly dark, with a margin of two.
    let is_light = |x: usize, y: usize| {
        let inside =
            x.checked_sub(2).zip(y.checked_sub(2)).filter(|(x, y)| *x < width && *y < width);
        inside.is_none_or(|(x, y)| squares[y * width + x] == qrcode::Color::Light)
    };
    let row = |y: usize| -> String {
        let squares = (0..width + 4).map(|x| match (is_light(x, y), is_light(x, y + 1)) {
            (true, true) => '█',
            (true, false) => '▀',
            (false, true) => '▄',
            (false, false) => ' ',
        });
        squares.collect()
    };
    let rows: Vec<_> = (0..width + 4).step_by(2).map(row).collect();
    Ok(rows.join("\n"))
}

/// Prints the invitations.
pub(super) fn print_invitations(folder: &Path, format: OutputFormat) -> Result<()> {
    let (file, now_s) = (InvitationFile::open(folder)?, now_s());
    let all = file.current();
    if format == OutputFormat::Json {
        let records = all.list().iter().map(|it| describe(&all, it, now_s));
        return records.into_iter().try_for_each(print_line);
    }
    let rows = all.list().iter().map(|it| {
        vec![
            it.name.clone(),
            it.role.to_string(),
            format_time(it.until_s),
            it.state(now_s).word().to_owned(),
            format!("{} of {}", it.used, it.devices),
            all.count_sessions(it.id).to_string(),
        ]
    });
    let headings = ["INVITED", "ROLE", "VALID UNTIL", "STATE", "USED", "SESSIONS"];
    let table = Table::new(&headings, rows.collect());
    print_line(table.format(terminal_width()).trim_end())
}

/// Revokes the invitations of a name, if there are any here; returns their number.
pub(super) fn revoke(folder: &Path, name: &str, format: OutputFormat) -> Result<Option<usize>> {
    if !InvitationFile::exists_in(folder) {
        return Ok(None);
    }
    let (file, now_s) = (InvitationFile::open(folder)?, now_s());
    let count = file.change(|all| Ok::<_, FolderError>(all.revoke(name, now_s)))?;
    if count == 0 {
        return Ok(Some(0));
    }
    if format == OutputFormat::Json {
        print_line(json!({"name": name, "invitations": count}))?;
    } else {
        let what = match count {
            1 => "the invitation is revoked".to_owned(),
            count => format!("{count} invitations are revoked"),
        };
        print_wrapped(format_args!("{name}: {what}; pages that use it close within a second"))?;
    }
    Ok(Some(count))
}

fn describe(all: &Invitations, invitation: &Invitation, now_s: i64) -> Value {
    describe_invitation(invitation, all.count_sessions(invitation.id), now_s)
}

fn describe_invitation(invitation: &Invitation, sessions: usize, now_s: i64) -> Value {
    json!({
        "invited": invitation.name,
        "role": invitation.role.name(),
        "valid_until": format_time(invitation.until_s),
        "state": invitation.state(now_s).word(),
        "used": invitation.used,
        "devices": invitation.devices,
        "sessions": sessions,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_is_a_square_with_a_margin() {
        let code = draw_code("https://robot.local:8443/#invite=0123456789").expect("a code");
        let rows: Vec<Vec<char>> = code.lines().map(|row| row.chars().collect()).collect();
        let width = rows[0].len();
        assert!(rows.iter().all(|row| row.len() == width), "{code}");
        assert_eq!(rows.len(), width.div_ceil(2));
        assert!(rows[0].iter().all(|it| *it == '█'), "{code}");
        // The corner of the finder pattern is dark, with its light ring inside.
        assert_eq!(rows[1][2..9].iter().collect::<String>(), " ▄▄▄▄▄ ", "{code}");
    }
}
