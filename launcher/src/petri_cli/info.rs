//! `armor net info`: how large a net's state space is, exactly, or which budget ran out.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use super::arguments::ProofLimits;
use super::net_facts::{NetFacts, format_sequence, load_net, option_of, run_within_budget};
use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line, print_text};

/// Known values are present; `null` is unbounded; missing values were not decided.
#[derive(Debug, Default, Serialize)]
struct Info {
    places: usize,
    transitions: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    states: Option<Option<u64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    edges: Option<Option<u64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_tokens_in_place: Option<Option<u64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_tokens_per_marking: Option<Option<u64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    deadlocks: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bounded: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    undecided: Option<&'static str>,
}

/// Prints the counts.
///
/// # Errors
/// If the file cannot be read or contains no net.
pub fn print_info(
    path: &Path,
    budget: &ProofLimits,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let file = load_net(path)?;
    let facts =
        run_within_budget(budget, |budget| NetFacts::gather_facts(&file.net, false, budget));
    let info = info(&file.net, &facts);
    if format == OutputFormat::Json {
        return end_printing(print_line(serde_json::to_string(&info)?));
    }
    let mut shown = text(&info);
    if let Some(pumping) = &facts.pumping {
        let net = &file.net;
        let growing: Vec<_> = pumping.growing.iter().map(|place| net.place(*place)).collect();
        let _ = writeln!(shown, "growing                {}", growing.join(" "));
        let _ = writeln!(shown, "after                  {}", format_sequence(net, &pumping.prefix));
        let _ = writeln!(shown, "again and again        {}", format_sequence(net, &pumping.cycle));
    }
    if let (Some(_), Some(space)) = (facts.undecided, &facts.space) {
        let _ = writeln!(shown, "states seen            {}", space.states());
    }
    end_printing(print_text(shown))
}

fn info(net: &armor_petri::Net, facts: &NetFacts) -> Info {
    let mut info = Info {
        places: net.places().len(),
        transitions: net.transitions().len(),
        bounded: facts.decide_bounds(),
        undecided: facts.undecided.map(option_of),
        ..Info::default()
    };
    if facts.pumping.is_some() {
        info.states = Some(None);
        info.edges = Some(None);
        info.max_tokens_in_place = Some(None);
        info.max_tokens_per_marking = Some(None);
    } else if let Some(space) = facts.all_states() {
        info.states = Some(Some(space.states()));
        info.edges = Some(Some(space.edges()));
        info.max_tokens_in_place = Some(Some(u64::from(space.max_tokens_in_place())));
        info.max_tokens_per_marking = Some(Some(space.max_tokens_per_marking()));
        info.deadlocks = Some(space.deadlocks());
    }
    info
}

fn text(info: &Info) -> String {
    let number = |number: Option<Option<u64>>| match number {
        Some(Some(number)) => number.to_string(),
        Some(None) => "without end".into(),
        None => "not decided".into(),
    };
    let bounded = match info.bounded {
        Some(true) => "yes",
        Some(false) => "no",
        None => "not decided",
    };
    let mut rows = vec![
        ("places", info.places.to_string()),
        ("transitions", info.transitions.to_string()),
        ("states", number(info.states)),
        ("edges", number(info.edges)),
        ("max tokens in place", number(info.max_tokens_in_place)),
        ("max tokens per marking", number(info.max_tokens_per_marking)),
        ("deadlocks", number(info.deadlocks.map(Some))),
        ("bounded", bounded.into()),
    ];
    if let Some(option) = info.undecided {
        rows.push(("undecided", format!("--{option} ran out")));
    }
    rows.iter().map(|(name, value)| format!("{name:22} {value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_petri::analysis::AnalysisBudget;
    use armor_petri::file::tina;

    fn check(text: &str, states: u64, expected: &str) {
        let net = tina::read(text).expect("a net").net;
        let budget = AnalysisBudget { states, ..AnalysisBudget::UNLIMITED };
        let found = info(&net, &NetFacts::gather_facts(&net, false, &budget));
        assert_eq!(serde_json::to_string(&found).expect("plain numbers"), expected, "{text}");
    }

    #[test]
    fn only_what_is_decided_is_printed() {
        check(
            "tr t p -> q\npl p (2)",
            u64::MAX,
            r#"{"places":2,"transitions":1,"states":3,"edges":2,"max_tokens_in_place":2,"max_tokens_per_marking":2,"deadlocks":1,"bounded":true}"#,
        );
        check(
            "tr t p -> q\npl p (2)",
            2,
            r#"{"places":2,"transitions":1,"bounded":true,"undecided":"max-states"}"#,
        );
        check(
            "tr t -> q",
            u64::MAX,
            r#"{"places":1,"transitions":1,"states":null,"edges":null,"max_tokens_in_place":null,"max_tokens_per_marking":null,"bounded":false}"#,
        );
        // Bounded by an inhibitor arc, which no invariant sees: not known unless all is seen.
        let held = "tr t q?-5 -> q";
        check(held, 3, r#"{"places":1,"transitions":1,"undecided":"max-states"}"#);
    }
}
