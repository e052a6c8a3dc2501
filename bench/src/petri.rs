//! The cost of a net: enumerating its states, and firing, for nets of growing size.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::{AnalysisBudget, ExplorationEnd, explore_states};
use armor_petri::{Net, NetState, PlaceId};

/// Measures and prints both tables; each figure is the best of `rounds`.
///
/// # Errors
/// If a count is not the published one.
pub fn measure_nets(rounds: usize) -> Result<()> {
    println!("| net | states | edges | s | M states/s | B/state |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    for (tokens, states, edges) in
        [(2, 4_600, 28_120), (3, 58_400, 446_400), (5, 2_546_432, 24_460_016)]
    {
        count_states(tokens, states, edges, rounds)?;
    }
    println!("\n| places | tokens | ns/firing | M firings/s |");
    println!("| ---: | ---: | ---: | ---: |");
    for places in [100, 300, 1_000, 3_000, 10_000] {
        for tokens in [1, 10] {
            measure_firing(places, tokens, rounds)?;
        }
    }
    Ok(())
}

fn count_states(tokens: u32, states: u64, edges: u64, rounds: usize) -> Result<()> {
    let net = build_kanban(tokens)?;
    let mut best = Duration::MAX;
    let mut bytes = 0;
    for _ in 0..rounds {
        let start = Instant::now();
        let bounds = PlaceBounds::of_net(&net, &|| false);
        let found = explore_states(&net, &bounds, false, &AnalysisBudget::UNLIMITED);
        best = best.min(start.elapsed());
        bytes = found.space.bytes();
        let counts = (found.space.states(), found.space.edges());
        ensure!(
            found.ending == ExplorationEnd::Complete && counts == (states, edges),
            "counted {counts:?}"
        );
    }
    println!(
        "| Kanban-{tokens} | {states} | {edges} | {:.3} | {:.2} | {:.1} |",
        best.as_secs_f64(),
        states as f64 / best.as_secs_f64() / 1e6,
        bytes as f64 / states as f64,
    );
    Ok(())
}

/// Tokens move round a ring; there are enough firings for the clock's resolution.
fn measure_firing(places: u32, tokens: u32, rounds: usize) -> Result<()> {
    const FIRINGS: u32 = 2_000_000;
    let mut net = Net::builder();
    for place in 0..places {
        net.place(format!("p{place}"), u32::from(place % (places / tokens) == 0));
    }
    for place in 0..places {
        let next = PlaceId((place + 1) % places);
        net.transition(format!("t{place}")).input(PlaceId(place), 1).output(next, 1);
    }
    let net = Arc::new(net.build()?);
    let mut best = Duration::MAX;
    for _ in 0..rounds {
        let mut state = NetState::new(Arc::clone(&net), Duration::ZERO);
        let start = Instant::now();
        for _ in 0..FIRINGS {
            let Some(transition) = state.first_ready() else { break };
            state.fire(transition)?;
        }
        best = best.min(start.elapsed());
        black_box(state.marking());
    }
    let seconds = best.as_secs_f64() / f64::from(FIRINGS);
    println!("| {places} | {tokens} | {:.0} | {:.2} |", seconds * 1e9, 1e-6 / seconds);
    Ok(())
}

/// Ciardo's Kanban system: four cells, the second and third filled and emptied together.
fn build_kanban(tokens: u32) -> Result<Net> {
    let mut net = Net::builder();
    let mut cell = |i: usize| {
        let place =
            |net: &mut armor_petri::NetBuilder, stem: &str, n| net.place(format!("{stem}{i}"), n);
        [("P", tokens), ("Pm", 0), ("Pback", 0), ("Pout", 0)]
            .map(|(stem, n)| place(&mut net, stem, n))
    };
    let cells = [cell(1), cell(2), cell(3), cell(4)];
    for (i, [_, machine, back, out]) in cells.iter().enumerate() {
        net.transition(format!("redo{i}")).input(*machine, 1).output(*back, 1);
        net.transition(format!("back{i}")).input(*back, 1).output(*machine, 1);
        net.transition(format!("ok{i}")).input(*machine, 1).output(*out, 1);
    }
    let [[p1, m1, _, out1], [p2, m2, _, out2], [p3, m3, _, out3], [p4, m4, _, out4]] = cells;
    net.transition("in").input(p4, 1).output(m4, 1);
    let synchronised = net.transition("4 to 2 and 3").input(p2, 1).input(p3, 1).input(out4, 1);
    synchronised.output(p4, 1).output(m2, 1).output(m3, 1);
    let synchronised = net.transition("2 and 3 to 1").input(p1, 1).input(out2, 1).input(out3, 1);
    synchronised.output(p2, 1).output(p3, 1).output(m1, 1);
    net.transition("out").input(out1, 1).output(p1, 1);
    Ok(net.build()?)
}
