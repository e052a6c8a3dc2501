//! The registry goes and comes back on the same port, or not at all.

use std::net::TcpListener;

use armor_socket::{Registration, RegistrationStatus};
use armor_wire::registry::ComponentEntry;
use client::DEADLINE;

use super::*;

fn run<T>(test: impl Future<Output = T>) -> T {
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = runtime.enable_all().build().unwrap();
    runtime.block_on(async { tokio::time::timeout(DEADLINE, test).await.expect("in time") })
}

fn configd() -> ComponentEntry {
    ComponentEntry { kind: "configd".into(), ..entry("configd", 5) }
}

#[test]
fn a_registration_survives_the_registry() {
    run(async {
        let (registry, address) = registry();
        let mut registration = Registration::keep_registered(address, configd());
        let RegistrationStatus::Registered { registry: first } = registration.changed().await
        else {
            panic!("not registered")
        };
        drop(registry);
        assert_eq!(registration.changed().await, RegistrationStatus::Away);
        let limits = ServerLimits::default();
        let _registry =
            BackgroundRegistry::start(RegistryOptions { listen: address, limits, secret: None })
                .unwrap();
        let RegistrationStatus::Registered { registry: second } = registration.changed().await
        else {
            panic!("not registered again")
        };
        assert_ne!(first, second);
        let mut tool = Client::observe(address).unwrap();
        tool.send(&RegistryRequest::List { request: 1 });
        let RegistryReply::Listing { components, .. } = tool.reply() else { panic!("no listing") };
        assert_eq!(components, [configd()]);
    });
}

#[test]
fn a_refused_registration_gets_the_name_once_it_is_free() {
    run(async {
        let (_registry, address) = registry();
        let holder = Client::register(address, &entry("lidar", 1)).unwrap();
        let mut registration = Registration::keep_registered(address, entry("lidar", 2));
        assert!(matches!(registration.changed().await, RegistrationStatus::Refused(_)));
        drop(holder);
        assert!(matches!(registration.changed().await, RegistrationStatus::Registered { .. }));
    });
}

#[test]
fn a_registry_that_accepts_and_sends_nothing_is_given_up() {
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap();
    run(async {
        let _registration = Registration::keep_registered(address, entry("lidar", 2));
        let (first, second) = tokio::task::spawn_blocking(move || {
            (silent.accept().unwrap(), silent.accept().unwrap())
        })
        .await
        .unwrap();
        assert_ne!(first.1, second.1, "it came back by itself");
    });
}
