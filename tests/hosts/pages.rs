//! A page for browsers that a component on the second host serves.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;

use super::Hosts;
use crate::fixture::{DEADLINE, free_port, run_to_end, wait_for};

/// A name in the key of the host arm, which no name server knows.
const SITE: &str = "arm.test";

#[test]
fn a_page_is_served_with_the_keys_that_the_agent_was_given() {
    let port = free_port();
    let hosts = Hosts::with_file("hosts-page", |agent, _| {
        format!(
            "<armor version='1'><system name='two-hosts'>\
             <host name='arm' at='127.0.0.1:{agent}'/>\
             <component name='page' kind='web-view' rate='10Hz' controllable='false' host='arm'>\
             <parameter name='listen' value='0.0.0.0:{port}'/></component></system></armor>"
        )
    });
    hosts.keys(&["renew", "arm", "--at", SITE]);
    let path = |folder: &str| hosts.folder.path().join(folder).join("arm.key");
    fs::copy(path("authority"), path("arm")).expect("it is copied");
    let _agent = hosts.start_agent("robot");
    let _run = hosts.run(&[]);
    let plain = wait_for("the page", || {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        stream.set_read_timeout(Some(DEADLINE)).ok()?;
        write!(stream, "GET / HTTP/1.1\r\nHost: {SITE}:{port}\r\n\r\n").ok()?;
        let mut response = String::new();
        stream.read_to_string(&mut response).ok()?;
        (!response.is_empty()).then_some(response)
    });
    assert!(plain.starts_with("HTTP/1.1 308 "), "only HTTPS is served: {plain}");
    // The server has noted its port in that folder.
    let invite = ["keys", "invite", "bob", "--role", "observer", "--keys", "arm"];
    let (code, link, err) = run_to_end(&mut hosts.folder.armor(&invite));
    assert_eq!(code, 0, "{err}");
    assert!(link.starts_with(&format!("https://{SITE}:{port}/#invite=")), "{link}");
}
