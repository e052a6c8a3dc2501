//! The mission and orders to it.

use std::sync::Arc;

use armor_sdk::control::{Command, Order, TokenMove};
use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::json;

use crate::failure::{WebFailure, json_response, text_response};
use crate::remote::caller::Caller;
use crate::web_state::WebState;

/// The orders that a client can give, for messages.
const ORDERS: &str = "fire, confirm, decline, pause, resume, safe or move";

/// An order as a client writes it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OrderBody {
    order: String,
    /// For `fire`, `confirm` and `decline`.
    transition: Option<String>,
    /// For `move`.
    #[serde(default)]
    moves: Vec<MoveBody>,
    /// Take the command over from its holder.
    #[serde(default)]
    take: bool,
    /// Who gives it; by default the user who has started the server. Not read for a person who is
    /// logged in.
    author: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MoveBody {
    from: String,
    to: String,
    #[serde(default = "one_token")]
    tokens: u32,
}

fn one_token() -> u32 {
    1
}

impl OrderBody {
    fn to_order(&self) -> Result<Order, WebFailure> {
        let transition = || {
            self.transition.clone().ok_or_else(|| {
                let what = format!("`{}` needs a transition", self.order.escape_default());
                WebFailure::bad(what, "the field `transition`", "name one of GET /api/mission")
            })
        };
        let order = match self.order.as_str() {
            "fire" => Order::Fire { transition: transition()? },
            "confirm" => Order::Confirm { transition: transition()? },
            "decline" => Order::Decline { transition: transition()? },
            "pause" => Order::Pause,
            "resume" => Order::Resume,
            "safe" => Order::Safe,
            "move" => {
                let moves = self.moves.iter().map(|it| TokenMove {
                    from: it.from.clone(),
                    to: it.to.clone(),
                    tokens: it.tokens,
                });
                Order::Move { moves: moves.collect() }
            }
            other => {
                let what = format!("there is no order `{}`", other.escape_default());
                return Err(WebFailure::bad(what, "the field `order`", format!("write {ORDERS}")));
            }
        };
        // Any number but 0: it is chosen when the order is sent.
        order.check(1, self.author.as_deref().unwrap_or("-")).map_err(|fault| {
            WebFailure::bad(fault.to_string(), "the body", "docs/operator.md describes the orders")
        })?;
        Ok(order)
    }
}

/// `GET /api/mission`.
pub(crate) async fn show_mission(State(web): State<Arc<WebState>>) -> Response {
    text_response(StatusCode::OK, "application/json", web.mission_text().to_string())
}

/// `POST /api/mission/orders`.
pub(crate) async fn give_order(
    State(web): State<Arc<WebState>>,
    caller: Caller,
    body: Bytes,
) -> Result<Response, WebFailure> {
    let body: OrderBody = serde_json::from_slice(&body).map_err(|error| {
        let remedy = "send {\"order\": \"fire\", \"transition\": \"NAME\"}";
        WebFailure::bad(error.to_string(), "the body", remedy)
    })?;
    let order = body.to_order()?;
    let author = caller.author(body.author);
    let command = Command::Order {
        request: 1,
        author: author.clone().unwrap_or_default(),
        take: body.take,
        order: order.clone(),
    };
    caller.check_command(&command)?;
    let verdict = web.orders.send(author, body.take, order).await?;
    if verdict.accepted {
        let accepted = json!({"accepted": true, "text": verdict.text});
        return Ok(json_response(StatusCode::OK, &accepted));
    }
    let remedy = "GET /api/mission shows what can be ordered, and who holds the command";
    let refused = WebFailure::new(StatusCode::CONFLICT, verdict.text, "the mission", remedy);
    Ok(refused.into_response())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Order, String> {
        let body: OrderBody = serde_json::from_str(text).map_err(|error| error.to_string())?;
        body.to_order().map_err(|failure| failure.to_json()["error"]["where"].to_string())
    }

    #[test]
    fn orders_are_read_as_programs_write_them() {
        let fire = read(r#"{"order":"fire","transition":"late"}"#);
        assert_eq!(fire, Ok(Order::Fire { transition: "late".into() }));
        assert_eq!(read(r#"{"order":"pause"}"#), Ok(Order::Pause));
        let moved = read(r#"{"order":"move","moves":[{"from":"a","to":"b"}]}"#);
        let moves = vec![TokenMove { from: "a".into(), to: "b".into(), tokens: 1 }];
        assert_eq!(moved, Ok(Order::Move { moves }));
    }

    #[test]
    fn an_order_that_cannot_be_names_the_field() {
        assert_eq!(read(r#"{"order":"fly"}"#), Err("\"the field `order`\"".into()));
        assert_eq!(read(r#"{"order":"fire"}"#), Err("\"the field `transition`\"".into()));
        for text in [
            r#"{"order":"move"}"#,
            r#"{"order":"fire","transition":""}"#,
            r#"{"order":"pause","author":""}"#,
            r#"{"order":"pause","author":"a\nb"}"#,
        ] {
            assert_eq!(read(text), Err("\"the body\"".into()), "{text}");
        }
        assert!(read(r#"{"order":"pause","now":true}"#).is_err(), "an unknown field");
    }
}
