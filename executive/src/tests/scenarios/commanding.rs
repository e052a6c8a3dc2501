//! Operators: firing, confirming and declining transitions, the lease, and lost connections.

use super::bench::{Bench, MS, Office, SECOND, office};
use crate::order::MissionOrder;
use crate::terms::{ComponentReport, MissionOutcome};
use crate::tests::simulation::draft::Way;
use armor_marking::{FiringDecider, UnansweredAction};
use armor_robotfile::mission::{Autonomy, LostLink};
use std::time::Duration;

fn fire(name: &str) -> MissionOrder {
    MissionOrder::Fire(name.to_owned())
}

fn confirm(name: &str) -> MissionOrder {
    MissionOrder::Confirm(name.to_owned())
}

fn decline(name: &str) -> MissionOrder {
    MissionOrder::Decline(name.to_owned())
}

/// The office with `recall`, an operator's transition from `explore` to `return`.
fn with_recall(autonomy: Autonomy, lost_link: Option<LostLink>) -> Office {
    let office = office();
    let (from, to) = (vec![office.explore], vec![office.back]);
    office.with("recall", Way { from, to, autonomy, lost_link, ..Way::default() })
}

fn asking(within: Option<Duration>, fire_unanswered: bool) -> Autonomy {
    Autonomy::Confirm { within, fire_unanswered }
}

#[test]
fn an_operator_fires_what_is_theirs_and_enabled_and_nothing_else() {
    let mut office = with_recall(Autonomy::Operator, None);
    let (explore, back, home) = (office.explore, office.back, office.home);
    let way = |from, to, after| Way { from: vec![from], to: vec![to], after, ..Way::default() };
    office = office.with("late", way(explore, back, Some(60 * SECOND)));
    let mut slow = way(explore, back, Some(3 * SECOND));
    slow.autonomy = Autonomy::Operator;
    let mut end = way(back, home, None);
    end.autonomy = Autonomy::Operator;
    let mut bench = Bench::begun(office.with("slow", slow).with("end", end));
    bench.pass(SECOND);
    assert_eq!(bench.wanted(), [] as [&str; 0], "it does not fire by itself");
    for (name, refused) in [
        ("late", "`late` is not the operator's: it fires by itself"),
        ("none", "the mission has no transition called `none`; it has: recall, late, slow, end"),
        ("end", "`end` is not enabled: `return` holds 0 of the 1 tokens it needs"),
        ("slow", "`slow` may not fire yet: its time comes in 2.0 s"),
    ] {
        assert_eq!(bench.orders("ruth", fire(name)), format!("refused: {refused}"));
    }
    assert_eq!(bench.orders("ruth", fire("recall")), "accepted: `recall` fires");
    assert_eq!(bench.wanted(), ["freeze explorer"], "two-phase like every firing");
    assert!(bench.orders("ruth", fire("recall")).contains("is not enabled"), "in flight");
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
    let shown = bench.controller.marking(0.0);
    assert_eq!(shown.enabled[0].by, FiringDecider::Operator);
    assert_eq!(shown.orders.len(), 6);
    assert!(shown.orders[4].accepted && shown.orders[4].order == "fire recall");
    assert_eq!((shown.orders[4].author.as_str(), shown.orders[4].given_at_s), ("ruth", 1.0));
}

#[test]
fn a_repeated_order_is_answered_again_and_not_carried_out_again() {
    let mut office = with_recall(Autonomy::Operator, None);
    let (explore, back) = (office.explore, office.back);
    let again = Way { from: vec![back], to: vec![explore], after: Some(SECOND), ..Way::default() };
    office = office.with("again", again);
    let mut bench = Bench::begun(office);
    let answer = bench.orders_as("ruth", 77, false, fire("recall"));
    assert_eq!(answer, "accepted: `recall` fires");
    bench.obey();
    bench.pass(SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["explore"], "round once");
    assert_eq!(bench.orders_as("ruth", 77, false, fire("recall")), answer);
    assert_eq!(bench.marked(), ["explore"]);
    bench.restarts();
    assert_eq!(bench.orders_as("ruth", 77, false, fire("recall")), answer, "in the journal too");
    assert_eq!(bench.controller.ledger().fired(), 2);
}

#[test]
fn an_order_that_was_written_down_is_carried_out_after_a_crash() {
    let mut bench = Bench::begun(with_recall(Autonomy::Operator, None));
    bench.orders("ruth", fire("recall"));
    // The executive is killed when only the order itself has been written to the journal.
    let order = bench.records.iter().position(|r| format!("{r:?}").contains("Ordered")).unwrap();
    bench.records.truncate(order + 1);
    bench.restarts();
    bench.everybody_appears();
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn the_safe_place_is_ordered_by_anyone_in_any_phase() {
    for phase in 0..3 {
        let office = office();
        let (explorer, explored) = (office.explorer, office.explored());
        let mut bench = Bench::begun(office.with("explored", explored));
        bench.orders("ruth", MissionOrder::Lease);
        if phase > 0 {
            bench.done(explorer);
        }
        if phase > 1 {
            bench.report_state(explorer, crate::roster::Doing::Frozen, bench.activation(explorer));
        }
        assert_eq!(bench.orders("sam", MissionOrder::Safe), "accepted: the mission goes to `hold`");
        let again = bench.orders("tim", MissionOrder::Safe);
        assert_eq!(again, "accepted: the mission is on its way to its safe place");
        assert_eq!(bench.orders("ruth", fire("explored")), "refused: the mission is ending");
        bench.obey();
        assert_eq!(bench.marked(), ["hold"], "phase {phase}");
        assert_eq!(bench.wanted().last().map(String::as_str), Some("Safe"));
        assert_eq!(bench.controller.ledger().why(), "sam ordered it");
    }
}

#[test]
fn a_repeated_pause_changes_nothing_and_does_not_fill_the_journal() {
    let mut bench = Bench::begun(with_recall(Autonomy::Operator, None));
    assert_eq!(bench.orders("sam", MissionOrder::Pause), "accepted: the mission is paused");
    let before = bench.records.len();
    for count in 1..=1000_u64 {
        let mut expected = "accepted: the mission is paused already, by sam".to_owned();
        if count > 1 && count.is_power_of_two() {
            expected += &format!("; ordered {count} times meanwhile");
        }
        assert_eq!(bench.orders("sam", MissionOrder::Pause), expected);
    }
    let last = bench.orders("sam", MissionOrder::Pause);
    let repeated = bench.request;
    // The 1st, 2nd, 4th … 512th.
    assert_eq!(bench.records.len() - before, 10);
    let written = format!("{:?}", bench.records.last().unwrap());
    assert!(written.contains("ordered 512 times meanwhile"), "{written}");
    assert_eq!(bench.controller.marking(0.0).unwritten_orders, 991);
    bench.orders("tom", MissionOrder::Pause);
    assert_eq!(bench.records.len() - before, 11, "that of another author is written down");
    assert_eq!(bench.orders("sam", MissionOrder::Resume), "accepted: the mission continues");
    // Its answer was lost.
    assert_eq!(bench.orders_as("sam", repeated, false, MissionOrder::Pause), last);
    assert!(bench.controller.marking(0.0).pause.is_none(), "it pauses nothing");
    assert_eq!(bench.orders("sam", MissionOrder::Pause), "accepted: the mission is paused");
    let before = bench.records.len();
    bench.orders("sam", MissionOrder::Pause);
    assert_eq!(bench.records.len() - before, 1, "each pause counts from the begin");
}

#[test]
fn the_holder_of_the_lease_commands_until_it_is_released_or_taken() {
    let mut bench = Bench::begun(with_recall(Autonomy::Operator, None));
    assert_eq!(
        bench.orders("ruth", MissionOrder::Release),
        "refused: no operator holds the command"
    );
    assert_eq!(bench.orders("ruth", MissionOrder::Lease), "accepted: the command is yours");
    let refused =
        "refused: ruth commands this mission (tool-ruth): ask for the command, or take it over";
    for order in [MissionOrder::Lease, MissionOrder::Release, MissionOrder::Resume, fire("recall")]
    {
        assert_eq!(bench.orders("sam", order), refused);
    }
    assert_eq!(
        bench.orders("sam", MissionOrder::Pause),
        "accepted: the mission is paused",
        "anyone may"
    );
    assert_eq!(bench.orders("sam", MissionOrder::Resume), refused);
    assert_eq!(bench.orders("ruth", MissionOrder::Resume), "accepted: the mission continues");
    assert_eq!(bench.controller.ledger().lease().map(|l| l.by.author.as_str()), Some("ruth"));
    let holder = bench.controller.marking(0.0).holder.unwrap();
    assert!(holder.connected && holder.from == "tool-ruth" && holder.runs_out_at_s.is_none());
    bench.obey();
    bench.orders("ruth", MissionOrder::Release);
    assert!(bench.orders("sam", MissionOrder::Lease).starts_with("accepted"));
    assert!(bench.takes_over("ruth", fire("recall")).starts_with("accepted"));
    assert_eq!(bench.controller.ledger().lease(), None, "sam has lost it, ruth wanted one order");
    assert_eq!(bench.controller.marking(0.0).link_lost_at_s, None);
    bench.leaves("sam");
    bench.pass(60 * SECOND);
    assert_eq!(bench.controller.marking(0.0).link_lost_at_s, None, "no lease, no link to lose");
}

#[test]
fn a_holder_whose_lease_is_taken_is_informed_immediately_and_does_not_regain_it() {
    let mut bench = Bench::begun(with_recall(Autonomy::Operator, None));
    assert_eq!(
        bench.orders("ruth", MissionOrder::Rejoin),
        "refused: no operator holds the command"
    );
    bench.orders("ruth", MissionOrder::Lease);
    let refused = bench.takes_over("sam", fire("none"));
    assert!(refused.starts_with("refused"), "{refused}");
    assert_eq!(bench.unasked(), [] as [&str; 0], "what is refused takes nothing");
    assert_eq!(bench.controller.ledger().lease().map(|l| l.by.author.as_str()), Some("ruth"));
    assert_eq!(
        bench.takes_over("sam", MissionOrder::Pause),
        "accepted: the mission is paused; the command is taken from ruth"
    );
    assert_eq!(bench.unasked(), ["refused: sam has taken the command over"]);
    bench.restarts();
    assert_eq!(
        bench.orders("ruth", MissionOrder::Rejoin),
        "refused: no operator holds the command"
    );
    bench.orders("sam", MissionOrder::Lease);
    let refused = bench.takes_over("ruth", MissionOrder::Rejoin);
    assert!(refused.starts_with("refused: sam commands this mission"), "{refused}");
    bench.restarts();
    assert_eq!(bench.orders("sam", MissionOrder::Rejoin), "accepted: the command is yours");
    assert!(bench.controller.marking(0.0).holder.unwrap().connected, "over a new connection");
    let text = bench.takes_over("ruth", MissionOrder::Lease);
    assert_eq!(text, "accepted: the command is yours; the command is taken from sam");
    assert_eq!(bench.unasked(), ["refused: ruth has taken the command over"]);
}

#[test]
fn a_lost_link_fires_the_transitions_that_specify_it_once_the_lease_has_run_out() {
    let mut bench = Bench::begun(with_recall(Autonomy::Operator, Some(LostLink::Fire)));
    bench.orders("ruth", MissionOrder::Lease);
    bench.leaves("ruth");
    bench.pass(4 * SECOND);
    assert_eq!(
        bench.orders("ruth", MissionOrder::Lease),
        "accepted: the command is yours",
        "back in time"
    );
    bench.pass(10 * SECOND);
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    bench.leaves("ruth");
    bench.pass(4900 * MS);
    let holder = bench.controller.marking(0.0).holder.unwrap();
    assert!(!holder.connected && holder.runs_out_at_s == Some(19.0));
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    bench.pass(200 * MS);
    assert_eq!(bench.wanted(), ["freeze explorer"]);
    assert_eq!(bench.controller.marking(0.0).link_lost_at_s, Some(19.0));
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
    bench.orders("sam", MissionOrder::Release);
    assert!(bench.controller.marking(0.0).link_lost_at_s.is_some(), "that order was refused");
    bench.orders("sam", MissionOrder::Lease);
    assert_eq!(bench.controller.marking(0.0).link_lost_at_s, None, "an operator commands again");
}

#[test]
fn a_lost_link_leaves_alone_what_waits_or_specifies_nothing() {
    for lost_link in [None, Some(LostLink::Wait)] {
        let mut bench = Bench::begun(with_recall(Autonomy::Operator, lost_link));
        bench.orders("ruth", MissionOrder::Lease);
        bench.leaves("ruth");
        bench.pass(60 * SECOND);
        assert!(bench.controller.marking(0.0).link_lost_at_s.is_some());
        assert_eq!((bench.wanted(), bench.marked()), (vec![], vec!["explore".into()]));
    }
}

#[test]
fn a_holder_who_does_not_come_back_after_the_executive_was_killed_is_lost() {
    let mut bench = Bench::begun(with_recall(Autonomy::Operator, Some(LostLink::Fire)));
    bench.orders("ruth", MissionOrder::Lease);
    bench.restarts();
    bench.everybody_appears();
    bench.obey();
    bench.pass(4 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(2 * SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn a_transition_that_asks_waits_for_the_answer() {
    let mut bench = Bench::begun(with_recall(asking(None, false), None));
    bench.pass(60 * SECOND);
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    let asked = bench.controller.marking(0.0).confirmations;
    assert_eq!((asked[0].transition.as_str(), asked[0].answer_by_at_s), ("recall", None));
    assert_eq!(bench.orders("ruth", confirm("recall")), "accepted: `recall` fires");
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
    assert_eq!(bench.orders("ruth", confirm("recall")), "refused: `recall` asks nothing now");
    assert_eq!(bench.controller.marking(0.0).confirmations, []);
}

#[test]
fn without_an_answer_in_time_it_does_what_the_file_specifies() {
    for (fires, unanswered) in [(true, UnansweredAction::Fire), (false, UnansweredAction::Decline)]
    {
        let mut bench = Bench::begun(with_recall(asking(Some(5 * SECOND), fires), None));
        bench.pass(4 * SECOND);
        let asked = bench.controller.marking(0.0).confirmations;
        assert_eq!(asked[0].answer_by_at_s, Some(5.0));
        assert_eq!(asked[0].unanswered, unanswered);
        bench.pass(2 * SECOND);
        bench.obey();
        assert_eq!(bench.marked(), [if fires { "return" } else { "explore" }]);
        assert_eq!(bench.controller.marking(0.0).confirmations, []);
    }
}

#[test]
fn what_was_declined_asks_again_when_it_is_newly_enabled() {
    let office = office();
    let (from, to) = (vec![office.explore], vec![office.back]);
    let seen = Some((office.explorer, "seen"));
    let autonomy = asking(None, false);
    let way = Way { from, to, on: seen, autonomy, ..Way::default() };
    let explorer = office.explorer;
    let mut bench = Bench::begun(office.with("look", way));
    let asks = |bench: &Bench| bench.controller.marking(0.0).confirmations.len();
    let see = |bench: &mut Bench| {
        let activation = bench.activation(explorer);
        bench.reports(
            explorer,
            activation,
            ComponentReport::Event { name: "seen".into(), value: 1.0 },
        );
    };
    assert_eq!(asks(&bench), 0, "not enabled");
    see(&mut bench);
    assert_eq!(asks(&bench), 1);
    let answer = "accepted: `look` does not fire, and asks again when it is newly enabled";
    assert_eq!(bench.orders("ruth", decline("look")), answer);
    assert_eq!(bench.orders("ruth", confirm("look")), "refused: `look` has been declined already");
    bench.pass(60 * SECOND);
    assert_eq!(asks(&bench), 0);
    assert_eq!(bench.controller.marking(0.0).enabled[0].by, FiringDecider::Declined);
    see(&mut bench);
    assert_eq!(asks(&bench), 1, "seen once more");
    bench.orders("ruth", confirm("look"));
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn a_pending_question_survives_the_executive_with_its_deadline() {
    let mut bench = Bench::begun(with_recall(asking(Some(5 * SECOND), true), None));
    bench.pass(3 * SECOND);
    bench.restarts();
    assert_eq!(bench.controller.marking(0.0).confirmations[0].answer_by_at_s, Some(5.0));
    bench.everybody_appears();
    bench.obey();
    bench.pass(3 * SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn what_waits_for_the_operator_has_its_whole_time_again_once_one_is_back() {
    let mut bench = Bench::begun(with_recall(asking(Some(8 * SECOND), true), Some(LostLink::Wait)));
    bench.orders("ruth", MissionOrder::Lease);
    bench.leaves("ruth");
    bench.pass(60 * SECOND);
    assert!(bench.controller.marking(0.0).confirmations[0].put_off);
    bench.orders("sam", MissionOrder::Lease);
    assert_eq!(bench.controller.marking(0.0).confirmations[0].answer_by_at_s, Some(68.0));
    bench.pass(9 * SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
    assert_ne!(
        bench.controller.ledger().stage(),
        crate::ledger::MissionStage::Ended(MissionOutcome::Goal)
    );
}

#[test]
fn a_flood_of_refused_orders_is_answered_and_not_written_down() {
    let office = office();
    let explored = office.explored();
    let mut bench = Bench::begun(office.with("explored", explored));
    let before = bench.records.len();
    for second in 1..=2 {
        for _ in 0..50 {
            let answer = bench.orders("ruth", MissionOrder::Fire("explored".into()));
            assert_eq!(answer, "refused: `explored` is not the operator's: it fires by itself");
        }
        assert_eq!(bench.records.len() - before, second * 10);
        bench.pass(SECOND);
    }
    assert_eq!(bench.controller.marking(0.0).unwritten_orders, 80);
    assert_eq!(bench.orders("ruth", MissionOrder::Pause), "accepted: the mission is paused");
}
