//! A component behind a bad network: cut connections are noticed at both ends and come back, and
//! every message that does not arrive is counted.

use std::time::{Duration, Instant};

use super::far_sink::FarSink;
use crate::dice::{Dice, seed};
use crate::fixture::fault_proxy::NetworkFault;
use crate::fixture::wait_for;

// More than come together when a fault of some seconds is over: what a busy sink drops from its inbox is
// counted in its status, and not with the next message, as losses on the way are.
const LINK: &str = "<link from='source.numbers' to='sink.a' keep='1000' transport='tcp'/>";

fn summary(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let (half, longest) = (times[times.len() / 2], times[times.len() - 1]);
    println!("{what}: {} times, p50 {half:.2?}, longest {longest:.2?}", times.len());
}

#[test]
fn a_cut_network_is_noticed_at_both_ends_and_links_come_back() {
    let far = FarSink::start("cut", LINK, 1);
    let (mut at_sink, mut at_host, mut back) = (Vec::new(), Vec::new(), Vec::new());
    // Each cut takes about 3 s, most of which is waiting.
    let cuts = if std::env::var_os("ARMOR_FULL").is_some() { 100 } else { 4 };
    for round in 0..cuts {
        let faults = [NetworkFault::Cut, NetworkFault::CutFromClients, NetworkFault::CutToClients];
        let fault = faults[round % faults.len()];
        let closed = far.count_closed_links();
        far.proxy.set_fault(fault);
        let cut = Instant::now();
        let (mut sink, mut host) = (None, None);
        wait_for(&format!("{fault:?} to be noticed\n{}", far.log()), || {
            if sink.is_none() && far.count_closed_links() > closed {
                sink = Some(cut.elapsed());
            }
            if host.is_none() && !far.is_known() {
                host = Some(cut.elapsed());
            }
            (sink.is_some() && host.is_some()).then_some(())
        });
        at_sink.extend(sink);
        at_host.extend(host);
        far.proxy.set_fault(NetworkFault::None);
        let healed = Instant::now();
        far.wait_for_data();
        back.push(healed.elapsed());
    }
    far.check_losses_counted();
    summary("a cut is noticed by the sink", at_sink);
    summary("a cut is noticed by source and registry", at_host);
    summary("data are back after the network", back);
}

#[test]
fn a_network_with_random_faults_loses_nothing_that_is_not_counted() {
    let seed = seed(20_261_123);
    let mut dice = Dice::of(seed);
    let far = FarSink::start("faults", LINK, seed);
    let source = far.system.pid("source");
    let rounds = if std::env::var_os("ARMOR_FULL").is_some() { 300 } else { 15 };
    for round in 0..rounds {
        let fault = match dice.throw(7) {
            0 => NetworkFault::Cut,
            1 => NetworkFault::CutFromClients,
            2 => NetworkFault::CutToClients,
            3 => NetworkFault::Delay(Duration::from_millis(200)),
            4 => NetworkFault::Bandwidth(4000),
            5 => {
                far.proxy.reset_all();
                NetworkFault::None
            }
            _ => {
                far.proxy.truncate_next();
                NetworkFault::None
            }
        };
        println!("round {round}: {fault:?}");
        far.proxy.set_fault(fault);
        std::thread::sleep(Duration::from_millis(50 + dice.throw(2500) as u64));
        far.proxy.set_fault(NetworkFault::None);
        far.wait_for_data();
    }
    far.check_losses_counted();
    assert_eq!(far.system.pid("source"), source, "the source is the same process");
}

#[test]
fn flipped_bits_do_no_harm_beyond_their_connection() {
    let seed = seed(7);
    let mut far = FarSink::start("bits", LINK, seed);
    let source = far.system.pid("source");
    for _ in 0..4 {
        for _ in 0..10 {
            far.proxy.corrupt_next();
            std::thread::sleep(Duration::from_millis(30));
        }
        assert!(!far.log().contains("panicked"), "{}", far.log());
        // A false length may make an end wait for bytes that never come, and a false value may be
        // one that the sink's own code refuses: both ends begin again.
        far.proxy.reset_all();
        far.replace_sink();
        far.wait_for_data();
    }
    assert_eq!(far.system.pid("source"), source, "the source is the same process");
}
