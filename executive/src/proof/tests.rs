use super::*;
use armor_robotfile::{Code, Colours, Finding, check, read};

mod claims;
mod large;
mod outcomes;
mod random;
mod variables;

/// What is found beside how long the mission takes.
fn proven(file: &str) -> Findings {
    let mut findings = Findings::default();
    let found = all_proven(file, Effort::default()).into_iter();
    findings.extend(found.filter(|finding| finding.code != Code::Takes));
    findings
}

fn few(states: u64, classes: u64) -> Effort {
    Effort { states, classes, has_begun: false }
}

fn all_proven(file: &str, effort: Effort) -> Findings {
    let reading = read("robot.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
    let reading = check(reading, &[], None);
    assert!(reading.is_valid(), "{}", reading.findings.render(Colours::No));
    let configuration = reading.configuration.expect("it is valid");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    prove_within(&configuration, &plan, effort, &|| false)
}

/// The blocks of a page, in their order: the example, what is printed, the example mended.
fn blocks(page: &str, fence: &str) -> Vec<String> {
    let fence = format!("```{fence}\n");
    let parts = page.split(fence.as_str()).skip(1);
    parts.map(|part| part.split("```").next().expect("its end").to_owned()).collect()
}

#[test]
fn every_page_shows_what_is_found_and_its_mended_example_is_proven() {
    for code in [
        Code::FillsWithoutEnd,
        Code::GoalNeverReached,
        Code::Standstill,
        Code::GoalLost,
        Code::TwoTokens,
        Code::MarkedTogether,
        Code::ValuesContradict,
        Code::ValueOutside,
        Code::CheckFails,
    ] {
        let page = code.page();
        let [faulty, mended] = &blocks(page, "xml")[..] else {
            panic!("{code:?}: two examples are wanted")
        };
        let [said] = &blocks(page, "text")[..] else { panic!("{code:?}: what is said is wanted") };
        let findings = proven(faulty);
        let mut own = Findings::default();
        own.extend(findings.into_iter().filter(|finding| finding.code == code));
        let rendered = own.render(Colours::No);
        let rendered = rendered.rsplit_once("\n\n").map_or(rendered.as_str(), |found| found.0);
        if std::env::var_os("ARMOR_BLESS").is_some() {
            let path =
                format!("{}/../docs/errors/{}.md", env!("CARGO_MANIFEST_DIR"), code.as_str());
            let page = page.replace(&format!("```text\n{said}"), &format!("```text\n{rendered}\n"));
            std::fs::write(path, page).expect("it can be written");
        } else {
            assert_eq!(rendered, said.trim_end(), "{code:?}");
        }
        let rest = proven(mended);
        assert!(rest.is_empty(), "{code:?}, mended:\n{}", rest.render(Colours::No));
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
fn the_end_ends_it_whatever_could_still_fire() {
    // Once `over` is marked nothing grows any more.
    let net = "<place name='x' initial='true'/>
        <transition name='t' from='x' to='over' timeout='1s'/>
        <transition name='more' from='over' to='over x' timeout='1s'/>";
    assert_eq!(codes(net), ["W0217"], "`more` never fires");
}

#[test]
fn what_the_file_says_of_failures_is_part_of_it() {
    // Only a component that does not stop leads to `y`, where nothing leads on.
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
