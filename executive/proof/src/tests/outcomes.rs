//! Outcomes that follow from more than the transitions of the file: starts that wait for each
//! other, operators who do not answer, and times that exclude or bound what tokens alone allow.

use super::*;

/// Codes and messages of the findings, without the one that states how long the mission takes.
fn codes_and_messages(net: &str) -> Vec<(&'static str, String)> {
    let findings = proven(&mission(net)).into_iter();
    findings.map(|finding| (finding.code.as_str(), finding.message)).collect()
}

/// Returns the checks that fail or are undecided.
fn refuted(net: &str, checks: &[&str]) -> Vec<String> {
    let escaped =
        checks.iter().map(|check| format!("<check>{}</check>", check.replace('<', "&lt;")));
    let findings = proven(&mission(&format!("{net}{}", escaped.collect::<String>())));
    let own = findings.iter().filter(|f| matches!(f.code, Code::CheckFails | Code::CheckUndecided));
    own.map(|f| f.at.as_ref().expect("a place").text().replace("&lt;", "<")).collect()
}

/// `u` leads into `y`, whose component excludes that of `x`.
const MEETING: &str =
    "<place name='x' initial='true' components='a'/><place name='y' components='b'/>
    <place name='w' initial='true'/><exclusive components='a b'/>
    <transition name='u' from='w' to='y' timeout='2s'/>";

#[test]
fn a_start_that_waits_for_what_waits_for_it_is_a_standstill() {
    let net = format!("{MEETING}<transition name='v' from='x y' to='over' timeout='2s'/>");
    let findings = codes_and_messages(&net);
    assert_eq!(
        findings.iter().map(|it| it.0).collect::<Vec<_>>(),
        ["W0245", "E0241"],
        "{findings:?}"
    );
    assert!(
        findings[1].1.contains("on its way into y, which waits until x is left"),
        "{findings:?}"
    );
    let checks =
        ["eventually over", "always reachable(over)", "duration(over) <= 4s", "reachable(over)"];
    assert_eq!(refuted(&net, &checks), checks);
    assert_eq!(refuted(&net, &["never x and y", "dead(v)", "fires(u)"]), [""; 0]);
}

#[test]
fn where_the_goal_is_out_of_reach_only_on_that_way_the_standstill_is_shown() {
    let net = format!(
        "{MEETING}<transition name='v' from='x y' to='over' timeout='2s'/>
         <transition name='other' from='x w' to='over' on='a.done'/>"
    );
    let findings = codes_and_messages(&net);
    let still = findings.iter().find(|it| it.0 == "W0242").expect("a finding");
    assert!(
        still.1.starts_with("after u the mission stands still, with a token in x"),
        "{still:?}"
    );
    assert!(still.1.contains("on its way into y, which waits until x is left"), "{still:?}");
}

#[test]
fn a_start_that_may_wait_continues_when_the_other_is_left() {
    let net = format!(
        "{MEETING}<place name='z'/>
         <transition name='leave' from='x' to='z' interval='[1s,5s]'/>
         <transition name='v' from='y z' to='over' timeout='2s'/>"
    );
    assert_eq!(codes_and_messages(&net).iter().map(|it| it.0).collect::<Vec<_>>(), ["W0245"]);
    let hold = ["eventually over", "duration(over) <= 7s", "duration(over) >= 4s", "never x and y"];
    assert_eq!(refuted(&net, &hold), [""; 0]);
    // A start that nothing blocks takes no time, so no check sees the state between the two phases
    // of its firing.
    assert_eq!(
        refuted(&net, &["always w or y or x or over", "duration(over) < 7s"]),
        ["duration(over) < 7s"]
    );
}

fn asking(unanswered: &str, more: &str) -> String {
    format!(
        "<place name='x' initial='true'/>
         <transition name='t' from='x' to='over' autonomy='confirm' answer-within='5s' {unanswered}/>{more}"
    )
}

#[test]
fn silence_that_declines_is_an_outcome() {
    let net = asking("unanswered='decline'", "");
    let findings = codes_and_messages(&net);
    let [(code, message)] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!(
        (*code, message.as_str()),
        ("W0242", "after t/declined the mission stands still, with a token in x")
    );
    let checks = ["eventually over or hold", "x leads to over", "always reachable(over)"];
    assert_eq!(refuted(&net, &checks), checks);
    assert_eq!(refuted(&net, &["reachable(over)", "fires(t)"]), [""; 0]);
    // Here another transition leads on after `t` was declined.
    let net = asking(
        "unanswered='decline'",
        "<transition name='late' from='x' to='hold' timeout='60s'/>",
    );
    assert_eq!(
        refuted(&net, &["eventually over or hold", "duration(over or hold) <= 60s"]),
        [""; 0]
    );
}

#[test]
fn what_was_declined_asks_again_once_it_is_newly_enabled() {
    let more = "<place name='y'/><transition name='out' from='x' to='y' timeout='30s'/>
        <transition name='back' from='y' to='x' timeout='1s'/>";
    let net = asking("unanswered='decline'", more);
    assert_eq!(refuted(&net, &["always reachable(over)"]), [""; 0]);
    assert_eq!(refuted(&net, &["eventually over"]), ["eventually over"]);
}

#[test]
fn silence_that_fires_has_a_latest_moment() {
    let net = asking("unanswered='fire'", "");
    assert_eq!(refuted(&net, &["eventually over", "duration(over) <= 5s"]), [""; 0]);
    assert_eq!(refuted(&net, &["duration(over) < 5s"]), ["duration(over) < 5s"]);
    let findings = all_proven(&mission(&net), ProofEffort::default());
    let takes = findings.iter().find(|f| f.code == Code::Takes).expect("a finding");
    assert_eq!(takes.message, "over comes after 0 s to 5 s");
    // The link may stay lost for any duration, so there is no latest moment.
    let net = asking("unanswered='fire' lost-link='wait'", "");
    assert_eq!(refuted(&net, &["duration(over) <= 5s"]), ["duration(over) <= 5s"]);
}

const MAKE: &str = "<place name='x' initial='true'/><place name='n'/>
    <transition name='make' from='x' to='x n' timeout='4s'/>";

#[test]
fn a_place_that_times_bound_does_not_fill() {
    let net = format!(
        "{MAKE}<transition name='use' from='n' to='' timeout='1s'/>
         <transition name='stop' from='x' to='over' operator='true'/>"
    );
    assert_eq!(codes_and_messages(&net), []);
    assert_eq!(refuted(&net, &["bounded(n)", "bounded(n) <= 1"]), [""; 0]);
}

#[test]
fn a_place_that_fills_does_not_hide_what_else_is_found() {
    let net = format!(
        "{MAKE}<place name='edge'/><place name='trap'/>
         <transition name='near' from='x' to='edge' interval='[1s,9s]'/>
         <transition name='fall' from='edge' to='trap' operator='true'/>
         <transition name='stop' from='x' to='over' operator='true'/>"
    );
    let findings = codes_and_messages(&net);
    assert_eq!(
        findings.iter().map(|it| it.0).collect::<Vec<_>>(),
        ["W0240", "W0242"],
        "{findings:?}"
    );
}

#[test]
fn a_goal_that_never_comes_in_time_is_reported() {
    let net = "<place name='x' initial='true'/><place name='y'/>
        <transition name='t' from='x' to='y'/><transition name='u' from='y' to='x'/>
        <transition name='v' from='x' to='over' timeout='1s'/>";
    let findings = codes_and_messages(net);
    let goal = findings.iter().find(|it| it.0 == "E0241").unwrap_or_else(|| panic!("{findings:?}"));
    assert!(goal.1.contains("never comes in time"), "{goal:?}");
}
