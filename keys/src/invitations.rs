//! Invitations of people to the page of a robot, and the sessions of their browsers: what is stored,
//! and what is accepted when. Pure: the time is an argument, and the secrets are made elsewhere.
//!
//! Only hashes of secrets are stored. The secrets are random and long, so that a hash without salt
//! reveals nothing about them.

use std::fmt::Write;
use std::hint::black_box;

use armor_wire::acting::KeyRole;
use armor_wire::name::is_name;
use ring::digest::{SHA256, digest};
use thiserror::Error;

use crate::expiry::{DAY_S, format_time};

/// Most invitations that are stored; those that ended are removed first.
pub const MAX_INVITATIONS: usize = 256;
/// Most browsers that one invitation admits.
pub const MAX_DEVICES: u32 = 16;
/// Longest time of an invitation. Who needs access for longer gets a key, or another invitation.
pub const LONGEST_S: i64 = 90 * DAY_S;
/// An invitation that has ended is listed for this long.
pub const LISTED_S: i64 = 7 * DAY_S;
/// A browser that got no answer may log in again for this long without using another place. Longer
/// than a person walks back to the network; shorter than a device is lent.
pub const REPEATED_WITHIN_S: i64 = 600;
/// What to do about a wrong clock, on the host that has it.
pub const CLOCK_REMEDY: &str = "set the clock of the robot: `timedatectl set-ntp true`, or without a \
                                network `date -s \"2030-12-31 23:59\"`, both as root";
/// How far a clock may have been set back before an invitation is not valid yet.
const CLOCK_MARGIN_S: i64 = 300;
/// Bytes of a secret: 160 random bits.
pub const SECRET_LEN: usize = 20;
const HASH_LEN: usize = 32;

/// A secret of an invitation or a session, as the browser has it.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret([u8; SECRET_LEN]);

impl Secret {
    /// Returns the secret of these random bytes.
    pub fn new(bytes: [u8; SECRET_LEN]) -> Self {
        Self(bytes)
    }

    /// Reads what [`Self::to_text`] returns.
    pub fn from_text(text: &str) -> Option<Self> {
        read_hex(text).map(Self)
    }

    /// Returns it as digits, for a link or a cookie.
    pub fn to_text(&self) -> String {
        write_hex(&self.0)
    }

    fn hash(&self) -> SecretHash {
        let mut hash = [0; HASH_LEN];
        hash.copy_from_slice(digest(&SHA256, &self.0).as_ref());
        SecretHash(hash)
    }
}

// A secret is never printed by accident.
impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secret(…)")
    }
}

/// What is stored of a secret.
#[derive(Clone, Debug)]
struct SecretHash([u8; HASH_LEN]);

impl SecretHash {
    /// Compares without revealing by its time how many bytes agree.
    fn is(&self, other: &Self) -> bool {
        let differences = self.0.iter().zip(&other.0).map(|(a, b)| black_box(a ^ b));
        black_box(differences.fold(0, |all, one| all | one)) == 0
    }
}

/// An invitation.
#[derive(Clone, Debug)]
pub struct Invitation {
    /// Its number in the list.
    pub id: u32,
    /// The person.
    pub name: String,
    /// What the person may do.
    pub role: KeyRole,
    /// When it was made, in seconds since 1970.
    pub made_s: i64,
    /// Until when its link and its sessions are valid, in seconds since 1970.
    pub until_s: i64,
    /// How many browsers it admits.
    pub devices: u32,
    /// How many it has admitted.
    pub used: u32,
    /// Whether it was revoked.
    pub is_revoked: bool,
    secret: SecretHash,
}

/// The state of an invitation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvitationState {
    /// Its link admits a browser.
    Open,
    /// All its browsers are admitted; their sessions are valid.
    Used,
    /// It was revoked.
    Revoked,
    /// Its time is over.
    Expired,
    /// It was made later than this host's clock shows.
    Later,
}

impl InvitationState {
    /// Its name, as lists have it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Used => "used",
            Self::Revoked => "revoked",
            Self::Expired => "expired",
            Self::Later => "not valid yet",
        }
    }
}

impl Invitation {
    /// Returns the state at this time.
    pub fn state(&self, now_s: i64) -> InvitationState {
        if self.is_revoked {
            InvitationState::Revoked
        } else if now_s >= self.until_s {
            InvitationState::Expired
        } else if now_s < self.made_s.saturating_sub(CLOCK_MARGIN_S) {
            InvitationState::Later
        } else if self.used >= self.devices {
            InvitationState::Used
        } else {
            InvitationState::Open
        }
    }

    /// Whether its sessions are valid in this state.
    fn check(&self, state: InvitationState) -> Result<(), AccessFault> {
        match state {
            InvitationState::Open | InvitationState::Used => Ok(()),
            InvitationState::Revoked => Err(AccessFault::Revoked),
            InvitationState::Expired => Err(AccessFault::Expired { at_s: self.until_s }),
            InvitationState::Later => Err(AccessFault::Later),
        }
    }
}

/// The session of a browser.
#[derive(Clone, Debug)]
struct Session {
    /// The number of the invitation.
    invitation: u32,
    made_s: i64,
    secret: SecretHash,
    /// What the browser drew before it logged in, and sends again if it gets no answer.
    attempt: Option<SecretHash>,
}

/// A person who is logged in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Visitor {
    /// The name in the invitation.
    pub name: String,
    /// The role in the invitation.
    pub role: KeyRole,
    /// Until when the session is valid, in seconds since 1970.
    pub until_s: i64,
    /// The number of the invitation.
    pub invitation: u32,
}

/// Why an invitation is not made or not accepted, or a browser is not logged in.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum AccessFault {
    /// No such secret was given out, or it was removed since.
    #[error("it is unknown here: it was mistyped, made on another robot, or has long ended")]
    Unknown,
    /// The browsers that the invitation admits have used it.
    #[error("it has been used already; a link admits as many browsers as it was made for")]
    Used,
    /// It was revoked.
    #[error("it was revoked")]
    Revoked,
    /// Its time is over.
    #[error("it expired at {time}", time = format_time(*at_s))]
    Expired {
        /// Since when, in seconds since 1970.
        at_s: i64,
    },
    /// The clock is wrong.
    #[error("the robot's clock shows a time before it was made: {remedy}", remedy = CLOCK_REMEDY)]
    Later,
}

/// What an invitation is made for.
#[derive(Clone, Debug)]
pub struct InvitationOrder {
    /// The person.
    pub name: String,
    /// What the person may do.
    pub role: KeyRole,
    /// For how long, in seconds.
    pub for_s: i64,
    /// How many browsers it admits.
    pub devices: u32,
}

/// All invitations of a robot with their sessions.
#[derive(Clone, Debug, Default)]
pub struct Invitations {
    invitations: Vec<Invitation>,
    sessions: Vec<Session>,
}

impl Invitations {
    /// Returns the invitations, the oldest first.
    pub fn list(&self) -> &[Invitation] {
        &self.invitations
    }

    /// Returns how many sessions an invitation has.
    pub fn count_sessions(&self, invitation: u32) -> usize {
        self.sessions.iter().filter(|session| session.invitation == invitation).count()
    }

    /// Adds an invitation whose link has `secret`.
    ///
    /// # Errors
    /// In words, if the name, time or number of browsers is wrong, or too many are stored.
    pub fn invite(
        &mut self,
        order: &InvitationOrder,
        secret: &Secret,
        now_s: i64,
    ) -> Result<&Invitation, String> {
        let InvitationOrder { name, role, for_s, devices } = order;
        if !is_name(name) {
            return Err(format!(
                "{name:?} is not a name: letters, digits, _ and -, a letter first, at most 64"
            ));
        }
        if !(1..=LONGEST_S).contains(for_s) {
            let days = LONGEST_S / DAY_S;
            return Err(format!(
                "an invitation is for a second to {days} days ({days}d); for longer, make a key with \
                 `armor keys add`"
            ));
        }
        if !(1..=MAX_DEVICES).contains(devices) {
            return Err(format!("an invitation admits 1 to {MAX_DEVICES} browsers"));
        }
        self.remove_ended(now_s);
        if self.invitations.len() >= MAX_INVITATIONS {
            return Err(format!(
                "{MAX_INVITATIONS} invitations are stored, which is the most: `armor keys list` \
                 shows them, `armor keys revoke NAME` ends those of a person"
            ));
        }
        let id = self.invitations.iter().map(|it| it.id).max().unwrap_or(0).wrapping_add(1);
        self.invitations.push(Invitation {
            id,
            name: name.clone(),
            role: *role,
            made_s: now_s,
            until_s: now_s.saturating_add(*for_s),
            devices: *devices,
            used: 0,
            is_revoked: false,
            secret: secret.hash(),
        });
        Ok(&self.invitations[self.invitations.len() - 1])
    }

    /// Returns the number of the invitation with this secret, in whatever state it is.
    pub fn find_invitation(&self, secret: &Secret) -> Option<u32> {
        let hash = secret.hash();
        // All are compared: the time does not depend on which one it is.
        let compare =
            |found, it: &Invitation| if it.secret.is(&hash) { Some(it.id) } else { found };
        self.invitations.iter().fold(None, compare)
    }

    /// Exchanges the secret of a link for a session with the secret `session`. If the browser has sent
    /// the same `attempt` within [`REPEATED_WITHIN_S`], its answer was lost: the session of that time
    /// gets the new secret, and no other place is used. Another browser does not know the attempt,
    /// so that the link alone gives it nothing.
    ///
    /// # Errors
    /// Why the invitation is not accepted.
    pub fn redeem(
        &mut self,
        secret: &Secret,
        session: &Secret,
        attempt: Option<&Secret>,
        now_s: i64,
    ) -> Result<Visitor, AccessFault> {
        let id = self.find_invitation(secret).ok_or(AccessFault::Unknown)?;
        let invitation = self.invitations.iter_mut().find(|it| it.id == id);
        let invitation = invitation.ok_or(AccessFault::Unknown)?;
        let state = invitation.state(now_s);
        invitation.check(state)?;
        let attempt = attempt.map(Secret::hash);
        for session in &mut self.sessions {
            if !(0..=REPEATED_WITHIN_S).contains(&now_s.saturating_sub(session.made_s)) {
                session.attempt = None;
            }
        }
        let is_repeated = |it: &&mut Session| {
            let same = it.attempt.as_ref().zip(attempt.as_ref());
            it.invitation == id && same.is_some_and(|(before, now)| before.is(now))
        };
        if let Some(repeated) = self.sessions.iter_mut().find(is_repeated) {
            repeated.secret = session.hash();
            return Ok(describe_visitor(invitation));
        }
        if state == InvitationState::Used {
            return Err(AccessFault::Used);
        }
        invitation.used += 1;
        let secret = session.hash();
        self.sessions.push(Session { invitation: id, made_s: now_s, secret, attempt });
        Ok(describe_visitor(invitation))
    }

    /// Returns who has the session with this secret.
    ///
    /// # Errors
    /// Why it is not valid.
    pub fn find_visitor(&self, session: &Secret, now_s: i64) -> Result<Visitor, AccessFault> {
        let hash = session.hash();
        let compare = |found, it| if Session::is(it, &hash) { Some(it) } else { found };
        let found = self.sessions.iter().fold(None, compare).ok_or(AccessFault::Unknown)?;
        let invitation = self.invitations.iter().find(|it| it.id == found.invitation);
        let invitation = invitation.ok_or(AccessFault::Unknown)?;
        invitation.check(invitation.state(now_s))?;
        Ok(describe_visitor(invitation))
    }

    /// Ends the session with this secret. The invitation does not admit another browser for it.
    pub fn log_out(&mut self, session: &Secret) {
        let hash = session.hash();
        self.sessions.retain(|session| !session.is(&hash));
    }

    /// Revokes all invitations of a name that are valid, with their sessions; returns their number.
    pub fn revoke(&mut self, name: &str, now_s: i64) -> usize {
        let is_valid = |it: &Invitation| it.check(it.state(now_s)).is_ok();
        // One that a wrong clock hides is revoked, too.
        let ends = |it: &Invitation| is_valid(it) || it.state(now_s) == InvitationState::Later;
        let of_name = self.invitations.iter_mut().filter(|it| it.name == name && ends(it));
        of_name.map(|it| it.is_revoked = true).count()
    }

    /// Removes what ended long ago.
    fn remove_ended(&mut self, now_s: i64) {
        self.invitations.retain(|it| now_s < it.until_s.saturating_add(LISTED_S));
        if self.invitations.len() >= MAX_INVITATIONS {
            let ended = |it: &Invitation| {
                matches!(it.state(now_s), InvitationState::Expired | InvitationState::Revoked)
            };
            self.invitations.retain(|it| !ended(it));
        }
        let known: Vec<_> = self.invitations.iter().map(|it| it.id).collect();
        self.sessions.retain(|session| known.contains(&session.invitation));
    }

    /// Returns the text of the file.
    pub fn to_text(&self) -> String {
        let mut text = String::from(
            "# Invitations to the page of this robot, and the sessions of browsers. `armor keys` and \
             the server write it: secrets are stored as hashes only.\n",
        );
        for it in &self.invitations {
            let Invitation { id, name, role, made_s, until_s, devices, used, .. } = it;
            let state = if it.is_revoked { "revoked" } else { "given" };
            let hash = write_hex(&it.secret.0);
            let _ = writeln!(
                text,
                "invitation {id} {name} {role} {made_s} {until_s} {devices} {used} {state} {hash}"
            );
        }
        for Session { invitation, made_s, secret, attempt } in &self.sessions {
            let _ = write!(text, "session {invitation} {made_s} {}", write_hex(&secret.0));
            let attempt = attempt.as_ref().map(|attempt| format!(" {}", write_hex(&attempt.0)));
            let _ = writeln!(text, "{}", attempt.unwrap_or_default());
        }
        text
    }

    /// Reads the text of the file.
    ///
    /// # Errors
    /// The first line that is none of this file's.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let mut read = Self::default();
        for (at, line) in text.lines().enumerate() {
            let words: Vec<_> = line.split_whitespace().collect();
            let wrong = || format!("line {} is not one of `armor keys`", at + 1);
            match words[..] {
                [] => {}
                [first, ..] if first.starts_with('#') => {}
                ["invitation", ..] => {
                    read.invitations.push(parse_invitation(&words).ok_or_else(wrong)?);
                }
                ["session", invitation, made_s, hash, ref attempt @ ..] => {
                    let session = (|| {
                        let attempt = match attempt {
                            [] => None,
                            [hash] => Some(SecretHash(read_hex(hash)?)),
                            _ => return None,
                        };
                        Some(Session {
                            invitation: invitation.parse().ok()?,
                            made_s: made_s.parse().ok()?,
                            secret: SecretHash(read_hex(hash)?),
                            attempt,
                        })
                    })();
                    read.sessions.push(session.ok_or_else(wrong)?);
                }
                _ => return Err(wrong()),
            }
        }
        Ok(read)
    }
}

impl Session {
    fn is(&self, hash: &SecretHash) -> bool {
        self.secret.is(hash)
    }
}

fn describe_visitor(invitation: &Invitation) -> Visitor {
    let Invitation { id, name, role, until_s, .. } = invitation;
    Visitor { name: name.clone(), role: *role, until_s: *until_s, invitation: *id }
}

fn parse_invitation(words: &[&str]) -> Option<Invitation> {
    let [_, id, name, role, made_s, until_s, devices, used, state, hash] = *words else {
        return None;
    };
    Some(Invitation {
        id: id.parse().ok()?,
        name: is_name(name).then(|| name.to_owned())?,
        role: role.parse().ok()?,
        made_s: made_s.parse().ok()?,
        until_s: until_s.parse().ok()?,
        devices: devices.parse().ok()?,
        used: used.parse().ok()?,
        is_revoked: match state {
            "revoked" => true,
            "given" => false,
            _ => return None,
        },
        secret: SecretHash(read_hex(hash)?),
    })
}

fn write_hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn read_hex<const LEN: usize>(text: &str) -> Option<[u8; LEN]> {
    if text.len() != 2 * LEN || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let mut bytes = [0; LEN];
    for (at, byte) in bytes.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * at..2 * at + 2], 16).ok()?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests;
