//! The window without a display: which component shows a system, and what STOP does across runs.

use super::*;
use crate::orders::OperatorOrder;
use crate::stop_delivery::StopStatus;

fn parse(arguments: &[&str]) -> Result<StationOptions, String> {
    let arguments: Vec<_> = arguments.iter().map(ToString::to_string).collect();
    parse_options(&arguments)
}

#[test]
fn it_shows_a_system_by_one_component_which_may_return() {
    let station = Station::new("127.0.0.1:7411", false);
    assert_eq!(station.accept_component("view"), Some(1));
    assert_eq!(station.accept_component("second"), None);
    assert_eq!(station.accept_component("view"), Some(2), "it was restarted");
    station.shown.lock().take();
    assert_eq!(station.accept_component("second"), Some(3));
}

#[test]
fn nothing_of_a_run_is_shown_as_that_of_the_next_one_but_stop_stays_in_the_same_run() {
    let station = Station::new("127.0.0.1:7411", true);
    let now = station.now();
    station.begin_run("rover", "rover".into(), "run 1", Vec::new());
    station.console.lock().handle_order(OperatorOrder::Stop, now);
    station.console.lock().set_mission(MissionState::default(), now);
    let run = WatchedRun {
        system: "rover".into(),
        component: "view".into(),
        launcher: 0,
        log: String::new(),
        log_begin: 0,
    };
    station.end_connection(0, &run, "");
    assert!(station.console.lock().connection.is_cut(), "that it has ended is not proven");
    station.begin_run("rover", "rover".into(), "run 1", Vec::new());
    assert!(station.console.lock().orders.is_stopped(), "only its component was restarted");
    station.begin_run("rover", "rover".into(), "run 2", Vec::new());
    let console = station.console.lock();
    assert!(!console.orders.is_stopped() && console.mission.is_none() && console.is_light);
    assert_eq!(console.connection, SystemConnection::Live { system: "rover".into() });
}

/// Connects a component to the window, as that of a run; returns its end.
fn connect(station: &Station, run: &str) -> UnixStream {
    let (near, far) = UnixStream::pair().unwrap();
    let serving = station.clone();
    std::thread::spawn(move || serving.serve(far));
    let hello = ToWindow::Hello {
        component: "view".into(),
        system: "rover".into(),
        robot: "rover".into(),
        run: run.into(),
        launcher: 0,
        log: String::new(),
        links: Vec::new(),
    };
    MessageWriter::new(&near).unwrap().send(&hello).unwrap();
    let mut reading = near.try_clone().unwrap();
    let welcome = read_message::<ToComponent>(&mut reading).unwrap();
    assert!(matches!(welcome, Some(ToComponent::Welcome { is_accepted: true })));
    near
}

/// Waits until the console is in a state.
#[track_caller]
fn until(station: &Station, is_so: impl Fn(&Console) -> bool) {
    let begin = Instant::now();
    while !is_so(&station.console.lock()) {
        assert!(begin.elapsed() < Duration::from_secs(30), "never");
        std::thread::yield_now();
    }
}

/// Gives an order as the window does.
fn order(station: &Station, order: OperatorOrder) {
    let commands = station.console.lock().handle_order(order, station.now());
    commands.iter().for_each(|command| station.send_command(command));
}

#[test]
fn a_stop_without_a_connection_is_the_first_that_the_restarted_component_receives() {
    let station = Station::new("127.0.0.1:7411", false);
    drop(connect(&station, "run 1"));
    until(&station, |console| console.connection.is_cut());
    order(&station, OperatorOrder::Stop);
    let status = || station.console.lock().stop_status(station.now());
    assert_eq!(status(), Some(StopStatus::NotDelivered));
    let mut component = connect(&station, "run 1");
    let first = read_message::<ToComponent>(&mut component).unwrap();
    assert!(matches!(first, Some(ToComponent::Stop { is_on: true })), "{first:?}");
    let writer = MessageWriter::new(&component).unwrap();
    writer.send(&ToWindow::StopState { is_on: true, to: 1 }).unwrap();
    until(&station, |console| console.stop_status(station.now()) == Some(StopStatus::Unmeasured));
    drop((component, writer));
    until(&station, |console| console.connection.is_cut());
    let _other = connect(&station, "run 2");
    until(&station, |console| !console.connection.is_old());
    assert!(!station.console.lock().orders.is_stopped(), "of another run");
}

#[test]
fn a_window_that_is_opened_during_stop_shows_it_and_drives_nothing() {
    let station = Station::new("127.0.0.1:7411", false);
    let mut component = connect(&station, "run 1");
    let writer = MessageWriter::new(&component).unwrap();
    writer.send(&ToWindow::StopState { is_on: true, to: 1 }).unwrap();
    until(&station, |console| console.orders.is_stopped());
    order(&station, OperatorOrder::Drive { forward: 1.0, turn: 0.0 });
    assert!(!station.console.lock().orders.is_driving());
    assert_eq!(station.console.lock().orders.take_event(), None, "it was ordered before");
    order(&station, OperatorOrder::Release);
    let released = read_message::<ToComponent>(&mut component).unwrap();
    assert!(matches!(released, Some(ToComponent::Stop { is_on: false })), "{released:?}");
}

#[test]
fn only_a_death_is_a_crash() {
    assert!(is_crash("killed by signal 9; it starts again in 0.1 s"));
    assert!(is_crash("ended with code 7; it is given up after 5 starts in 1.6 s"));
    assert!(is_crash("ended with code 7; it is not started again"));
    assert!(!is_crash("ended with code 0; it is not started again"));
    assert!(!is_crash("ended with code 0"));
}

#[test]
fn it_watches_a_file_or_an_address_and_nothing_else() {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    assert_eq!(parse(&["--watch", manifest]).unwrap().watched, manifest);
    let light = parse(&["--watch", "127.0.0.1:7411", "--light"]).unwrap();
    assert!(light.is_light && light.picture.is_none());
    for wrong in [&["--watch", "none.xml"][..], &["--watch"], &["--watch", manifest, "-x"]] {
        assert!(parse(wrong).is_err(), "{wrong:?}");
    }
    assert!(run_if_wanted(&["--name".into(), "view".into()]).is_none(), "a component");
}
