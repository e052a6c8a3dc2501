//! Who sends a request, and what their role allows.

use std::convert::Infallible;

use armor_keys::expiry::{format_time, now_s};
use armor_keys::invitations::{AccessFault, CLOCK_REMEDY, Visitor};
use armor_sdk::control::Command;
use armor_wire::acting::{KeyRole, NeedsRole};
use axum::extract::{FromRequestParts, Request, State};
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::failure::WebFailure;

/// Who sends a request.
#[derive(Clone, Debug)]
pub(crate) enum Caller {
    /// The user of the system, on this host.
    Local,
    /// A person who is logged in.
    Visitor(Visitor),
    /// A person who is not; and why, if they have a session.
    Stranger(Option<AccessFault>),
}

impl Caller {
    /// The name of a person who is logged in; `None` for the user of the system.
    pub(crate) fn name(&self) -> Option<String> {
        match self {
            Self::Visitor(visitor) => Some(visitor.name.clone()),
            Self::Local | Self::Stranger(_) => None,
        }
    }

    /// Returns who an order is given by, if not by the user of the system: a person who is logged in
    /// cannot give one under another name.
    pub(crate) fn author(&self, claimed: Option<String>) -> Option<String> {
        self.name().or(claimed)
    }

    /// Checks whether the role allows a command.
    ///
    /// # Errors
    /// The refusal names the role that it needs.
    pub(crate) fn check_command(&self, command: &Command) -> Result<(), WebFailure> {
        let needed = command.needed_role();
        self.check_role(needed, &command.describe())
    }

    /// Checks whether the role suffices for something.
    ///
    /// # Errors
    /// The refusal names the role that it needs.
    fn check_role(&self, needed: Option<KeyRole>, what: &str) -> Result<(), WebFailure> {
        match self {
            Self::Local => Ok(()),
            Self::Visitor(visitor) if needed.is_some_and(|needed| visitor.role >= needed) => Ok(()),
            Self::Visitor(Visitor { name, role, .. }) => {
                let text = match needed {
                    Some(needed) => {
                        format!("{what} needs the role {needed}, and {name} has the role {role}")
                    }
                    None => format!("{what} is not for the page"),
                };
                Err(WebFailure::new(
                    StatusCode::FORBIDDEN,
                    text,
                    "the session",
                    "ask for an invitation with that role: `armor keys invite NAME --role ROLE`",
                ))
            }
            Self::Stranger(fault) => Err(describe_stranger(*fault)),
        }
    }

    /// Logs what a person has done that no journal has.
    pub(crate) fn log(&self, what: &str) {
        if let Self::Visitor(Visitor { name, role, .. }) = self {
            tracing::info!("{name} ({role}) {what}");
        }
    }
}

/// Returns why a stranger is refused.
pub(crate) fn describe_stranger(fault: Option<AccessFault>) -> WebFailure {
    let what = match fault {
        None | Some(AccessFault::Unknown | AccessFault::Used) => "you are not logged in".to_owned(),
        Some(AccessFault::Revoked) => "your invitation was revoked".to_owned(),
        Some(AccessFault::Expired { at_s }) => {
            format!("your invitation expired at {}", format_time(at_s))
        }
        Some(AccessFault::Later) => {
            format!(
                "the clock of the robot shows {}, a time before your invitation was made: \
                 {CLOCK_REMEDY}",
                format_time(now_s())
            )
        }
    };
    let remedy = "open the link of an invitation; on the robot `armor keys invite NAME --role ROLE` \
                  makes one";
    WebFailure::new(StatusCode::UNAUTHORIZED, what, "the session", remedy)
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        // The guard of all requests has put it there.
        Ok(parts.extensions.get().cloned().unwrap_or(Self::Stranger(None)))
    }
}

/// Refuses a request for which the role is too low.
pub(crate) async fn check_role(
    State((needed, what)): State<(KeyRole, &'static str)>,
    caller: Caller,
    request: Request,
    next: Next,
) -> Response {
    match caller.check_role(Some(needed), what) {
        Ok(()) => next.run(request).await,
        Err(failure) => failure.into_response(),
    }
}

#[cfg(test)]
mod tests {
    use armor_sdk::control::Order;

    use super::*;

    fn visitor(role: KeyRole) -> Caller {
        Caller::Visitor(Visitor { name: "alice".into(), role, until_s: 9, invitation: 1 })
    }

    #[test]
    fn a_person_of_the_page_may_order_what_their_role_allows_with_a_key() {
        let order = |order, take| Command::Order { request: 1, author: "x".into(), take, order };
        let fire = || Order::Fire { transition: "late".into() };
        for (role, command, is_allowed) in [
            (KeyRole::Observer, order(Order::Pause, false), true),
            (KeyRole::Observer, order(Order::Safe, false), true),
            (KeyRole::Observer, order(Order::Pause, true), false),
            (KeyRole::Observer, order(Order::Resume, false), false),
            (KeyRole::Observer, order(fire(), false), false),
            (KeyRole::Operator, order(fire(), true), true),
            (KeyRole::Engineer, Command::Terminate, false),
        ] {
            let checked = visitor(role).check_command(&command);
            assert_eq!(checked.is_ok(), is_allowed, "{role} {command:?} {checked:?}");
        }
        let refused = visitor(KeyRole::Observer).check_command(&order(fire(), false)).unwrap_err();
        let text = refused.to_json()["error"]["what"].to_string();
        assert!(
            text.contains("needs the role operator, and alice has the role observer"),
            "{text}"
        );
        assert!(Caller::Local.check_command(&order(fire(), true)).is_ok());
        assert!(Caller::Stranger(None).check_command(&order(Order::Pause, false)).is_err());
    }

    #[test]
    fn an_order_has_the_name_of_the_person_whatever_is_claimed() {
        let claimed = || Some("boss".to_owned());
        assert_eq!(visitor(KeyRole::Operator).author(claimed()), Some("alice".into()));
        assert_eq!(Caller::Local.author(claimed()), claimed());
        assert_eq!(Caller::Local.author(None), None);
    }
}
