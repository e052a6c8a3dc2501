//! Datagrams through a bad network, next to TCP: what arrives, how old it is when it is used, and who
//! counts what does not.

use std::time::Duration;

use super::far_sink::{FarSink, check_losses_counted};
use super::trace::Got;
use crate::fixture::fault_proxy::NetworkFault;
use crate::fixture::wait_for;

/// One way of the network.
const DELAY: Duration = Duration::from_millis(20);
/// Between two looks at the newest message.
const LOOK_NS: u64 = 1_000_000;

/// What became of the messages of one input.
struct Arrivals {
    /// From the first to the last that arrived.
    published: u64,
    arrived: u64,
    counted: u64,
    /// Of the newest message at each millisecond, in ms.
    ages: Vec<f64>,
}

impl Arrivals {
    /// `published_ns`: when each number was published.
    fn of(got: &[Got], published_ns: &[u64]) -> Self {
        let (first, last) = (&got[0], &got[got.len() - 1]);
        let mut ages = Vec::new();
        for pair in got.windows(2) {
            let mut at_ns = pair[0].at_ns;
            while at_ns < pair[1].at_ns {
                let published_ns = published_ns[usize::try_from(pair[0].count).expect("few")];
                ages.push(at_ns.saturating_sub(published_ns) as f64 / 1e6);
                at_ns += LOOK_NS;
            }
        }
        ages.sort_by(f64::total_cmp);
        Self {
            published: last.count - first.count + 1,
            arrived: got.len() as u64,
            counted: got[1..].iter().map(|got| got.lost).sum(),
            ages,
        }
    }

    fn age(&self, share: f64) -> f64 {
        self.ages[((self.ages.len() - 1) as f64 * share) as usize]
    }

    fn share(&self) -> f64 {
        self.arrived as f64 / self.published as f64
    }

    fn print(&self, what: &str) {
        println!(
            "{what}: {} of {} arrived ({:.2} %), {} counted as lost; age when used p50 {:.0} ms, \
             p99 {:.0} ms",
            self.arrived,
            self.published,
            100.0 * self.share(),
            self.counted,
            self.age(0.5),
            self.age(0.99),
        );
    }
}

/// A pose at 20 Hz by datagrams that are sent once, by those that are sent again, and by TCP, while
/// the network loses `share` of what it carries.
fn measure(name: &str, share: f64, seed: u64) -> [Arrivals; 3] {
    let links = "<link from='source.numbers' to='sink.a' transport='udp'/>\
                 <link from='source.numbers' to='sink.b' transport='udp' keep='3'/>\
                 <link from='source.numbers' to='sink.c' transport='tcp' keep='all'/>";
    let far = FarSink::start_at("20Hz", name, links, seed);
    far.proxy.set_fault(NetworkFault::Loss { share: 0.0, delay: DELAY });
    wait_for_datagrams(&far);
    let seconds = if std::env::var_os("ARMOR_FULL").is_some() { 300 } else { 12 };
    far.proxy.set_fault(NetworkFault::Loss { share, delay: DELAY });
    // What TCP has held up until then must not count for it.
    let before = far.got("c").len() as u64;
    std::thread::sleep(Duration::from_secs(seconds));
    let last = far.got("a").last().expect("data").count;
    wait_for("TCP to deliver all", || far.got("c").iter().any(|it| it.count >= last).then_some(()));
    let ticks: Vec<_> = far.system.trace("source").all("tick").iter().map(|it| it.at_ns).collect();
    check_newest_counted(&far, "a");
    ["a", "b", "c"].map(|input| {
        let got = far.got(input);
        if input != "a" {
            check_losses_counted(&got);
        }
        let measured: Vec<_> =
            got.into_iter().filter(|got| (before..=last).contains(&got.count)).collect();
        Arrivals::of(&measured, &ticks)
    })
}

/// Checks that what is missing at an input that keeps only the newest was lost on the way or replaced
/// by a newer one at the sink, and counted.
fn check_newest_counted(far: &FarSink, input: &str) {
    wait_for("the count of what is missing", || {
        let status = far.system.status("sink");
        let got = far.got(input);
        let counts = status.inputs.iter().find(|it| it.id == input)?;
        let published = got.last()?.count - got[0].count + 1;
        // What is missing before a message that is replaced is in the count alone.
        (published == got.len() as u64 + counts.lost + counts.dropped).then_some(())
    });
}

fn transports(far: &FarSink) -> Vec<String> {
    let source = far.system.status("source");
    source.outputs[0].links.iter().map(|link| link.transport.clone()).collect()
}

fn wait_for_datagrams(far: &FarSink) {
    wait_for(&format!("datagrams\n{}", far.log()), || {
        (transports(far).iter().filter(|it| *it == "udp").count() == 2).then_some(())
    });
}

#[test]
fn at_a_loss_of_30_percent_some_are_repaired_and_each_miss_is_counted() {
    let [none, some, all] = measure("loss-30", 0.3, 11);
    none.print("30 %, none");
    some.print("30 %, some");
    all.print("30 %, all (TCP)");
    for it in [&some, &all] {
        assert_eq!(it.arrived + it.counted, it.published, "each miss is counted");
    }
    assert!((0.5..0.9).contains(&none.share()), "{}", none.share());
    // Of the few messages of the short form, a pause of this machine costs some.
    let least = if std::env::var_os("ARMOR_FULL").is_some() { 0.99 } else { 0.95 };
    assert!(some.share() >= least, "{}", some.share());
    assert_eq!(all.counted, 0);
}

#[test]
fn at_a_loss_of_5_percent_the_newest_is_seldom_old() {
    let [none, some, all] = measure("loss-5", 0.05, 12);
    none.print("5 %, none");
    some.print("5 %, some");
    all.print("5 %, all (TCP)");
    assert!(none.share() > 0.8 && some.share() >= 0.98, "{} {}", none.share(), some.share());
}

#[test]
fn where_datagrams_are_blocked_tcp_carries_the_data_until_they_arrive_again() {
    let links = "<link from='source.numbers' to='sink.a' transport='udp' keep='3'/>\
                 <link from='source.numbers' to='sink.b' transport='udp'/>";
    let far = FarSink::start("blocked", links, 13);
    wait_for_datagrams(&far);
    far.proxy.set_fault(NetworkFault::NoDatagrams);
    wait_for("TCP", || transports(&far).iter().all(|it| it == "udp→tcp").then_some(()));
    let before = far.got("b").len();
    far.wait_for_data();
    wait_for("both", || (far.got("b").len() > before).then_some(()));
    far.proxy.set_fault(NetworkFault::None);
    wait_for_datagrams(&far);
    far.wait_for_data();
    far.check_losses_counted();
    check_newest_counted(&far, "b");
    let log = far.system.run.log();
    assert!(
        log.contains(
            "has confirmed no datagram for 2 s, or no whole message; TCP carries the data"
        ),
        "{log}"
    );
    // Of those that are sent again, only the ones are lost that were published before TCP took over.
    let lost: u64 = far.got("a").iter().map(|got| got.lost).sum();
    assert!(lost < 400, "{lost}");
}
