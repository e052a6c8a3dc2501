//! Counts the states of a net: `cargo run --release -p armor-petri --example states -- FILE`.

use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::{AnalysisBudget, explore_states};
use armor_petri::file::{decode_text, pnml, tina};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for path in std::env::args().skip(1) {
        let text = decode_text(&std::fs::read(&path)?)?;
        let file = if path.ends_with(".net") { tina::read(&text) } else { pnml::read(&text) }?;
        let start = Instant::now();
        let stop = || start.elapsed().as_secs() > 120;
        let bounds = PlaceBounds::of_net(&file.net, &stop);
        let bounded_s = start.elapsed().as_secs_f64();
        let budget =
            AnalysisBudget { memory_bytes: 4 << 30, stop: &stop, ..AnalysisBudget::UNLIMITED };
        let found = explore_states(&file.net, &bounds, false, &budget);
        let (space, seconds) = (&found.space, start.elapsed().as_secs_f64());
        println!(
            "{path}: {:?}, {} states, {} edges, at most {} and {} tokens, {} deadlocks; \
             {bounded_s:.2} s bounds (all {}), {seconds:.2} s, {:.2} M states/s, {:.1} B/state",
            found.ending,
            space.states(),
            space.edges(),
            space.max_tokens_in_place(),
            space.max_tokens_per_marking(),
            space.deadlocks(),
            bounds.is_bounded(),
            space.states() as f64 / seconds / 1e6,
            space.bytes() as f64 / space.states() as f64,
        );
    }
    Ok(())
}
