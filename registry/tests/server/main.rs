//! The real registry on a port of its own, and clients that behave and that do not.

#![allow(clippy::unwrap_used, reason = "all of it is a test")]

mod client;
mod crowd;
mod hostile;
mod restart;

use std::net::SocketAddr;

use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_socket::ServerLimits;
use armor_wire::hello::{HandshakeError, Purpose, RefusalCode};
use armor_wire::registry::{RegistryReply, RegistryRequest};
use client::{Client, entry, scan};

fn registry_with(limits: ServerLimits) -> BackgroundRegistry {
    BackgroundRegistry::start(RegistryOptions {
        listen: ([127, 0, 0, 1], 0).into(),
        limits,
        secret: None,
    })
    .unwrap()
}

fn registry() -> (BackgroundRegistry, SocketAddr) {
    let registry = registry_with(ServerLimits::default());
    let address = registry.address();
    (registry, address)
}

#[test]
fn what_one_provides_another_finds() {
    let (_registry, address) = registry();
    let mut lidar = Client::register(address, &entry("lidar", 1)).unwrap();
    let mut mapper = Client::register(address, &entry("mapper", 2)).unwrap();
    mapper.send(&RegistryRequest::Lookup {
        request: 1,
        data: "lidar.scan".into(),
        schema: scan("lidar").schema,
        wait: true,
    });
    lidar.send(&RegistryRequest::Provide { request: 7, entry: scan("lidar") });
    assert_eq!(lidar.reply(), RegistryReply::Provided { request: 7 });
    let provider = entry("lidar", 1);
    assert_eq!(
        mapper.reply(),
        RegistryReply::Found { request: 1, entry: scan("lidar"), provider, key: None }
    );
}

#[test]
fn a_name_is_free_again_when_its_process_has_gone() {
    let (_registry, address) = registry();
    let mut watcher = Client::observe(address).unwrap();
    watcher.send(&RegistryRequest::Watch);
    let first = Client::register(address, &entry("lidar", 1)).unwrap();
    assert_eq!(watcher.reply(), RegistryReply::Appeared { entry: entry("lidar", 1) });
    let error = Client::register(address, &entry("lidar", 2)).err().unwrap();
    let HandshakeError::Refused(refusal) = error else { panic!("{error}") };
    assert_eq!(refusal.code, RefusalCode::DuplicateName);
    drop(first);
    assert_eq!(watcher.reply(), RegistryReply::Gone { entry: entry("lidar", 1) });
    Client::register(address, &entry("lidar", 2)).unwrap();
}

#[test]
fn a_client_with_another_purpose_is_refused() {
    let (_registry, address) = registry();
    let error = Client::connect(address, Purpose::Config).err().unwrap();
    let HandshakeError::Refused(refusal) = error else { panic!("{error}") };
    assert_eq!(refusal.code, RefusalCode::WrongPurpose);
}
