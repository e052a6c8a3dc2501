//! `armor keys`: the authority of a fleet, the keys of its robots and people, and invitations to the
//! page of a robot.

mod certificate;
mod invitations;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use armor_keys::expiry::{describe_notice, format_date, now_s};
use armor_keys::folder::{
    AddedKey, KEYS_VARIABLE, KeyState, ListedKey, REVOKED, find_keys_folder, has_authority,
};
use armor_keys::invitation_file::InvitationFile;
use armor_keys::{CertificateFacts, HostKeys, KeyHolder, KeyPurpose, KeysFolder, NewKey, SiteName};
use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::arguments::{OutputFormat, parse_name};
use crate::exit::CommandEnding;
use crate::print::{Table, end_printing, print_line, print_notice, print_wrapped, terminal_width};
use crate::verb::Verb;
use certificate::CertificateArguments;
use invitations::InviteArguments;

/// How long a key is valid by default.
const DAYS: u32 = 365;
/// The port of a page for other hosts, unless the link of an invitation is to have another one.
pub(crate) const PAGE_PORT: u16 = 8443;

/// Make, list, renew and revoke the keys and invitations with which people reach robots.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  armor keys init                          an authority, on the computer of the person who decides about access
  armor keys add robot --role host         the key of a robot's gate
  armor keys add alice --role operator     a key for alice, in one file
  armor keys revoke alice
  armor keys invite bob --role operator    on a robot: a link for bob's phone, valid for 12 hours

The secret key of the authority never needs to be on a robot.")]
pub enum KeysCommand {
    /// Make an authority: its key makes all others.
    Init(InitArguments),
    /// Make a key for a person or a robot's host, in one file that is carried there.
    Add(AddArguments),
    /// List the keys that were made, and when they expire.
    List(ListArguments),
    /// Revoke the keys and invitations of a name. Its connections end within a second.
    Revoke(RevokeArguments),
    /// Make a new key for a name. The old one stays valid until its own end.
    Renew(RenewArguments),
    /// Invite a person to the page of this robot: a link for a browser, such as that of a phone.
    Invite(InviteArguments),
    /// Write the certificate of the authority, which browsers are to trust, into a file.
    Certificate(CertificateArguments),
}

/// Selects the folder of keys.
#[derive(Args, Clone, Debug)]
pub struct KeysDirectory {
    /// Folder of keys. Default: armor/keys in the folder for configuration of this user.
    #[arg(long, value_name = "DIR", env = "ARMOR_KEYS")]
    pub keys: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct InitArguments {
    #[command(flatten)]
    pub directory: KeysDirectory,
}

#[derive(Args, Debug)]
pub struct AddArguments {
    /// Name of the person or host.
    #[arg(value_parser = parse_name)]
    pub name: String,
    /// What the key allows: observer, operator, engineer; host is for a robot's gate.
    #[arg(long, value_name = "ROLE")]
    pub role: KeyPurpose,
    /// Number of days for which it is valid.
    #[arg(long, value_name = "N", default_value_t = DAYS, value_parser = clap::value_parser!(u32).range(1..))]
    pub days: u32,
    /// A name or address under which browsers open the robot's page, such as robot.local or
    /// 192.168.0.7; may be given several times.
    #[arg(long = "at", value_name = "ADDRESS")]
    pub sites: Vec<SiteName>,
    #[command(flatten)]
    pub directory: KeysDirectory,
}

#[derive(Args, Debug)]
pub struct ListArguments {
    #[command(flatten)]
    pub directory: KeysDirectory,
}

#[derive(Args, Debug)]
pub struct RevokeArguments {
    /// Name of the person or host.
    #[arg(value_parser = parse_name)]
    pub name: String,
    #[command(flatten)]
    pub directory: KeysDirectory,
}

#[derive(Args, Debug)]
pub struct RenewArguments {
    /// Name of the person or host.
    #[arg(value_parser = parse_name)]
    pub name: String,
    /// Number of days for which the new key is valid.
    #[arg(long, value_name = "N", default_value_t = DAYS, value_parser = clap::value_parser!(u32).range(1..))]
    pub days: u32,
    /// A name or address under which browsers open the robot's page, such as robot.local or
    /// 192.168.0.7; may be given several times, and replaces those of the old key. Default: those of
    /// the old key.
    #[arg(long = "at", value_name = "ADDRESS")]
    pub sites: Vec<SiteName>,
    #[command(flatten)]
    pub directory: KeysDirectory,
}

impl KeysDirectory {
    /// Returns the folder.
    ///
    /// # Errors
    /// If none is given and the user has no home.
    pub fn path(&self) -> Result<PathBuf> {
        let own = self.keys.clone().or_else(find_keys_folder);
        own.context("HOME is not set: give --keys DIR")
    }

    /// Returns the variable with which a process uses the folder that was given here, if one was.
    pub fn variable(&self) -> Option<(OsString, OsString)> {
        let folder = self.keys.as_ref()?;
        // The process may have another working directory.
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
        Some((KEYS_VARIABLE.into(), folder.into()))
    }
}

impl Verb for KeysCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(run_command(&self, format)?.into())
    }
}

/// Carries out a command.
///
/// # Errors
/// If the folder cannot be used, or the request makes no sense there.
fn run_command(command: &KeysCommand, format: OutputFormat) -> Result<CommandEnding> {
    end_printing(match command {
        KeysCommand::Init(arguments) => make_authority(arguments, format),
        KeysCommand::Add(arguments) => {
            let holder = KeyHolder { name: arguments.name.clone(), purpose: arguments.role };
            let folder = KeysFolder::open(&arguments.directory.path()?)?;
            let new = NewKey { holder, sites: arguments.sites.clone() };
            let added = folder.add_key(new, arguments.days, now_s())?;
            print_added(&added, format)
        }
        KeysCommand::List(arguments) => print_keys(arguments, format),
        KeysCommand::Revoke(arguments) => revoke_keys(arguments, format),
        KeysCommand::Renew(arguments) => {
            let folder = KeysFolder::open(&arguments.directory.path()?)?;
            let RenewArguments { name, sites, days, .. } = arguments;
            let before = folder.list_keys(now_s())?;
            let added = folder.renew_key(name, sites, *days, now_s())?;
            print_added(&added, format)?;
            let before = before.iter().rev().find(|key| key.facts.holder.name == *name);
            let text = before.and_then(|before| compare_sites(&before.facts, &added.facts));
            match text.filter(|_| format == OutputFormat::Text) {
                Some(text) => print_wrapped(text),
                None => Ok(()),
            }
        }
        KeysCommand::Invite(arguments) => invitations::invite(arguments, format),
        KeysCommand::Certificate(arguments) => certificate::write_certificate(arguments, format),
    })
}

fn make_authority(arguments: &InitArguments, format: OutputFormat) -> Result<()> {
    let path = arguments.directory.path()?;
    let folder = KeysFolder::create(&path, now_s())?;
    let end = format_date(folder.authority_end_s()?);
    if format == OutputFormat::Json {
        return print_line(json!({"keys": path, "valid_until": end}));
    }
    print_wrapped(format_args!(
        "an authority, valid until {end}, is in {}; keep a backup of this folder, and keep it off \
         the robots",
        path.display()
    ))
}

fn print_added(added: &AddedKey, format: OutputFormat) -> Result<()> {
    let AddedKey { facts, path } = added;
    if format == OutputFormat::Json {
        let mut record = describe_key(facts);
        record["file"] = json!(path);
        return print_line(record);
    }
    let (path, end) = (path.display(), format_date(facts.not_after_s));
    print_line(format_args!("{path}: the key of {}, valid until {end}", facts.holder))?;
    print_wrapped(match facts.holder.purpose {
        KeyPurpose::Host => format!(
            "copy it with the list `{REVOKED}` into a folder of the robot's user that only that \
             user can enter (mode 0700), then: armor run FILE --gate 0.0.0.0:7410 --keys DIR; \
             or, to run components of a system of another host: armor host --from HOST --keys \
             DIR{}",
            if facts.sites.is_empty() {
                ""
            } else {
                "; or, to serve the page to phones: armor web --listen 0.0.0.0:8443 --keys DIR"
            }
        ),
        KeyPurpose::Person(_) => format!(
            "it is secret: carry it to the computer of {name} (scp, a USB stick), and remove it \
             here; {name} then connects with: armor connect ROBOT:7410 --key FILE",
            name = facts.holder.name
        ),
    })
}

/// What became of the addresses for browsers in a key that was renewed.
fn compare_sites(before: &CertificateFacts, renewed: &CertificateFacts) -> Option<String> {
    let list = |sites: &[&SiteName]| {
        let sites: Vec<_> = sites.iter().map(ToString::to_string).collect();
        sites.join(", ")
    };
    let kept: Vec<_> = renewed.sites.iter().collect();
    let lost: Vec<_> = before.sites.iter().filter(|site| !renewed.sites.contains(site)).collect();
    match (kept.is_empty(), lost.is_empty()) {
        (true, _) => None,
        (false, true) if before.sites == renewed.sites => {
            Some(format!("browsers open its page as before, at {}", list(&kept)))
        }
        (false, true) => Some(format!("browsers open its page at {}", list(&kept))),
        (false, false) => Some(format!(
            "browsers open its page at {}, and no longer at {}: --at replaces all addresses of the \
             old key",
            list(&kept),
            list(&lost)
        )),
    }
}

/// What a folder with the key of a host answers that has no invitations.
const NOTHING_YET: &str = "the folder of a robot's key, without invitations: `armor keys invite NAME \
                           --role ROLE` makes one; keys are listed and revoked where the authority is";

fn print_keys(arguments: &ListArguments, format: OutputFormat) -> Result<()> {
    let path = arguments.directory.path()?;
    // On a robot there are invitations and no authority.
    let has_invitations = InvitationFile::exists_in(&path);
    let host = if has_authority(&path) { None } else { HostKeys::read(&path).ok() };
    match &host {
        Some(host) => print_host_key(host, format)?,
        None if has_authority(&path) || !has_invitations => {
            print_own_keys(&KeysFolder::open(&path)?, format)?;
        }
        None => {}
    }
    if has_invitations {
        return invitations::print_invitations(&path, format);
    }
    if host.is_some() {
        print_notice(format_args!("{}: {NOTHING_YET}", path.display()));
    }
    Ok(())
}

/// Prints the key of this host, with the fingerprint that a browser shows.
fn print_host_key(host: &HostKeys, format: OutputFormat) -> Result<()> {
    let (facts, fingerprint, now_s) = (host.facts(), host.fingerprint(), now_s());
    let state = if host.is_revoked() {
        KeyState::Revoked
    } else if facts.not_after_s < now_s {
        KeyState::Expired
    } else {
        KeyState::Valid
    };
    if format == OutputFormat::Json {
        let mut record = describe_key(&facts);
        record["state"] = json!(word_for(state));
        record["fingerprint"] = json!(fingerprint);
        return print_line(record);
    }
    let sites: Vec<_> = facts.sites.iter().map(SiteName::to_string).collect();
    let at = if sites.is_empty() { String::new() } else { format!(", at {}", sites.join(", ")) };
    print_line(format_args!(
        "the key of this host: {}{at}, {} until {}\nSHA-256 {fingerprint}",
        facts.holder,
        word_for(state),
        format_date(facts.not_after_s)
    ))?;
    if state != KeyState::Revoked
        && let Some(text) = describe_notice(&facts.holder.name, facts.not_after_s, now_s)
    {
        print_notice(format_args!("warning: {text}"));
    }
    Ok(())
}

fn print_own_keys(folder: &KeysFolder, format: OutputFormat) -> Result<()> {
    let keys = folder.list_keys(now_s())?;
    if format == OutputFormat::Json {
        return keys.iter().try_for_each(|key| {
            let mut record = describe_key(&key.facts);
            record["state"] = json!(word_for(key.state));
            print_line(record)
        });
    }
    let rows = keys.iter().map(|ListedKey { facts, state }| {
        vec![
            facts.holder.name.clone(),
            facts.holder.purpose.to_string(),
            format_date(facts.not_after_s),
            word_for(*state).to_owned(),
            facts.serial.to_string(),
        ]
    });
    let headings = ["NAME", "ROLE", "VALID UNTIL", "STATE", "SERIAL NUMBER"];
    let table = Table::new(&headings, rows.collect()).dispensable(&["SERIAL NUMBER"]);
    print_line(table.format(terminal_width()).trim_end())?;
    for text in list_notices(&keys) {
        print_notice(format_args!("warning: {text}"));
    }
    Ok(())
}

/// Announces the ends of the newest keys of each name.
fn list_notices(keys: &[ListedKey]) -> Vec<String> {
    let newest = keys.iter().enumerate().filter(|(at, key)| {
        let name = &key.facts.holder.name;
        !keys[at + 1..].iter().any(|later| later.facts.holder.name == *name)
    });
    let newest = newest.filter(|(_, key)| key.state != KeyState::Revoked);
    let notice =
        |facts: &CertificateFacts| describe_notice(&facts.holder.name, facts.not_after_s, now_s());
    newest.filter_map(|(_, key)| notice(&key.facts)).collect()
}

fn revoke_keys(arguments: &RevokeArguments, format: OutputFormat) -> Result<()> {
    let path = arguments.directory.path()?;
    let ended = invitations::revoke(&path, &arguments.name, format)?;
    if !has_authority(&path) {
        return match ended {
            Some(1..) => Ok(()),
            Some(0) => bail!("{} has no valid invitation here", arguments.name),
            None if HostKeys::read(&path).is_ok() => bail!("{}: {NOTHING_YET}", path.display()),
            None => KeysFolder::open(&path).map(drop).map_err(Into::into),
        };
    }
    let folder = KeysFolder::open(&path)?;
    let revoked = match folder.revoke_keys(&arguments.name, now_s()) {
        // A person may have an invitation and no key.
        Err(_) if ended.is_some_and(|count| count > 0) => return Ok(()),
        revoked => revoked?,
    };
    if format == OutputFormat::Json {
        return revoked.iter().try_for_each(|facts| print_line(describe_key(facts)));
    }
    let is_host = |facts: &CertificateFacts| facts.holder.purpose == KeyPurpose::Host;
    if revoked.iter().any(is_host) {
        return print_wrapped(format_args!(
            "{0}: the key is marked as revoked, but `armor connect` reads no list of revoked keys. If \
             it was stolen, its holder can pass for the gate of {0}: make another authority in \
             another folder, and new keys for everyone",
            arguments.name
        ));
    }
    let count = match revoked.len() {
        1 => "its key".to_owned(),
        count => format!("its {count} keys"),
    };
    print_wrapped(format_args!(
        "{}: {count} can no longer be used where {} is in the folder of the gate's keys; copy it to \
         every robot, which need not be restarted",
        arguments.name,
        path.join(REVOKED).display()
    ))
}

fn describe_key(facts: &CertificateFacts) -> Value {
    json!({
        "name": facts.holder.name,
        "role": facts.holder.purpose.to_string(),
        "valid_until": format_date(facts.not_after_s),
        "serial": facts.serial.to_string(),
        "at": facts.sites.iter().map(SiteName::to_string).collect::<Vec<_>>(),
    })
}

fn word_for(state: KeyState) -> &'static str {
    match state {
        KeyState::Valid => "valid",
        KeyState::Revoked => "revoked",
        KeyState::Expired => "expired",
    }
}
