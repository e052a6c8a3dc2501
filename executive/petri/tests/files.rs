//! Nets in and out of files: real ones, random ones, and what is no net at all.

use crate::data;
use armor_petri::file::{NetFile, pnml, tina};
use armor_petri::{FiringClass, FiringInterval, Net, NetTransition, PlaceId};
use proptest::prelude::*;
use std::time::Duration;

/// What of a file must survive: all that the net does, and its notes.
fn essence(file: &NetFile) -> impl PartialEq + std::fmt::Debug + use<> {
    let places = file.net.places().iter().zip(file.net.initial()).zip(&file.places);
    let places = places.map(|((name, tokens), note)| (name.clone(), *tokens, note.label.clone()));
    let transitions = file.net.transitions().iter().zip(&file.transitions);
    let transitions = transitions.map(|(t, note)| (t.clone(), note.label.clone()));
    (file.name.clone(), places.collect::<Vec<_>>(), transitions.collect::<Vec<_>>())
}

#[test]
fn real_nets_have_the_places_and_transitions_of_the_table() {
    for (name, places, transitions) in [
        ("untimed-test007-swimming-pool.pnml", 9, 7),
        ("untimed-test006-philosophers.pnml", 30, 30),
        ("HouseConstruction-00002.net", 26, 18),
        ("FMS2-untimed.pnml", 22, 20),
        ("Kanban2-test001.pnml", 16, 16),
        ("AirplaneLD-0010.net", 89, 88),
        ("Kanban-00005.net", 16, 16),
        ("Referendum-PT-0015.pnml", 46, 31),
        ("Kanban-PT-02000.pnml", 16, 16),
    ] {
        let Some(file) = data::net(name) else { return };
        assert_eq!(file.net.places().len(), places, "{name}");
        assert_eq!(file.net.transitions().len(), transitions, "{name}");
        let again = pnml::read(&pnml::write(&file)).unwrap();
        assert_eq!(essence(&again), essence(&file), "{name} through PNML");
        assert_eq!(again.places, file.places, "{name}: labels and positions");
        let again = tina::read(&tina::write(&file).unwrap()).unwrap();
        let sorted = |file: &NetFile| {
            let mut places: Vec<_> = file.net.places().to_vec();
            places.sort();
            places
        };
        assert_eq!(sorted(&again), sorted(&file), "{name} through .net");
    }
}

#[test]
fn what_the_net_format_lacks_is_refused_in_words_of_the_mission() {
    let written = |terms: &str| {
        let pnml = format!(
            "<pnml><net id='n'><place id='p'><initialMarking><text>1</text></initialMarking></place>\
             <transition id='t'><toolspecific tool='armor' version='1'>{terms}</toolspecific></transition>\
             <arc id='a' source='p' target='t'/></net></pnml>"
        );
        tina::write(&pnml::read(&pnml).unwrap()).map_err(|error| error.to_string())
    };
    let refused = "transition `t` waits for more than tokens and time (a report, a guard or a date), \
                   which .net cannot express; write .pnml";
    assert_eq!(written("<terms gated='true'/>"), Err(refused.to_owned()));
    assert!(written("").is_ok());
}

#[test]
fn every_keyword_of_the_net_format_is_read() {
    let file = tina::read(
        "# a comment\nnet {a \\{net\\}}\n\
         tr t1 : {go on} [4,9] p1 p2*2 p3?2 {p 4}?-3 -> p1 p5*2K\n\
         tr t2 [0.5,w[ ->\n  pl p1 (3)\npl p6 : six (1M) t1 t2*2 -> t3*2 t3?4\n\
         lb p2 two\nnt n1 0 {note\n# nothing\n}\n # another\npr t1 t2 > t3\npr t3 < t2\n",
    )
    .unwrap();
    let net = &file.net;
    let place = |name: &str| PlaceId(net.places().iter().position(|p| p == name).unwrap() as u32);
    let t = |name: &str| net.transitions().iter().find(|t| t.name == name).unwrap();
    assert_eq!(file.name, "a {net}");
    assert_eq!(t("t1").inputs, [(place("p1"), 1), (place("p2"), 2)]);
    assert_eq!(t("t1").reads, [(place("p3"), 2)]);
    assert_eq!(t("t1").inhibitors, [(place("p 4"), 3)]);
    assert_eq!(t("t1").outputs, [(place("p1"), 1), (place("p5"), 2000), (place("p6"), 1)]);
    assert_eq!(t("t2").interval.earliest, Duration::from_millis(500));
    assert_eq!(t("t2").interval.latest, None);
    assert_eq!(t("t3").interval, FiringInterval::UNTIMED);
    assert_eq!((t("t3").inputs[0].1, t("t3").reads[0].1), (2, 4));
    assert_eq!((t("t1").priority, t("t2").priority, t("t3").priority), (1, 1, 0));
    assert_eq!(net.initial()[place("p6").index()], 1_000_000);
    assert_eq!(file.places[place("p2").index()].label, "two");
    assert_eq!(file.transitions[0].label, "go on");
}

#[test]
fn pnml_pages_references_and_other_tools_arc_types_are_read() {
    let file = pnml::read(
        r#"<pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml"><net id="n"
           type="http://www.pnml.org/version-2009/grammar/ptnet">
           <page id="one"><place id="p"><name><text>same</text></name>
             <graphics><position x="1.5" y="-2"/></graphics>
             <initialMarking><text> 2 </text></initialMarking></place>
             <page id="inner"><referencePlace id="r2" ref="r"/><place id="q"><name><text>same</text></name></place></page>
             <toolspecific tool="other" version="1"><place id="p"/></toolspecific></page>
           <page id="two"><referencePlace id="r" ref="p"/>
             <transition id="t"><delay><interval closure="closed"><cn>1</cn><cn>2.5</cn></interval></delay></transition>
             <referenceTransition id="u" ref="t"/>
             <arc id="a1" source="r2" target="u"><inscription><value>Default,2</value></inscription></arc>
             <arc id="a2" source="t" target="q"/>
             <arc id="a3" source="q" target="t"><type value="inhibitor"/></arc>
             <arc id="a4" source="p" target="t" type="test"/>
             <arc id="a5" source="p" target="t"><type value="reset"/></arc></page>
           </net></pnml>"#,
    )
    .unwrap();
    let t = &file.net.transitions()[0];
    assert_eq!(file.net.places(), ["p", "q"]);
    assert_eq!(file.net.initial(), [2, 0]);
    assert_eq!(file.places[1].label, "same");
    assert_eq!(file.places[0].position, Some([1.5, -2.0]));
    assert_eq!((&t.inputs[..], &t.outputs[..]), (&[(PlaceId(0), 2)][..], &[(PlaceId(1), 1)][..]));
    assert_eq!((&t.inhibitors[..], &t.reads[..]), (&[(PlaceId(1), 1)][..], &[(PlaceId(0), 1)][..]));
    assert_eq!(t.resets, [PlaceId(0)]);
    assert_eq!(t.interval.latest, Some(Duration::from_millis(2500)));
}

#[test]
fn a_timed_arc_net_without_times_is_a_plain_net() {
    let text = r#"<pnml><net id="n" type="P/T net"><place id="p" name="p" initialMarking="3" invariant="&lt; inf"/>
        <place id="q" initialMarking="0" invariant="INVARIANT"/><transition id="t" urgent="false"/>
        <arc id="a" inscription="[0,inf)" source="p" target="t" type="timed" weight="2"/>
        <arc id="b" inscription="1" source="t" target="q" type="normal" weight="1"/>
        <arc id="c" inscription="[0,inf)" source="q" target="t" type="tapnInhibitor" weight="4"/></net></pnml>"#;
    let file = pnml::read(&text.replace("INVARIANT", "&lt; inf")).unwrap();
    let t = &file.net.transitions()[0];
    assert_eq!(file.net.initial(), [3, 0]);
    assert_eq!((&t.inputs[..], &t.outputs[..]), (&[(PlaceId(0), 2)][..], &[(PlaceId(1), 1)][..]));
    assert_eq!(t.inhibitors, [(PlaceId(1), 4)]);
    let aged = pnml::read(&text.replace("INVARIANT", "&lt;= 4")).unwrap_err();
    assert!(aged.to_string().contains("age"), "{aged}");
}

#[test]
fn faults_are_reported_with_line_and_column() {
    let check = |text: &str, expected: &str| {
        let error = match text.starts_with('<') {
            true => pnml::read(text).unwrap_err(),
            false => tina::read(text).unwrap_err(),
        };
        assert!(error.to_string().starts_with(expected), "{text}\n{error}");
    };
    check("foo tr", "1:1: expected one of net, tr");
    check("tr t1 p1 ->\n)", "2:1: expected one of net, tr");
    check("pl p (x)", "1:7: `x` is not a whole number");
    check("pl p (5000M)", "1:7: `5000` is more than");
    check("tr t p*0 ->", "1:6: an arc weighs");
    check("tr t [3,2] p ->", "1:6: the interval ends before");
    check("tr t ]3,5] p ->", "1:6: an interval that is open");
    check("tr t p!2 ->", "1:6: a stopwatch arc");
    check("tr t p -> q?1", "1:11: a test on the output");
    check("tr {t p ->", "1:4: expected }, found");
    check("pr a > b\npr b > a", "1:1: the references or priorities that start at `a`");
    check("tr t p*4000M p*4000M ->", "1:4: the arcs of transition `t`");
    check("<x/>", "1:1: expected <pnml>");
    check("<pnml>\n</pnml>", "1:1: expected a <net>");
    check("<pnml><net id='n' type='x/symmetricnet'/></pnml>", "1:7: a net of type");
    let net = |inner: &str| format!("<pnml><net id='n'>\n{inner}</net></pnml>");
    check(&net("<place id='p'><hlinitialMarking/></place>"), "2:1: a place of coloured tokens");
    check(&net("<place/>"), "2:1: expected an id attribute");
    check(&net("<place id='p'/><place id='p'/>"), "2:16: the id `p` is used twice");
    check(
        &net("<place id='p'><initialMarking><text>-1</text></initialMarking></place>"),
        "2:15: `-1`",
    );
    check(&net("<place id='p'/><arc source='p' target='q'/>"), "2:16: `q` is not in the net");
    check(&net("<place id='p'/><arc source='p' target='p'/>"), "2:16: an arc leads");
    check(
        &net("<referencePlace id='a' ref='a'/><arc source='a' target='a'/>"),
        "2:33: the references",
    );
    check(
        &net("<place id='p'/><transition id='t'/><arc source='p' target='t' type='timed'/>"),
        "2:36: an arc of type",
    );
}

#[test]
fn armors_own_data_is_kept_and_other_tools_read_a_more_permissive_net() {
    let text = r#"<pnml><net id="n"><place id="p"><initialMarking><text>1</text></initialMarking>
        <toolspecific tool="armor" version="1"><word name="components" value="a &lt; b"/></toolspecific></place>
        <transition id="t"><delay><interval closure="closed-open"><cn>2</cn><ci>infty</ci></interval></delay>
        <toolspecific tool="armor" version="1"><terms gated="true" latest="3.5"/><word name="on" value="a.done"/></toolspecific>
        </transition><arc id="a" source="p" target="t"/></net></pnml>"#;
    let file = pnml::read(text).unwrap();
    let t = &file.net.transitions()[0];
    assert_eq!(t.interval.latest, Some(Duration::from_millis(3500)));
    assert_eq!(file.places[0].words, [("components".into(), "a < b".into())]);
    let written = pnml::write(&file);
    assert_eq!(pnml::read(&written).unwrap().places, file.places);
    assert_eq!(pnml::read(&written).unwrap().net.transitions(), file.net.transitions());
    // A tool without gates must not conclude that it fires by 3.5 s.
    let plain = written.replace("tool=\"armor\"", "tool=\"another\"");
    let plain = pnml::read(&plain).unwrap();
    let interval = plain.net.transitions()[0].interval;
    assert_eq!((interval.earliest, interval.latest), (Duration::from_secs(2), None));
    let wrong = text.replace("3.5", "1");
    assert!(pnml::read(&wrong).unwrap_err().to_string().contains("ends before it begins"));
}

const NAMES: &[&str] = &["a", "b 1", "tr", "{", "\\", "ä", "<&\"'>", "x-y", "", "page"];

prop_compose! {
    fn net()(
        tokens in prop::collection::vec(prop_oneof![0u32..4, Just(u32::MAX)], 1..NAMES.len()),
        sketches in prop::collection::vec((
            prop::collection::vec((0u8..6, 0usize..20, 1u32..4), 0..6),
            any::<bool>(), any::<i32>(), 0u64..3_000_000_000, prop::option::of(0u64..9), any::<bool>(),
        ), 0..NAMES.len()),
    ) -> Net {
        let mut net = Net::builder();
        let places: Vec<_> = tokens.iter().zip(NAMES).map(|(n, name)| net.place(*name, *n)).collect();
        for ((arcs, safety, priority, earliest, slack, gated), name) in sketches.iter().zip(NAMES) {
            let earliest = Duration::from_nanos(*earliest);
            let latest = slack.map(|slack| earliest + Duration::from_secs(slack));
            let mut t = net
                .transition(*name)
                .class(if *safety { FiringClass::Safety } else { FiringClass::Ordinary })
                .priority(*priority)
                .interval(FiringInterval { earliest, latest });
            for &(kind, place, weight) in arcs {
                let place = places[place % places.len()];
                t = match kind {
                    0 | 1 => t.input(place, weight),
                    2 => t.output(place, weight),
                    3 => t.read(place, weight),
                    4 => t.inhibitor(place, weight),
                    _ => t.reset(place),
                };
            }
            if *gated {
                t.gated();
            }
        }
        net.build().expect("arcs within the net")
    }
}

proptest! {
    #[test]
    fn any_net_comes_back_from_pnml_as_it_was(net in net()) {
        let file = NetFile::new("the net", net);
        let again = pnml::read(&pnml::write(&file)).unwrap();
        prop_assert_eq!(essence(&again), essence(&file));
    }

    #[test]
    fn any_net_without_gates_and_resets_comes_back_from_tina_but_for_its_numbers(net in net()) {
        let file = NetFile::new("", net);
        let Ok(text) = tina::write(&file) else { return Ok(()) };
        let again = tina::read(&text).unwrap();
        let standing = |t: &NetTransition| (t.class == FiringClass::Safety, t.priority);
        let order = |net: &Net| -> Vec<_> {
            let all = net.transitions();
            all.iter().flat_map(|a| all.iter().map(move |b| standing(a).cmp(&standing(b)))).collect()
        };
        prop_assert_eq!(order(&again.net), order(&file.net));
        let arcs = |net: &Net| -> Vec<_> {
            let named = |arcs: &[(PlaceId, u32)]| -> Vec<_> {
                arcs.iter().map(|(p, weight)| (net.place(*p).to_owned(), *weight)).collect()
            };
            let all = net.transitions().iter();
            all.map(|t| (t.name.clone(), t.interval, named(&t.inputs), named(&t.outputs),
                         named(&t.reads), named(&t.inhibitors))).collect()
        };
        prop_assert_eq!(arcs(&again.net), arcs(&file.net));
    }

    #[test]
    fn no_text_makes_a_reader_panic(text in "[ -~\n]{0,80}", bits in prop::collection::vec(0usize..24, 0..30)) {
        const WORDS: &[&str] = &["<pnml>", "<net id='n'>", "<page>", "<place id='p'", ">", "/>", "<text>", "1",
            "</text>", "</place>", "<arc source='p' target='t'/>", "<transition id='t'/>", "tr ", "pl ", "p ",
            "(", ")", "[1,", "2]", "-> ", "* ", "?-", "pr ", "{"];
        let _ = (pnml::read(&text), tina::read(&text));
        let made: String = bits.iter().map(|bit| WORDS[*bit]).collect();
        let _ = (pnml::read(&made), tina::read(&made));
    }
}
