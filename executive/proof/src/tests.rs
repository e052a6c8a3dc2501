//! Proves missions and checks the findings.

use crate::analysed::Analysed;
use crate::proof::ProofEffort;
use crate::prove::{prove, prove_within};
use armor_plan::Plan;
use armor_robotfile::{Code, Colours, Finding, FindingOrigin, Findings, PageExample, check, read};

mod claims;
mod dice;
mod explained;
mod follow_ups;
mod forgotten;
mod large;
mod one_cause;
mod outcomes;
mod random;
mod routes;
mod silent;
mod variables;

/// The findings, without the one that states how long the mission takes.
fn proven(file: &str) -> Findings {
    let mut findings = Findings::default();
    let found = all_proven(file, ProofEffort::default()).into_iter();
    findings.extend(found.filter(|finding| finding.code != Code::Takes));
    findings
}

fn few(states: u64, classes: u64) -> ProofEffort {
    ProofEffort { states, classes, ..ProofEffort::default() }
}

fn all_proven(file: &str, effort: ProofEffort) -> Findings {
    let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
    let reading = check(reading, &[], None);
    assert!(reading.is_valid(), "{}", reading.findings.render(Colours::No));
    let configuration = reading.configuration.expect("it is valid");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    prove_within(&configuration, &plan, effort, &|| false)
}

/// Codes of the proof whose pages describe an example instead of showing one: too large, or not a
/// finding of the text output.
const WITHOUT_EXAMPLE: [Code; 5] =
    [Code::NotProven, Code::Takes, Code::ValuesOpen, Code::CheckUndecided, Code::ProvenByRoutes];

fn text_of(example: Option<PageExample>) -> Option<String> {
    let example = example?;
    Some(String::from_utf8(example.file("robot.xml")?.to_vec()).expect("UTF-8"))
}

#[test]
fn every_page_shows_what_is_found_and_its_fixed_example_is_proven() {
    let of_proof = Code::ALL.iter().filter(|code| code.origin() == FindingOrigin::Proof);
    for code in of_proof.copied() {
        let Some(faulty) = text_of(code.faulty_example()) else {
            assert!(WITHOUT_EXAMPLE.contains(&code), "{code:?} has no example");
            continue;
        };
        let page = code.page();
        let printed = page.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
        let printed = printed.expect("a text block");
        let findings = proven(&faulty);
        let mut own = Findings::default();
        own.extend(findings.into_iter().filter(|finding| finding.code == code));
        let rendered = own.render(Colours::No);
        let rendered = rendered.rsplit_once("\n\n").map_or(rendered.as_str(), |found| found.0);
        if std::env::var_os("ARMOR_BLESS").is_some() {
            let path =
                format!("{}/../../docs/errors/{}.md", env!("CARGO_MANIFEST_DIR"), code.as_str());
            let page =
                page.replace(&format!("```text\n{printed}"), &format!("```text\n{rendered}\n"));
            std::fs::write(path, page).expect("it can be written");
        } else {
            assert_eq!(rendered, printed.trim_end(), "{code:?}");
        }
        let rest = proven(&text_of(code.fixed_example()).expect("a fixed example"));
        assert!(rest.is_empty(), "{code:?}, fixed:\n{}", rest.render(Colours::No));
    }
}

const OVER: &str = "<place name='over'/><place name='hold'/>";

fn mission(net: &str) -> String {
    format!(
        "<armor version='1'><system><component name='a' kind='k'/><component name='b' kind='k'/>
         </system><mission goal='over' safe='hold'>{OVER}{net}</mission></armor>"
    )
}

fn codes(net: &str) -> Vec<&'static str> {
    proven(&mission(net)).iter().map(|finding| finding.code.as_str()).collect()
}

#[test]
fn a_transition_whose_places_are_never_marked_together_is_dead() {
    let net = "<place name='x' initial='true'/><place name='y'/>
        <transition name='t' from='x' to='y' timeout='1s'/>
        <transition name='both' from='x y' to='over' timeout='2s'/>
        <transition name='u' from='y' to='over' timeout='1s'/>";
    assert_eq!(codes(net), ["W0217"]);
}

#[test]
fn of_a_chain_that_is_never_entered_only_the_first_transition_is_reported() {
    let net = "<place name='x' initial='true'/><place name='y'/><place name='z'/><place name='w'/>
        <transition name='t' from='x' to='over' timeout='1s'/>
        <transition name='u' from='x over' to='y'/><transition name='v' from='y' to='z'/>
        <transition name='w' from='z' to='w'/>";
    let findings = proven(&mission(net));
    let [finding] = &findings.iter().collect::<Vec<_>>()[..] else { panic!("{findings:?}") };
    assert!(finding.message.starts_with("u never fires"), "{}", finding.message);
}

#[test]
fn a_mission_that_is_over_at_its_start_has_one_finding() {
    let net = "<place name='x'/><place name='y' components='a'/>
        <transition name='t' from='x' to='y'/><transition name='u' from='y' to='over' on='a.done'/>
        <transition name='v' from='y' to='hold' timeout='1s'/>
        <transition name='w' from='over hold' to='x'/>";
    let over = |place: &str| {
        let initial = format!("<place name='{place}' initial='true'/>");
        mission(net).replace(&format!("<place name='{place}'/>"), &initial)
    };
    for (place, code) in [("over", "W0262"), ("hold", "E0241")] {
        let findings = proven(&over(place));
        let [finding] = &findings.iter().collect::<Vec<_>>()[..] else { panic!("{findings:?}") };
        assert_eq!(finding.code.as_str(), code);
        assert!(finding.message.contains("over at its start"), "{}", finding.message);
        assert_eq!(finding.at.as_ref().map(|at| at.text()), Some(place));
    }
    let endless = over("hold").replace(" goal='over'", "");
    let findings = proven(&endless);
    assert_eq!(findings.iter().map(|it| it.code.as_str()).collect::<Vec<_>>(), ["W0262"]);
}

#[test]
fn a_transition_without_from_hides_its_consequences() {
    let net = "<place name='x' initial='true' components='a'/><place name='y' components='b'/>
        <exclusive components='a b'/><transition name='t' from='x' to='y' on='a.done'/>
        <transition name='u' from='y' to='over' on='b.done'/>
        <transition name='late' FROM to='y' timeout='5s'/>
        <check>always x + y &lt;= 1</check>";
    let found = |from: &str| {
        let file = mission(&net.replace("FROM", from));
        let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.clone().into_bytes()));
        let reading = check(reading, &[], None);
        let configuration = reading.configuration.expect("a mission");
        let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
        let proven = prove(&configuration, &plan, &|| false);
        let all = reading.findings.into_iter().chain(proven);
        all.map(|finding| finding.code.as_str()).filter(|code| *code != "N0247").collect::<Vec<_>>()
    };
    assert_eq!(found("from='x'"), [""; 0]);
    // The check that it refutes is an error, and stays one.
    assert_eq!(found(""), ["W0261", "E0252"]);
}

#[test]
fn an_emergency_exit_is_proven() {
    let net = "<place name='x' initial='true' components='a'/>
        <transition name='t' from='x' to='over' on='a.done'/>
        <transition name='stop' to='hold' class='safety' operator='true'/>";
    assert_eq!(codes(net), [""; 0]);
}

#[test]
fn a_place_that_only_an_emergency_leaves_is_a_dead_end() {
    let work = "<place name='x' initial='true' components='a'/>
        <transition name='t' from='x' to='over' on='a.done'/>";
    let stop = |how: &str| format!("<transition name='stop' to='hold' class='safety' {how}/>");
    let stuck =
        format!("{work}<place name='y'/><transition name='u' from='x' to='y' timeout='5s'/>");
    let circle = format!(
        "{stuck}<place name='z'/><transition name='v' from='y' to='z' timeout='1s'/>
         <transition name='w' from='z' to='y' timeout='1s'/>"
    );
    for how in ["operator='true'", "on='b.stopped'", "operator='true' on-start-fail='hold'"] {
        assert_eq!(codes(&format!("{work}{}", stop(how))), [""; 0]);
        let findings = proven(&mission(&format!("{stuck}{}", stop(how))));
        let [finding] = &findings.iter().collect::<Vec<_>>()[..] else { panic!("{findings:?}") };
        assert_eq!(finding.code, Code::Standstill);
        let shown = "after u the mission stands still, with a token in y; only an emergency (stop)";
        assert!(finding.message.starts_with(shown), "{}", finding.message);
        assert_eq!(codes(&format!("{circle}{}", stop(how))), ["W0243"]);
    }
    // A time after which it always fires is a regular exit.
    assert_eq!(codes(&format!("{stuck}{}", stop("timeout='1min'"))), [""; 0]);
    assert_eq!(codes(&format!("{stuck}{}", stop("timeout='1min' operator='true'"))), ["W0242"]);
}

#[test]
fn the_end_ends_it_whatever_could_still_fire() {
    // The mission ends when `over` is marked, so no place can grow afterwards.
    let net = "<place name='x' initial='true'/>
        <transition name='t' from='x' to='over' timeout='1s'/>
        <transition name='more' from='over' to='over x' timeout='1s'/>";
    assert_eq!(codes(net), ["W0217"], "`more` never fires");
}

#[test]
fn what_the_file_specifies_for_failures_is_analysed() {
    // `y` is reached only if the component does not stop; no transition leaves `y`.
    let net = "<place name='x' initial='true' components='a'/><place name='y'/>
        <transition name='t' from='x' to='over' on='a.done' on-stop-fail='y'/>";
    let findings = proven(&mission(net));
    let [finding] = &findings.iter().collect::<Vec<_>>()[..] else { panic!("{findings:?}") };
    assert_eq!(finding.code, Code::Standstill);
    assert!(finding.message.contains("t/on-stop-fail"), "{}", finding.message);
    let net = "<place name='x' initial='true' components='a' on-failure='y'/><place name='y'/>
        <transition name='t' from='x' to='over' on='a.done'/>";
    assert_eq!(codes(net), ["W0242"]);
}
