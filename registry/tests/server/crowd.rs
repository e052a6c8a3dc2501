//! Many clients that register concurrently.

use armor_wire::frame::FrameKind;
use armor_wire::hello::Hello;

use super::*;

const CROWD: usize = 300;

#[test]
fn three_hundred_register_together_and_all_find_each_other() {
    let (_registry, address) = registry();
    // All hellos are on their way before the first answer is read.
    let mut crowd: Vec<_> = (0..CROWD)
        .map(|n| {
            let mut client = Client::stranger(address);
            let entry = entry(&format!("c{n}"), 1 + n as u64);
            let purpose = Purpose::Registry { entry: Some(entry) };
            client.send_frame(FrameKind::Hello, &Hello::new("test", 1, purpose));
            // The last of them waits for its turn longer than the registry bears silence.
            client.beat();
            client
        })
        .collect();
    for (n, client) in crowd.iter_mut().enumerate() {
        client.answer().unwrap();
        let data = format!("c{}.scan", (n + 1) % CROWD);
        client.send(&RegistryRequest::Lookup {
            request: 2,
            data,
            schema: String::new(),
            wait: true,
        });
        client.send(&RegistryRequest::Provide { request: 1, entry: scan(&format!("c{n}")) });
    }
    for (n, client) in crowd.iter_mut().enumerate() {
        let (mut provided, mut found) = (false, false);
        while !(provided && found) {
            match client.reply() {
                RegistryReply::Provided { request: 1 } => provided = true,
                RegistryReply::Found { request: 2, provider, .. } => {
                    assert_eq!(provider.name, format!("c{}", (n + 1) % CROWD));
                    found = true;
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
