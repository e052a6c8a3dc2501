use super::chance::{Chance, Step};
use super::world::scalar;
use super::*;
use armor_robotfile::FiringTrace;

const SURVEY: &str = r#"<armor version="1"><system><component name="explorer" kind="e"/>
    <component name="homing" kind="h"/><component name="power" kind="p"/></system>
  <mission goal="home" safe="hold">
    <variable name="battery" source="power.state.level"/>
    <place name="explore" initial="true" components="explorer" on-failure="hold"/>
    <place name="return" components="homing"/>
    <place name="home"/><place name="hold"/>
    <exclusive components="explorer homing"/>
    <transition name="seen" from="explore" to="return" on="explorer.done"/>
    <transition name="late" from="explore" to="return" timeout="90s" on-stop-fail="hold"/>
    <transition name="weak" from="explore" to="return" when="battery &lt; 30%"/>
    <transition name="recall" from="explore" to="return" operator="true"/>
    <transition name="settled" from="return" to="home" on="homing.done" after="5s"/>
    <transition name="lost" from="return" to="hold" timeout="60s"/>
  </mission></armor>"#;

fn play_of(file: &str) -> Play {
    Play::new(Arc::new(Stage::of(&crate::mission::read_text(file)).unwrap()))
}

fn id(play: &Play, name: &str) -> TransitionId {
    play.stage().transition(name).unwrap()
}

fn marked(play: &Play) -> Vec<&str> {
    let places = play.stage().mission.places.iter().zip(play.marking());
    places.filter(|(_, tokens)| **tokens > 0).map(|(place, _)| place.name.value.as_str()).collect()
}

fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

#[test]
fn by_hand_a_report_fires_at_once_and_a_timeout_takes_its_time() {
    let mut play = play_of(SURVEY);
    let (seen, late, lost) = (id(&play, "seen"), id(&play, "late"), id(&play, "lost"));
    assert_eq!(play.standing(seen), Standing::Expects);
    assert_eq!(play.standing(late), Standing::Waits(s(90)));
    assert_eq!(play.standing(lost), Standing::Disabled);
    assert_eq!(play.fire_by_hand(seen), Ok(Outcome::Fired));
    assert_eq!((marked(&play), play.time()), (vec!["return"], s(0)));
    assert_eq!(play.stage().active(play.marking()), ["homing"]);
    assert!(play.back());
    assert_eq!(play.fire_by_hand(late), Ok(Outcome::Fired));
    assert_eq!((marked(&play), play.time()), (vec!["return"], s(90)));
    assert_eq!(play.fire_by_hand(lost), Ok(Outcome::Fired));
    assert_eq!((play.is_over(), play.time()), (true, s(150)));
    let why = play.fire_by_hand(seen).unwrap_err().to_string();
    assert_eq!(why, "seen cannot fire: no token in explore, the mission is over in hold");
    while play.back() {}
    assert_eq!((marked(&play), play.time(), play.firings()), (vec!["explore"], s(0), 0));
}

#[test]
fn a_report_with_a_time_behind_it_starts_a_clock() {
    let mut play = play_of(SURVEY);
    play.fire_by_hand(id(&play, "recall")).unwrap();
    let settled = id(&play, "settled");
    assert_eq!(play.fire_by_hand(settled), Ok(Outcome::Clock(s(5))));
    assert_eq!(play.standing(settled), Standing::Waits(s(5)));
    play.wait(s(2));
    assert_eq!(play.progress(settled), Some(0.4));
    play.wait(s(4));
    assert_eq!((marked(&play), play.time()), (vec!["home"], s(6)));
    let fired: Vec<_> = play.story().filter(|(_, h)| matches!(h, Happened::Fired { .. })).collect();
    assert_eq!(fired[0].0, s(5), "it fired on its way to 6 s");
}

#[test]
fn a_guard_holds_by_its_values_or_because_somebody_says_so() {
    let mut play = play_of(SURVEY);
    let senses = World::senses(play.stage());
    assert_eq!(senses.len(), 1);
    assert_eq!(
        (senses[0].name.as_str(), &senses[0].transitions[..]),
        ("battery", &["weak".to_owned()][..])
    );
    let weak = id(&play, "weak");
    play.set_value("battery", scalar("40%"));
    assert_eq!(play.standing(weak), Standing::Expects);
    play.set_value("battery", scalar("20%"));
    assert_eq!(play.standing(weak), Standing::Ready);
    assert_eq!(play.next_automatic(), Some((s(0), weak)));
    play.restart();
    assert_eq!(play.standing(weak), Standing::Ready, "values are kept");
    play.set_value("battery", None);
    assert_eq!(play.fire_by_hand(weak), Ok(Outcome::Fired));
}

#[test]
fn a_transition_cannot_wait_past_the_deadline_of_another() {
    let mut play = play_of(
        r#"<armor version="1"><system/><mission><place name="a" initial="true"/><place name="b"/>
        <transition name="soon" from="a" to="b" timeout="2s"/>
        <transition name="later" from="a" to="b" timeout="9s"/></mission></armor>"#,
    );
    let why = play.fire_by_hand(id(&play, "later")).unwrap_err();
    assert_eq!(why.to_string(), "later may fire at 9 s, but soon must fire before, by 2 s");
    assert_eq!(play.time(), Duration::ZERO);
}

#[test]
fn a_way_is_played_with_the_moments_that_its_times_allow() {
    let mut play = play_of(SURVEY);
    let firings = ["late", "settled"].map(str::to_owned).to_vec();
    play.follow(&FiringTrace { firings, ..FiringTrace::default() }).unwrap();
    let moments: Vec<_> = play.course().unwrap().legs().iter().map(|leg| leg.at).collect();
    assert_eq!(moments, [Some(s(90)), Some(s(95))]);
    assert!(play.next_leg() && play.next_leg());
    assert!(!play.next_leg() && play.course().unwrap().is_done());
    assert_eq!((marked(&play), play.time()), (vec!["home"], s(95)));
    assert!(play.back());
    assert_eq!((marked(&play), play.course().unwrap().done()), (vec!["return"], 1));
    let failing =
        FiringTrace { firings: vec!["late/on-stop-fail".into()], ..FiringTrace::default() };
    play.follow(&failing).unwrap();
    assert!(play.next_leg());
    assert_eq!(marked(&play), ["hold"]);
    let gone = FiringTrace { firings: vec!["removed".into()], ..FiringTrace::default() };
    assert_eq!(play.follow(&gone), Err("removed".to_owned()));
}

#[test]
fn a_way_that_the_times_do_not_allow_is_played_by_its_tokens() {
    let mut play = play_of(
        r#"<armor version="1"><system/><mission><place name="a" initial="true"/>
        <place name="b" initial="true"/><place name="c"/>
        <transition name="slow" from="a" to="c" timeout="9s"/>
        <transition name="quick" from="b" to="c" timeout="1s"/></mission></armor>"#,
    );
    let firings = ["slow", "quick"].map(str::to_owned).to_vec();
    play.follow(&FiringTrace { firings, ..FiringTrace::default() }).unwrap();
    assert!(!play.course().unwrap().is_timed);
    assert!(play.next_leg() && play.next_leg());
    assert_eq!(play.marking(), [0, 0, 2]);
}

#[test]
fn by_itself_it_comes_to_an_end_and_the_same_seed_gives_the_same_run() {
    let run = |seed, faults| {
        let mut play = play_of(SURVEY);
        let mut chance = Chance::from_seed(seed);
        chance.faults = faults;
        let mut steps = 0;
        while play.step(&mut chance) == Step::Happened {
            assert!(play.stage().breaches(play.marking()).is_empty());
            steps += 1;
            assert!(steps < 1000);
        }
        assert!(play.is_over());
        let story: Vec<_> = play.story().map(|(at, what)| (at, what.clone())).collect();
        (story, marked(&play).join(" "))
    };
    assert_eq!(run(7, false), run(7, false));
    let ends: std::collections::BTreeSet<_> = (0..40).map(|seed| run(seed, true).1).collect();
    assert_eq!(ends.into_iter().collect::<Vec<_>>(), ["hold", "home"]);
}

#[test]
fn exclusive_components_that_are_wanted_together_are_named() {
    let play = play_of(
        r#"<armor version="1"><system><component name="x" kind="k"/><component name="y" kind="k"/>
        </system><mission><place name="a" initial="true" components="x"/>
        <place name="b" initial="true" components="y"/><exclusive components="x y"/>
        </mission></armor>"#,
    );
    assert_eq!(play.stage().breaches(play.marking()), [("x", "y")]);
    assert!(play.stands_still());
}

#[test]
fn a_mission_with_mistakes_is_played_as_far_as_it_goes() {
    let mut play = play_of(
        r#"<armor version="1"><system/><mission goal="nowhere"><place name="a" initial="2"/>
        <transition name="t" from="a" to="gone" when="((" /></mission></armor>"#,
    );
    assert_eq!(play.fire_by_hand(id(&play, "t")), Ok(Outcome::Fired));
    assert_eq!(play.marking(), [1]);
}

#[test]
fn what_a_firing_sets_guards_see() {
    let mut play = play_of(
        r#"<armor version="1"><system/><mission goal="over">
        <variable name="round" min="0" max="2"/>
        <place name="rounds" initial="true"/><place name="over"/>
        <transition name="again" from="rounds" to="rounds" when="round &lt; 2" timeout="1s">
          <set variable="round" value="round + 1"/></transition>
        <transition name="enough" from="rounds" to="over" when="round == 2"/></mission></armor>"#,
    );
    play.wait(s(5));
    assert_eq!((marked(&play), play.firings()), (vec!["over"], 3));
    while play.back() {}
    assert_eq!(play.world().value("round"), Some(&Scalar::Number(0.0)));
}
