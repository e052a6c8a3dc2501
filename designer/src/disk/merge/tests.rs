use proptest::prelude::*;

use super::*;

#[track_caller]
fn check(base: &str, ours: &str, theirs: &str, expected: Option<&str>) {
    let lines = |text: &str| text.split(' ').map(|line| format!("{line}\n")).collect::<String>();
    let merged = merge(&lines(base), &lines(ours), &lines(theirs));
    assert_eq!(merged, expected.map(lines));
    assert_eq!(merged, merge(&lines(base), &lines(theirs), &lines(ours)), "the other way round");
}

#[test]
fn changes_in_different_places_go_together() {
    check("a b c d e", "a B c d e", "a b c D e", Some("a B c D e"));
    check("a b c d e", "x a b c d e", "a b c d e y", Some("x a b c d e y"));
    check("a b c d e", "a c d e", "a b c d e f", Some("a c d e f"));
}

#[test]
fn the_same_change_counts_once() {
    check("a b c", "a X c", "a X c", Some("a X c"));
    check("a b c d e", "a X c d e", "a X c d Y", Some("a X c d Y"));
}

#[test]
fn changes_of_the_same_or_the_next_line_do_not() {
    check("a b c", "a X c", "a Y c", None);
    check("a b c d", "a X c d", "a b Y d", None);
    check("a b c", "a X b c", "a Y b c", None);
    check("a b c", "a c", "a B c", None);
}

#[test]
fn a_moved_line_is_found() {
    let (old, new) = (["a", "b", "c", "d"], ["a", "c", "d", "b"]);
    let found = changes(&old, &new);
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].old.clone(), found[0].new.clone()), (1..2, 1..1));
}

const BASE: &str = "<armor version=\"1\">\n  <system>\n    <component name=\"a\" kind=\"k\"/>\n    \
                    <component name=\"b\" kind=\"k\"/>\n    <component name=\"c\" kind=\"k\"/>\n  \
                    </system>\n</armor>\n";

fn answered(ours: &str, theirs: &str) -> Answer {
    answer("a.xml".as_ref(), BASE, ours, theirs.as_bytes())
}

#[test]
fn what_is_done_about_the_disk() {
    let ours = BASE.replace("\"a\" kind=\"k\"", "\"a\" kind=\"mine\"");
    let theirs = BASE.replace("\"c\" kind=\"k\"", "\"c\" kind=\"theirs\"");
    let both = ours.replace("\"c\" kind=\"k\"", "\"c\" kind=\"theirs\"");
    assert_eq!(answered(&ours, &ours), Answer::Same);
    assert_eq!(answered(&ours, BASE), Answer::Same, "the disk has what was read last");
    assert_eq!(answered(BASE, &theirs), Answer::Take);
    assert_eq!(answered(&ours, &theirs), Answer::Merged(both));
    assert_eq!(answered(&ours, &ours.replace("mine", "theirs")), Answer::Ask);
    assert_eq!(answered(&ours, "<armor"), Answer::Ask, "changes are not mixed with half a file");
    assert_eq!(answered(BASE, "<armor"), Answer::Take, "its findings are shown");
}

/// A few different lines, so that many are the same.
fn text() -> impl Strategy<Value = Vec<u8>> {
    proptest::collection::vec(0u8..6, 0..24)
}

fn written(lines: &[u8]) -> String {
    lines.iter().map(|line| format!("{line}\n")).collect()
}

proptest! {
    #[test]
    fn the_changes_lead_from_the_one_to_the_other(old in text(), new in text()) {
        let (old, new) = (written(&old), written(&new));
        let old: Vec<_> = old.split_inclusive('\n').collect();
        let new: Vec<_> = new.split_inclusive('\n').collect();
        let (mut out, mut at) = (Vec::new(), 0);
        for change in changes(&old, &new) {
            prop_assert!(out.is_empty() || change.old.start > at, "an unchanged line between");
            out.extend_from_slice(&old[at..change.old.start]);
            prop_assert_eq!(out.len(), change.new.start);
            out.extend_from_slice(&new[change.new.clone()]);
            at = change.old.end;
        }
        out.extend_from_slice(&old[at..]);
        prop_assert_eq!(out, new);
    }

    #[test]
    fn who_changed_nothing_takes_the_others(base in text(), other in text()) {
        let (base, other) = (written(&base), written(&other));
        prop_assert_eq!(merge(&base, &base, &other), Some(other.clone()));
        prop_assert_eq!(merge(&base, &other, &base), Some(other.clone()));
        prop_assert_eq!(merge(&base, &other, &other), Some(other));
    }

    #[test]
    fn both_ways_give_the_same(base in text(), ours in text(), theirs in text()) {
        let (base, ours, theirs) = (written(&base), written(&ours), written(&theirs));
        prop_assert_eq!(merge(&base, &ours, &theirs), merge(&base, &theirs, &ours));
    }
}
