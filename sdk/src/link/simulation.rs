//! Links and the registry under a seeded queue with faults: delays, connections that are cut, reset or
//! carry nothing, and publishers and a registry that die and start again, also on the port of another
//! one. What decides in a run decides here: the registry's directory, the frames and handshakes, the
//! queue of a link, the sequence of an input, liveness and delays; sockets, threads and clocks do not
//! exist.
//!
//! Checked at every message: it is of the publisher and of the process start that the link was made
//! for. At the end: each loss was counted, and every input is linked to its publisher again.

mod network;
mod publisher;
mod registry;
mod subscriber;

use std::time::Duration;

use armor_wire::keep::Keep;

use network::{ConnectionId, Delivery, End, Event, Network, Timer};
use publisher::Publisher;
use registry::RegistryHost;
use subscriber::Subscriber;

/// Faults happen in this time.
const FAULTS: Duration = Duration::from_secs(4);
/// After this time without faults, every link must carry data.
const CALM: Duration = Duration::from_secs(5);
/// The data of the last part of it must have arrived.
const LAST_DATA: Duration = Duration::from_secs(1);
/// Period with which each process looks after its connections.
const LOOK: Duration = armor_wire::liveness::LOOK;
/// The mean time between two faults.
const FAULT_EVERY_MS: u64 = 250;
/// Seeds that the gate runs; `ARMOR_SEEDS=from..to` selects others.
const SEEDS: std::ops::Range<u64> = 0..200;

/// What the processes compare before they take part in a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    /// The process start, as they do.
    Instances,
    /// Nothing: a test that the simulation notices it.
    Nothing,
}

/// What a scenario has shown.
#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    received: u64,
    lost: u64,
    links: u64,
    refused: u64,
}

struct World {
    network: Network,
    registry: Option<RegistryHost>,
    publishers: Vec<Publisher>,
    subscribers: Vec<Subscriber>,
    comparison: Comparison,
    /// Process starts so far; the next one's instance.
    instances: u64,
}

impl World {
    fn new(seed: u64, comparison: Comparison) -> Self {
        let mut network = Network::new(seed);
        let publishers = vec![Publisher::new(0, "laser"), Publisher::new(1, "camera")];
        let keeps = [Keep::ALL, Keep::Latest, Keep::Last { count: 3 }];
        let subscriber = |(index, keep): (usize, Keep)| {
            let publisher = if index == 0 { 1 } else { 0 };
            Subscriber::new(index, publisher, keep, seed)
        };
        let subscribers = keeps.into_iter().enumerate().map(subscriber).collect();
        network.set_timer(Duration::ZERO, Timer::StartRegistry);
        for index in 0..publishers.len() {
            let delay = network.draw_ms(0, 300);
            network.set_timer(delay, Timer::StartPublisher(index));
            network.set_timer(delay, Timer::Publish(index));
        }
        network.set_timer(LOOK, Timer::Look);
        network.set_timer(Duration::from_millis(FAULT_EVERY_MS), Timer::Fault);
        Self { network, registry: None, publishers, subscribers, comparison, instances: 0 }
    }

    /// Runs to the end. Returns what it has shown, or which invariant was violated.
    fn run(mut self) -> Result<Outcome, String> {
        for subscriber in &mut self.subscribers {
            subscriber.look_up(&mut self.network);
        }
        while let Some(event) = self.network.next_event(FAULTS + CALM) {
            match event {
                Event::Arrival { connection, to, delivery } => {
                    self.deliver(connection, to, delivery)?;
                }
                Event::Timer(timer) => self.act(timer),
            }
        }
        self.check_end()
    }

    fn deliver(
        &mut self,
        connection: ConnectionId,
        to: End,
        delivery: Delivery,
    ) -> Result<(), String> {
        let network = &mut self.network;
        if matches!(delivery, Delivery::ToRegistry(_)) {
            match &mut self.registry {
                Some(registry) => registry.handle(connection, delivery, network),
                None => network.close(connection, End::Server),
            }
            return Ok(());
        }
        // A subscriber connects: the process that listens there now gets it.
        if let Delivery::Dialled { port } = delivery {
            match self.publishers.iter_mut().find(|it| it.listens_on(port)) {
                Some(publisher) => publisher.accept(connection),
                None => network.close(connection, End::Server),
            }
            return Ok(());
        }
        if to == End::Server {
            if let Some(registry) = &mut self.registry
                && registry.serves(connection)
            {
                registry.handle(connection, delivery, network);
            } else if let Some(publisher) =
                self.publishers.iter_mut().find(|it| it.serves(connection))
            {
                publisher.handle(connection, delivery, self.comparison, network);
            }
            return Ok(());
        }
        if let Some(publisher) = self.publishers.iter_mut().find(|it| it.registry.is_on(connection))
        {
            publisher.hear_registry(delivery, network);
            return Ok(());
        }
        for subscriber in &mut self.subscribers {
            if subscriber.registry.is_on(connection) {
                return subscriber.hear_registry(delivery, network);
            }
            if subscriber.is_linked_by(connection) {
                subscriber.hear_publisher(delivery, self.comparison, network)?;
                // It has read: there is room again.
                if let Some(publisher) = self.publishers.iter_mut().find(|it| it.serves(connection))
                {
                    publisher.drain_link(connection, network);
                }
                return Ok(());
            }
        }
        Ok(())
    }

    fn act(&mut self, timer: Timer) {
        let network = &mut self.network;
        match timer {
            Timer::StartRegistry => {
                self.instances += 1;
                self.registry = Some(RegistryHost::new(self.instances, network.now()));
            }
            Timer::StartPublisher(index) => {
                self.instances += 1;
                let taken = self.publishers.iter().filter_map(Publisher::port);
                let port = network.draw_port(&taken.collect::<Vec<_>>());
                self.publishers[index].start(self.instances, port, network);
            }
            Timer::Publish(index) => {
                self.publishers[index].publish(network);
                network.set_timer(publisher::PERIOD, Timer::Publish(index));
            }
            Timer::Look => {
                if let Some(registry) = &mut self.registry {
                    registry.look(network);
                }
                self.publishers.iter_mut().for_each(|it| it.look(network));
                self.subscribers.iter_mut().for_each(|it| it.look(network));
                network.set_timer(LOOK, Timer::Look);
            }
            Timer::Retry { subscriber, attempt } => {
                self.subscribers[subscriber].retry(attempt, network);
            }
            Timer::Fault if network.now() < FAULTS => {
                self.cause_fault();
                let delay = self.network.draw_ms(0, 2 * FAULT_EVERY_MS);
                self.network.set_timer(delay, Timer::Fault);
            }
            Timer::Fault => self.network.end_delays(),
        }
    }

    fn cause_fault(&mut self) {
        let network = &mut self.network;
        match network.draw(10) {
            0 => {
                if self.registry.take().is_some() {
                    network.close_all(|it| it.is_of_registry);
                    let delay = network.draw_ms(50, 1000);
                    network.set_timer(delay, Timer::StartRegistry);
                }
            }
            1..=3 => {
                let index = network.draw(self.publishers.len() as u64) as usize;
                if self.publishers[index].stop(network) {
                    let delay = network.draw_ms(20, 800);
                    network.set_timer(delay, Timer::StartPublisher(index));
                }
            }
            4..=7 => network.cut_any(),
            _ => network.begin_delays(),
        }
    }

    fn check_end(self) -> Result<Outcome, String> {
        let mut outcome = Outcome::default();
        for subscriber in &self.subscribers {
            let publisher = &self.publishers[subscriber.publisher];
            let since = publisher.count_before(FAULTS + CALM - LAST_DATA);
            subscriber.check_end(publisher.instance(), since)?;
            outcome.received += subscriber.count_received();
            outcome.lost += subscriber.count_lost();
            outcome.links += subscriber.links;
            outcome.refused += subscriber.refused;
        }
        Ok(outcome)
    }
}

fn seeds() -> std::ops::Range<u64> {
    let given = std::env::var("ARMOR_SEEDS").ok();
    let range = given.as_deref().and_then(|text| text.split_once(".."));
    let number = |text: &str| text.parse().expect("ARMOR_SEEDS is from..to");
    range.map_or(SEEDS, |(from, to)| number(from)..number(to))
}

#[test]
fn after_any_faults_every_link_comes_back_with_the_right_data_and_each_loss_is_counted() {
    let mut all = Outcome::default();
    for seed in seeds() {
        let outcome = World::new(seed, Comparison::Instances).run();
        let outcome = outcome.unwrap_or_else(|why| panic!("seed {seed}: {why}"));
        all.received += outcome.received;
        all.lost += outcome.lost;
        all.links += outcome.links;
        all.refused += outcome.refused;
    }
    println!("{} scenarios: {all:?}", seeds().count());
    // Otherwise the scenarios would show nothing.
    let count = seeds().count() as u64;
    assert!(all.lost > count && all.links > 4 * count && all.refused > 0, "{all:?}");
}

#[test]
fn the_same_seed_is_the_same_scenario() {
    let run = |seed| format!("{:?}", World::new(seed, Comparison::Instances).run());
    for seed in 0..5 {
        assert_eq!(run(seed), run(seed), "{seed}");
    }
}

#[test]
fn a_process_that_compares_nothing_is_noticed() {
    let violates = |seed| World::new(seed, Comparison::Nothing).run().err();
    let why = (0..500).find_map(violates).expect("one of them gets the data of another");
    assert!(why.contains("was linked to"), "{why}");
}
