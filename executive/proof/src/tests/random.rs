//! Claims of small random missions, judged by plain enumeration of states with whole-second clocks
//! (which have the markings, firing sequences and times of nets with closed whole intervals).

mod enumeration;

use super::dice::Dice;
use super::*;
use enumeration::Enumeration;

const PLACES: usize = 4;

/// Draws a mission of a few places, with or without times, and its checks.
fn draw(dice: &mut Dice) -> (String, Vec<String>) {
    let mut net = String::new();
    for place in 0..PLACES {
        let initial = if place == 0 { 1 } else { usize::from(dice.one_in(4)) };
        net += &format!("<place name='p{place}' initial='{initial}'/>");
    }
    for transition in 0..2 + dice.roll(4) {
        net += &format!("<transition name='t{transition}' {}>", condition(dice));
        let (from, to) = (dice.roll(PLACES), dice.roll(PLACES));
        net += &format!("<arc from='p{from}'/>");
        if dice.one_in(5) {
            net += &format!("<arc from='p{}'/>", (from + 1) % PLACES);
        }
        if !dice.one_in(6) {
            net += &format!("<arc to='p{to}'/>");
        }
        if dice.one_in(6) {
            net += &format!("<arc to='p{}'/>", (to + 1 + dice.roll(PLACES - 1)) % PLACES);
        }
        match dice.roll(10) {
            0 => {
                net += &format!(
                    "<inhibitor place='p{}' weight='{}'/>",
                    dice.roll(PLACES),
                    1 + dice.roll(2)
                );
            }
            1 => net += &format!("<read place='p{}'/>", dice.roll(PLACES)),
            2 => net += &format!("<reset place='p{}'/>", dice.roll(PLACES)),
            _ => {}
        }
        net += "</transition>";
    }
    (net, (0..8).map(|_| claim(dice)).collect())
}

fn condition(dice: &mut Dice) -> String {
    match dice.roll(6) {
        0 => "on='a.done'".into(),
        1 => format!("after='{}s'", dice.roll(3)),
        2 => {
            let earliest = dice.roll(3);
            format!("interval='[{earliest}s,{}s]'", earliest + dice.roll(3))
        }
        _ => format!("timeout='{}s'", dice.roll(4)),
    }
}

fn formula(dice: &mut Dice) -> String {
    let one = format!("p{}", dice.roll(PLACES));
    let other = format!("p{}", dice.roll(PLACES));
    match dice.roll(8) {
        0 => format!("{one} and {other}"),
        1 => format!("{one} or {other}"),
        2 => format!("not {one}"),
        3 => format!("{one} + {other} &lt;= 1"),
        4 => format!("{one} >= 2"),
        5 => format!("{one} == {other}"),
        _ => one,
    }
}

fn claim(dice: &mut Dice) -> String {
    let (one, other) = (formula(dice), formula(dice));
    let (place, transition) = (dice.roll(PLACES), dice.roll(2));
    match dice.roll(11) {
        0 => format!("always {one}"),
        1 => format!("never {one}"),
        2 => format!("reachable({one})"),
        3 => format!("always reachable({one})"),
        4 => format!("eventually {one}"),
        5 | 6 => format!("{one} leads to {other}"),
        7 => {
            let relation = ["&lt;=", "&lt;", ">=", ">"][dice.roll(4)];
            format!("duration({one}) {relation} {}s", dice.roll(6))
        }
        8 => format!("fires(t{transition})"),
        9 => format!("dead(t{transition})"),
        _ => format!("bounded(p{place}) &lt;= {}", dice.roll(3)),
    }
}

/// Proves the file; returns the text of each check with its finding, if it has one.
fn check_findings(
    file: &str,
    effort: ProofEffort,
) -> (Analysed, Plan, Vec<(String, Option<Finding>)>) {
    let reading = read("m.xml".as_ref(), &mut |_| Ok(file.as_bytes().to_vec()));
    let configuration = reading.configuration.expect("it can be read");
    let plan = Plan::of(&configuration).expect("it compiles").expect("a mission");
    let findings = prove_within(&configuration, &plan, effort, &|| false);
    let checks = &configuration.mission.as_ref().expect("a mission").checks;
    let of = |text: &armor_robotfile::Spanned<String>| {
        let is_its = |f: &&Finding| {
            matches!(f.code, Code::CheckFails | Code::CheckUndecided)
                && f.at.as_ref().is_some_and(|at| at.span == text.at.span)
        };
        (text.value.clone(), findings.iter().find(is_its).cloned())
    };
    let found = checks.iter().map(of).collect();
    let analysed = Analysed::of(&plan).expect("a net");
    (analysed, plan, found)
}

#[test]
fn claims_of_random_missions_are_judged_as_plain_enumeration_does() {
    let seeds = std::env::var("ARMOR_SEEDS").ok();
    let seed = |text: &str| text.parse::<u64>().expect("a seed");
    let range = seeds.as_deref().and_then(|seeds| seeds.split_once(".."));
    let (first, last) = range.map_or((0, 400), |(first, last)| (seed(first), seed(last)));
    let (mut judged, mut failed, mut open) = (0u64, 0u64, 0u64);
    for seed in first..last {
        let (net, claims) = draw(&mut Dice::new(seed));
        let checks: String = claims.iter().map(|claim| format!("<check>{claim}</check>")).collect();
        let file = format!(
            "<armor version='1'><system><component name='a' kind='k'/></system>
             <mission>{net}{checks}</mission></armor>"
        );
        let (analysed, plan, whole) = check_findings(&file, few(5000, 5000));
        let (.., scarce) = check_findings(&file, few(1, 1));
        // Skip nets that are unbounded or too large for plain enumeration.
        let Some(truth) = Enumeration::of(&analysed.net) else { continue };
        for ((text, finding), (_, little)) in whole.into_iter().zip(scarce) {
            let claim = armor_robotfile::claim::Claim::parse(&text).expect("a claim");
            let Some(expected) = truth.judge(&claim.statement, &plan, &analysed) else { continue };
            let code = finding.as_ref().map_or("", |finding| finding.code.as_str());
            let wanted = if expected { "" } else { "E0252" };
            assert_eq!(code, wanted, "seed {seed}, {text}\n{net}\n{finding:?}");
            // With hardly any budget a verdict may be undecided, but it must not be wrong.
            let code = little.as_ref().map_or("", |finding| finding.code.as_str());
            assert!([wanted, "W0253"].contains(&code), "seed {seed}, {text}\n{net}\n{little:?}");
            open += u64::from(code == "W0253");
            judged += 1;
            failed += u64::from(!expected);
            if let Some(path) = finding.and_then(|finding| finding.trace) {
                truth.assert_plays(&path, &format!("seed {seed}, {text}\n{net}\n{path:?}"));
            }
        }
    }
    println!("{judged} claims, of which {failed} do not hold; {open} open without states");
    let has_judged_enough = judged > last - first && failed > judged / 10 && open < judged;
    assert!(has_judged_enough || seeds.is_some(), "too few claims are judged");
}
