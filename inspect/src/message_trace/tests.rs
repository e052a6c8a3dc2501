use armor_sdk::call_trace::TracedOutput;

use super::*;

const T: f64 = 1_700_000_000.0;

fn call(number: u64, function: &str, began_s: f64, ended_s: f64) -> TracedCall {
    let (began_s, ended_s) = (T + began_s, T + ended_s);
    TracedCall { number, function: function.into(), began_s, ended_s, ..TracedCall::default() }
}

fn publishing(mut call: TracedCall, output: &str, sequence: u64, at_s: f64) -> TracedCall {
    call.published.push(TracedOutput { output: output.into(), sequence, at_s: T + at_s });
    call
}

fn receiving(
    mut call: TracedCall,
    data: &str,
    instance: u64,
    sequence: u64,
    at_s: f64,
) -> TracedCall {
    let arrived_s = T + at_s;
    let data = data.into();
    call.input =
        Some(TracedInput { data, instance, sequence, arrived_s, ..TracedInput::default() });
    call
}

fn report(component: &str, instance: u64, calls: Vec<TracedCall>) -> CallReport {
    CallReport { component: component.into(), instance, calls, missed: 0 }
}

/// A laser (1), a mapper (2) that works on each scan, and a driver (3) with a rate.
fn chain() -> [CallReport; 3] {
    let scan = publishing(call(0, "exec", 0.0, 0.01), "scan", 5, 0.002);
    let pose = receiving(call(0, "data_received", 0.004, 0.02), "laser.scan", 1, 5, 0.003);
    let pose = publishing(pose, "pose", 9, 0.015);
    let stored = receiving(call(7, "data_received", 0.018, 0.019), "mapper.pose", 2, 9, 0.017);
    let tick = publishing(call(8, "exec", 0.05, 0.051), "velocity", 2, 0.0505);
    let idle = call(9, "exec", 0.1, 0.101);
    [
        report("laser", 1, vec![scan]),
        report("mapper", 2, vec![pose]),
        report("driver", 3, vec![stored, tick, idle]),
    ]
}

#[test]
fn one_trace_leads_from_the_sensor_to_the_actuator_in_any_order_of_the_reports() {
    let mut found = Vec::new();
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        let reports = chain();
        let mut assembly = TraceAssembly::default();
        for at in order {
            assembly.add_report(reports[at].clone());
        }
        assert_eq!(assembly.settle(T + 0.9), [], "the last may not have arrived yet");
        found.push(assembly.settle(T + 1.2));
    }
    assert!(found.iter().all(|steps| *steps == found[0]), "{found:?}");
    let [scan, pose, stored, tick] = found[0].as_slice() else { panic!("{found:?}") };
    assert_eq!(scan.cause, CallCause::Origin { after: vec![] });
    for step in [pose, stored, tick] {
        assert_eq!(step.place.trace, scan.place.trace, "{step:?}");
        assert_eq!(step.trace_began_s, T);
    }
    let CallCause::Message(message) = &pose.cause else { panic!("{pose:?}") };
    assert_eq!(message.published, Some((scan.place.span, T + 0.002)));
    assert!((message.transport_s().expect("both are known") - 0.001).abs() < 1e-6);
    let CallCause::Message(message) = &stored.cause else { panic!("{stored:?}") };
    assert_eq!(message.published.map(|(span, _)| span), Some(pose.place.span));
    let data = "mapper.pose".to_owned();
    let held = CallCause::Held { last: stored.place, data, since_s: T + 0.019, others: vec![] };
    assert_eq!(tick.cause, held);
    let mut spans: Vec<_> = found[0].iter().map(|step| step.place.span).collect();
    spans.sort_unstable();
    spans.dedup();
    assert_eq!(spans.len(), 4);
}

#[test]
fn a_tick_is_linked_to_all_that_came_since_the_last() {
    let mut assembly = TraceAssembly::default();
    let got = |number, data: &str, at_s: f64| {
        receiving(call(number, "data_received", at_s, at_s), data, 9, number, at_s)
    };
    let ticks = |number, at_s: f64| publishing(call(number, "exec", at_s, at_s), "v", number, at_s);
    let calls = vec![got(0, "a.x", 0.0), got(1, "b.y", 0.1), ticks(2, 0.2), ticks(3, 0.3)];
    assembly.add_report(report("driver", 3, calls));
    let steps = assembly.settle(T + 5.0);
    let [first, second, tick, alone] = steps.as_slice() else { panic!("{steps:?}") };
    assert_ne!(first.place.trace, second.place.trace, "their publishers are not known");
    let CallCause::Held { last, others, .. } = &tick.cause else { panic!("{tick:?}") };
    assert_eq!((last, others.as_slice()), (&second.place, &[first.place][..]));
    assert_eq!(tick.place.trace, second.place.trace);
    assert_eq!(alone.cause, CallCause::Origin { after: vec![] }, "nothing has come since");
}

#[test]
fn only_traces_that_begin_with_the_named_data_are_kept() {
    let keep = |wanted: &str| {
        let mut assembly = TraceAssembly::new(vec![wanted.into()]);
        chain().into_iter().for_each(|report| assembly.add_report(report));
        let steps = assembly.settle(T + 5.0);
        steps.into_iter().map(|step| step.component).collect::<Vec<_>>()
    };
    assert_eq!(keep("laser.scan"), ["laser", "mapper", "driver", "driver"]);
    assert_eq!(keep("mapper.pose"), ["mapper", "driver", "driver"]);
    assert_eq!(keep("camera.image"), [""; 0]);
}

#[test]
fn what_is_old_is_forgotten_and_what_is_missing_counted() {
    let mut assembly = TraceAssembly::default();
    assembly.add_report(report(
        "laser",
        1,
        vec![publishing(call(0, "exec", 0.0, 0.0), "scan", 5, 0.0)],
    ));
    assert_eq!(assembly.settle(T + 2.0).len(), 1);
    assert_eq!(assembly.settle(T + 100.0).len(), 0);
    let late = receiving(call(0, "data_received", 99.0, 99.0), "laser.scan", 1, 5, 99.0);
    assembly.add_report(CallReport { missed: 3, ..report("mapper", 2, vec![late]) });
    let steps = assembly.settle(T + 101.0);
    let CallCause::Message(message) = &steps[0].cause else { panic!("{steps:?}") };
    assert_eq!(message.published, None);
    assert_eq!((assembly.take_missed(), assembly.take_missed()), (3, 0));
}

#[test]
fn a_trace_ends_where_the_loop_of_the_robot_closes() {
    // The robot (1) publishes a scan, the driver (2) answers it, and the robot moves and scans again.
    let robot = |number: u64, at_s: f64| {
        let moves =
            receiving(call(number, "data_received", at_s, at_s), "driver.v", 2, number, at_s);
        let scans = call(number + 1, "exec", at_s + 0.01, at_s + 0.02);
        [moves, publishing(scans, "scan", number + 1, at_s + 0.01)]
    };
    let answer = |number: u64, at_s: f64| {
        let answer = call(number, "data_received", at_s, at_s + 0.01);
        publishing(receiving(answer, "robot.scan", 1, number, at_s), "v", number + 1, at_s)
    };
    let reports = [
        report(
            "robot",
            1,
            [robot(0, 0.0)[1..].to_vec(), robot(2, 0.2).into(), robot(4, 0.4).into()].concat(),
        ),
        report("driver", 2, vec![answer(1, 0.1), answer(3, 0.3)]),
    ];
    for wanted in [vec![], vec!["robot.scan".to_owned()]] {
        let mut assembly = TraceAssembly::new(wanted.clone());
        reports.iter().cloned().for_each(|report| assembly.add_report(report));
        let steps = assembly.settle(T + 5.0);
        let scans: Vec<_> = steps
            .iter()
            .filter(|step| !step.call.published.is_empty() && step.instance == 1)
            .collect();
        let [first, second, third] = scans.as_slice() else { panic!("{wanted:?}: {steps:?}") };
        assert!(first.place.trace != second.place.trace && second.place.trace != third.place.trace);
        let moves = steps.iter().find(|step| step.call.began_s == T + 0.2).expect("it is there");
        assert_eq!(moves.place.trace, first.place.trace, "it leads to the actuator");
        assert_eq!(second.cause, CallCause::Origin { after: vec![moves.place] });
    }
}

#[test]
fn a_loop_without_the_first_component_ends_too() {
    let mut assembly = TraceAssembly::default();
    assembly.add_report(report(
        "camera",
        1,
        vec![publishing(call(0, "exec", 0.0, 0.0), "i", 0, 0.0)],
    ));
    let begin = receiving(call(0, "data_received", 0.1, 0.1), "camera.i", 1, 0, 0.1);
    let (mut a, mut b) = (vec![begin], Vec::new());
    for number in 1..20 {
        let at_s = number as f64;
        let [tick, got] = [("exec", 0.0), ("data_received", 0.6)]
            .map(|(function, later_s)| call(number * 2, function, at_s + later_s, at_s + later_s));
        a.push(publishing(tick, "x", number, at_s));
        a.push(receiving(got, "b.y", 3, number, at_s + 0.6));
        let [got, tick] = [("data_received", 0.1), ("exec", 0.5)]
            .map(|(function, later_s)| call(number * 2, function, at_s + later_s, at_s + later_s));
        b.push(receiving(got, "a.x", 2, number, at_s + 0.1));
        b.push(publishing(tick, "y", number, at_s + 0.5));
    }
    assembly.add_report(report("a", 2, a));
    assembly.add_report(report("b", 3, b));
    let steps = assembly.settle(T + 100.0);
    let longest_s = steps.iter().map(|step| step.call.began_s - step.trace_began_s);
    let longest_s = longest_s.fold(0.0, f64::max);
    assert!((9.0..=LONGEST_TRACE_S + 1.0).contains(&longest_s), "{longest_s}");
}
