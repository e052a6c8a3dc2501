//! The system that is shown: hosts, links, frames, its beginning and its end.

use super::*;

#[test]
fn a_host_that_is_cut_off_is_framed_and_named_with_its_clock_and_what_runs_there() {
    use armor_inspect::run_control::{HostLink, HostReport};
    use armor_inspect::{SystemEvent, SystemPicture};

    let report = |host: &str, link| HostReport {
        host: host.into(),
        link,
        reason: String::new(),
        for_s: 7.0,
        clock_offset_s: Some(-0.002),
        clock_error_s: Some(0.001),
    };
    let mut picture = SystemPicture::default();
    let reports = vec![report("arm", HostLink::CutOff), report("base", HostLink::Connected)];
    picture.handle_event(SystemEvent::Hosts(reports), std::time::Duration::ZERO);
    let mut shown = test_screen();
    shown.console.readings.store(crate::ports::HostsReading::of(&picture));
    let window = window_of(shown, Vec2::new(1000.0, 1400.0));
    for label in ["! host arm", "cut off for 7.0 s", "host base"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
    assert_eq!(window.query_all_by_label("connected").count(), 2, "the host and the screen");
    let clock = "its clock is 2.0 ms behind that of the launcher's host, ± 1.0 ms";
    assert_eq!(window.query_all_by_label(clock).count(), 2);
    assert!(self::window().query_by_label_contains("host").is_none(), "without other hosts");
}

#[test]
fn the_table_of_links_shows_transport_skipped_and_lost_of_both_ends() {
    use armor_inspect::{ObservedLink, SystemPicture};

    let link = |to: &str, transport: &str, counts: [u64; 3]| {
        let [skipped, lost, dropped] = counts;
        ObservedLink {
            from: "robot.data".into(),
            to: to.into(),
            type_name: String::new(),
            keep: "latest".into(),
            transport: transport.into(),
            connected: true,
            paused: false,
            sent: 0,
            dropped,
            skipped,
            history_dropped: 0,
            lost,
            queued: 0,
            waiting: 0,
            received: 0,
            rate_hz: None,
            problem: String::new(),
        }
    };
    let links = vec![
        link("view.map_updates", "udp→tcp", [0, 31, 4]),
        link("view.scan", "shm", [4711, 0, 0]),
        link("view2.scan", "unix", [815, 0, 0]),
    ];
    let mut picture = SystemPicture::default();
    picture.links = links;
    let mut shown = test_screen();
    let widest = InputLink::new("map_updates", "robot.map_updates".into(), false);
    shown.console.links.push(widest);
    // A pull leaves gaps, which are no losses.
    let number = SequenceNumber { instance: 1, sequence: 4712 };
    shown.console.record_arrival("scan", shown.now, 1.0, number, Ok(()));
    let mut window = window_of(shown, Vec2::new(1000.0, 1400.0));
    window.get_by_label_contains("links, no data yet").click();
    window.run_steps(2);
    for label in ["via", "skipped", "lost"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
    assert!(window.query_by_label("4711").is_some(), "without reports, gaps count as lost");
    let reading = crate::ports::LinksReading::of(&picture, "view");
    window.state_mut().console.readings.store(reading);
    window.run_steps(2);
    for label in ["udp>tcp", "35", "shm", "4711"] {
        assert_eq!(window.query_all_by_label(label).count(), 1, "{label}");
    }
    assert!(window.query_by_label("815").is_none(), "of another component");
    let right = |label| window.query_all_by_label(label).next().unwrap().rect().max.x;
    assert!(
        right("skipped") < right("lost") && right("none yet") <= 1000.0,
        "the table fits: {}",
        right("none yet")
    );
}

#[test]
fn a_new_frame_is_shown_until_the_operator_acknowledges_it() {
    let mut test_screen = test_screen();
    test_screen.console.frame_seen("map");
    let mut window = window_of(test_screen, SIZE);
    stroke(&mut window, PointerButton::Primary, MIDDLE, MIDDLE);
    assert_eq!(take_commands(&mut window).len(), 1);
    window.get_by_label_contains("m away");
    let console = &mut window.state_mut().console;
    console.scene.set_path([Pose2::IDENTITY].into_iter());
    console.scene.set_trajectory(1.0, [Pose2::IDENTITY].into_iter());
    console.frame_seen("map#3f2a");
    let scene = &console.scene;
    assert!(
        scene.map.is_empty() && scene.path.is_empty() && scene.trajectory_points().count() == 0
    );
    assert_eq!(scene.robot(), None, "its place on the new map is not known yet");
    window.run_steps(2);
    window.get_by_label_contains("The map has a new origin");
    assert!(window.query_by_label_contains("m away").is_none());
    let console = &mut window.state_mut().console;
    console.scene.map.replace(2.0, layout(), vec![0; 10_000]).unwrap();
    window.run_steps(2);
    let lower = MIDDLE + Vec2::new(0.0, 100.0);
    stroke(&mut window, PointerButton::Primary, lower, lower);
    assert_eq!(take_commands(&mut window), [], "this click may be meant for the map before");
    window.get_by_label("Acknowledge").click();
    window.run_steps(3);
    assert!(window.query_by_label_contains("The map has a new origin").is_none());
    assert_eq!(take_commands(&mut window), [], "the click at the banner is no goal");
    stroke(&mut window, PointerButton::Primary, lower, lower);
    let commands = take_commands(&mut window);
    let [RobotCommand::Goal { frame, .. }] = &commands[..] else { panic!("{commands:?}") };
    assert_eq!(&**frame, "map#3f2a");
    let expected = [OperatorEvent::Goal, OperatorEvent::FrameChanged, OperatorEvent::Goal];
    assert_eq!(events(&mut window), expected);
}

#[test]
fn an_ended_run_has_no_time_that_passes() {
    use crate::mission::MissionState;

    let mut shown = test_screen();
    shown.console.links.push(InputLink::new("path", "planner.path".into(), false));
    let is_running = true;
    shown.console.mission = Some(MissionState { is_running, ..MissionState::default() });
    let mut window = window_of(shown, SIZE);
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    wait(&mut window, 4.0);
    let now = window.state().now;
    window.state_mut().console.end_system("rover", goal_end(), now);
    let alerts = window.state().console.alerts.count_new();
    wait(&mut window, 50.0);
    assert!(shows(&window, "no path to the goal for 4 s") && shows(&window, " 0:05"));
    let boxes = painted_texts(&window).iter().filter(|(text, _)| text.contains("no path")).count();
    assert_eq!(boxes, 1, "only in the panel, and not over the map");
    assert_eq!(window.state().console.alerts.count_new(), alerts, "the end is normal");
}

#[test]
fn a_system_that_has_ended_stays_on_the_screen_as_old_and_takes_no_orders() {
    let mut window = window();
    window.key_down(Key::W);
    window.run_steps(1);
    take_commands(&mut window);
    let now = window.state().now;
    window.state_mut().console.end_system("rover", goal_end(), now);
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [], "what is held is let go");
    window.key_up(Key::W);
    window.state_mut().console.orders.handle_order(OperatorOrder::Stop, 1.0);
    wait(&mut window, 65.0);
    assert!(!shows(&window, "STOPPED"), "whether the robot stands is not known");
    window.state_mut().console.orders.handle_order(OperatorOrder::Release, 1.0);
    for text in ["rover has ended", "the mission reached its goal.", "are 1 min old", "OLD"] {
        assert!(shows(&window, text), "{text}");
    }
    assert!(!window.state().console.scene.map.is_empty(), "the last map stays");
    assert!(!shows(&window, "nothing for"), "one reason is enough");
    window.run_steps(3);
    let delay = window.output().viewport_output.values().map(|out| out.repaint_delay).min();
    assert!(delay > Some(std::time::Duration::from_secs(50)), "a frame a minute: {delay:?}");
    assert_eq!(click_at(&mut window, 0.0, -2.0), []);
    assert!(refusal(&window).contains("rover has ended"));
    window.key_press(Key::Space);
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), []);
    assert!(!window.state().console.orders.is_stopped());
}

#[test]
fn before_a_system_the_screen_shows_what_it_waits_for() {
    let mut test_screen = test_screen();
    let what = "armor run rover.xml".to_owned();
    test_screen.console =
        Console { connection: SystemConnection::Awaited { what }, ..Console::default() };
    let window = window_of(test_screen, SIZE);
    assert!(shows(&window, "waiting for\narmor run rover.xml"));
    assert!(shows(&window, "waiting for a system"));
}
