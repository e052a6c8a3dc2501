//! A collector of OpenTelemetry: takes traces by OTLP over HTTP, with JSON.

use std::fmt;
use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use armor_inspect::TraceStep;
use serde_json::{Value, json};

use super::otlp::encode_request;
use crate::print::print_notice;

/// The port at which collectors take OTLP over HTTP.
const DEFAULT_PORT: u16 = 4318;
/// Where they take traces.
const TRACES: &str = "/v1/traces";
/// How long a collector may take for one request.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Most bytes of an answer that are read.
const MAX_ANSWER_LEN: u64 = 1 << 16;
/// Most steps that wait for the next request; more are counted as lost.
const MAX_STEPS: usize = 20_000;

/// Where a collector listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CollectorAddress {
    host: String,
    port: u16,
    path: String,
}

impl CollectorAddress {
    /// Reads `http://HOST[:PORT][/PATH]`. Without a path it is that of traces.
    ///
    /// # Errors
    /// How it is written.
    pub fn parse(text: &str) -> Result<Self, String> {
        let form = "write http://HOST:PORT, such as http://127.0.0.1:4318";
        if text.starts_with("https://") {
            return Err(
                "TLS is not spoken here: run a collector on this host, which forwards the \
                        traces, and write http://127.0.0.1:4318"
                    .into(),
            );
        }
        let rest = text.strip_prefix("http://").ok_or(form)?;
        let (authority, path) = match rest.find('/') {
            Some(at) => rest.split_at(at),
            None => (rest, ""),
        };
        let (host, port) = match authority.rsplit_once(':') {
            Some((host, port)) if !port.ends_with(']') => (host, port.parse().map_err(|_| form)?),
            _ => (authority, DEFAULT_PORT),
        };
        let host = host.trim_start_matches('[').trim_end_matches(']');
        let is_wrong = |c: char| c.is_whitespace() || c.is_control() || c == '@';
        if host.is_empty() || text.contains(is_wrong) {
            return Err(form.into());
        }
        let path = path.trim_end_matches('/');
        let path = if path.is_empty() { TRACES } else { path };
        Ok(Self { host: host.into(), port, path: path.into() })
    }
}

impl fmt::Display for CollectorAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port, path } = self;
        match host.contains(':') {
            true => write!(f, "http://[{host}]:{port}{path}"),
            false => write!(f, "http://{host}:{port}{path}"),
        }
    }
}

/// A collector, and what was sent to it.
pub struct Collector {
    address: CollectorAddress,
    system: String,
    waiting: Vec<TraceStep>,
    sent: u64,
    lost: u64,
    last_problem: String,
}

impl Collector {
    /// Sends it an empty request, to find out whether it takes traces. `system` is the name under which
    /// they are found.
    ///
    /// # Errors
    /// If it does not.
    pub fn connect(address: &CollectorAddress, system: &str) -> Result<Self> {
        let collector = Self {
            address: address.clone(),
            system: system.into(),
            waiting: Vec::new(),
            sent: 0,
            lost: 0,
            last_problem: String::new(),
        };
        collector.post(&encode_request(system, &[]).0).with_context(|| {
            format!(
                "no collector of OpenTelemetry takes traces at {address}; start one (Jaeger and \
                     the OpenTelemetry Collector do so at port 4318), or correct --otlp"
            )
        })?;
        Ok(collector)
    }

    /// Adds steps to the next request.
    pub fn add(&mut self, steps: Vec<TraceStep>) {
        let room = MAX_STEPS.saturating_sub(self.waiting.len());
        self.lost += steps.len().saturating_sub(room) as u64;
        self.waiting.extend(steps.into_iter().take(room));
    }

    /// Sends what waits. What the collector does not take is lost, and counted.
    pub fn send(&mut self) {
        if self.waiting.is_empty() {
            return;
        }
        let (request, spans) = encode_request(&self.system, &self.waiting);
        self.waiting.clear();
        let problem = match self.post(&request) {
            Ok(rejected) => {
                let rejected = rejected.min(spans as u64);
                self.sent += spans as u64 - rejected;
                self.lost += rejected;
                match rejected {
                    0 => String::new(),
                    count => format!("the collector has rejected {count} spans"),
                }
            }
            Err(error) => {
                self.lost += spans as u64;
                format!("{error:#}; its spans are lost, and the next are sent")
            }
        };
        if !problem.is_empty() && problem != self.last_problem {
            print_notice(&problem);
        }
        self.last_problem = problem;
    }

    /// Whether it has taken nothing of what there was.
    pub fn has_lost_all(&self) -> bool {
        self.sent == 0 && self.lost > 0
    }

    /// What was sent, for programs.
    pub fn summary(&self) -> Value {
        json!({"collector": self.address.to_string(), "spans_sent": self.sent, "spans_lost": self.lost})
    }

    /// Sends a request, and returns how many spans of it were rejected.
    fn post(&self, request: &Value) -> Result<u64> {
        let CollectorAddress { host, port, path } = &self.address;
        let addresses: Vec<_> = (host.as_str(), *port)
            .to_socket_addrs()
            .with_context(|| format!("the host {host} is not known"))?
            .collect();
        let connected = addresses.iter().map(|at| TcpStream::connect_timeout(at, ANSWER_WITHIN));
        let mut problem = None;
        let stream =
            connected.filter_map(|tried| tried.map_err(|error| problem = Some(error)).ok());
        let Some(mut stream) = { stream }.next() else {
            let problem = problem.map_or_else(|| anyhow!("it has no address"), Into::into);
            return Err(problem.context(format!("cannot connect to {host}:{port}")));
        };
        stream.set_read_timeout(Some(ANSWER_WITHIN))?;
        stream.set_write_timeout(Some(ANSWER_WITHIN))?;
        let body = request.to_string();
        let name = if host.contains(':') { format!("[{host}]") } else { host.clone() };
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: {name}:{port}\r\nUser-Agent: armor/{}\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
            env!("CARGO_PKG_VERSION"),
            body.len()
        );
        stream.write_all(head.as_bytes())?;
        stream.write_all(body.as_bytes())?;
        let mut answer = Vec::new();
        let read = stream.take(MAX_ANSWER_LEN).read_to_end(&mut answer);
        // Some servers reset the connection after their answer.
        if answer.is_empty() {
            read.context("the collector has not answered")?;
        }
        read_answer(&String::from_utf8_lossy(&answer))
    }
}

impl fmt::Display for Collector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} spans sent to {}", self.sent, self.address)?;
        match self.lost {
            0 => Ok(()),
            lost => write!(f, ", {lost} lost"),
        }
    }
}

/// Reads an answer: how many spans were rejected.
fn read_answer(answer: &str) -> Result<u64> {
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((answer, ""));
    let status = head.lines().next().unwrap_or_default();
    let code = status.strip_prefix("HTTP/1.").and_then(|rest| rest.split(' ').nth(1));
    match code.and_then(|code| code.parse::<u16>().ok()) {
        Some(200..=299) => {}
        Some(404 | 405) => bail!("it does not take traces there ({status})"),
        Some(_) => bail!("it refuses them ({status})"),
        None => bail!("it does not speak HTTP"),
    }
    // The body may come in chunks; its object is between the outer braces.
    let object = body.find('{').zip(body.rfind('}')).and_then(|(from, to)| body.get(from..=to));
    let object: Value =
        object.and_then(|text| serde_json::from_str(text).ok()).unwrap_or(Value::Null);
    // A number of 64 bits is a text in the JSON of Protocol Buffers.
    let rejected = &object["partialSuccess"]["rejectedSpans"];
    let of_text = || rejected.as_str().and_then(|text| text.parse().ok());
    Ok(rejected.as_u64().or_else(of_text).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_host_and_maybe_a_port_and_a_path() {
        for (text, expected) in [
            ("http://127.0.0.1:9", "http://127.0.0.1:9/v1/traces"),
            ("http://jaeger", "http://jaeger:4318/v1/traces"),
            ("http://jaeger/", "http://jaeger:4318/v1/traces"),
            ("http://[::1]:9/in/v1/traces", "http://[::1]:9/in/v1/traces"),
            ("http://[::1]", "http://[::1]:4318/v1/traces"),
        ] {
            let address = CollectorAddress::parse(text).expect(text);
            assert_eq!(address.to_string(), expected);
        }
        for wrong in
            ["", "jaeger:4318", "http://", "http://:9", "http://a:b", "http://u@h", "http://a b"]
        {
            assert!(CollectorAddress::parse(wrong).is_err(), "{wrong}");
        }
        let refusal = CollectorAddress::parse("https://robot:4318").expect_err("no TLS");
        assert!(refusal.contains("collector on this host"), "{refusal}");
    }

    #[test]
    fn an_answer_states_what_was_rejected() {
        let with = |body: &str| read_answer(&format!("HTTP/1.1 200 OK\r\nA: b\r\n\r\n{body}"));
        assert_eq!(with("").expect("taken"), 0);
        assert_eq!(with("{}").expect("taken"), 0);
        assert_eq!(with(r#"{"partialSuccess":{"rejectedSpans":"3"}}"#).expect("taken"), 3);
        let chunked = "1c\r\n{\"partialSuccess\":{\"rejectedSpans\":4}}\r\n0\r\n\r\n";
        assert_eq!(with(chunked).expect("taken"), 4);
        for (answer, expected) in [
            ("HTTP/1.1 404 Not Found\r\n\r\n", "does not take traces"),
            ("HTTP/1.0 503 Busy\r\n\r\n", "refuses them (HTTP/1.0 503 Busy)"),
            ("SSH-2.0\r\n", "does not speak HTTP"),
        ] {
            let error = read_answer(answer).expect_err(answer).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
