//! The zones of a drawn map as the parameters that they fill.

use std::path::Path;

use armor_robotfile::{Colours, Configuration, Manifests, Override, check, read};
use armor_wire::manifest::Manifest;
use armor_wire::text_format::TextFormat;
use armor_wire::zone_text::parse_zones;

/// A kind whose parameter `zones` the map fills.
fn kinds() -> Manifests {
    let text = include_str!("example_kinds.json");
    let kinds: Vec<Manifest> = serde_json::from_str(text).unwrap();
    let mut arm = kinds.into_iter().find(|kind| kind.kind == "arm").unwrap();
    let patrol: Vec<Manifest> = serde_json::from_str(text).unwrap();
    let patrol = patrol.into_iter().find(|kind| kind.kind == "patrol").unwrap();
    let mut zones = patrol.parameters.iter().find(|it| it.format.is_some()).unwrap().clone();
    (zones.name, zones.format) = ("zones".into(), Some(TextFormat::Zones));
    (zones.default, zones.live) = (Some(String::new()), true);
    arm.parameters = vec![zones];
    arm.kind = "chart".into();
    [arm, patrol].into_iter().map(|kind| (kind.kind.clone(), kind)).collect()
}

fn file(zones: &str, parameter: &str) -> String {
    format!(
        "<armor version='1'><system><component name='way' kind='patrol'/>\
         <component name='chart' kind='chart'>{parameter}</component></system>\
         <mission goal='over' safe='hold'><map><point name='P0' at='0 0'/>\
         <point name='P1' at='2 0'/>{zones}</map>\
         <route name='red' mover='way.route' start='P0' out='over'><leg name='l1' to='P1' by='1min'/>\
         </route><place name='over'/><place name='hold'/></mission></armor>"
    )
}

fn load(text: &str, overrides: &[Override]) -> Configuration {
    let reading = read(Path::new("a.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    let reading = check(reading, overrides, Some(&kinds()));
    reading
        .configuration
        .filter(|_| !reading.findings.has_errors())
        .unwrap_or_else(|| panic!("{}", reading.findings.render(Colours::No)))
}

fn filled(configuration: &Configuration) -> Option<&str> {
    let chart = configuration.system.component("chart").unwrap();
    chart.parameter("zones").map(|zones| zones.value.value.as_str())
}

const ZONES: &str = "<zone name='school' kind='no-go' margin='2m' shape='3,4 9,4 9,8.5'/>\
    <zone name='yard' kind='stay-in' shape='-20,-20 20,-20 20,20 -20,20'/>\
    <zone name='crossing' kind='speed' speed='0.3m/s' shape='circle 4,-4 50cm'/>\
    <zone name='pond' kind='observe' shape='circle -3,0 1m'/>";

#[test]
fn the_zones_of_the_map_fill_the_parameters_that_are_for_them() {
    let configuration = load(&file(ZONES, ""), &[]);
    let text = filled(&configuration).expect("it is filled");
    assert_eq!(
        text,
        "school no-go margin=2m 3,4 9,4 9,8.5; yard stay-in -20,-20 20,-20 20,20 -20,20; \
         crossing speed=0.3m/s circle 4,-4 0.5m; pond observe circle -3,0 1m"
    );
    assert_eq!(parse_zones(text).map(|zones| zones.len()), Ok(4));
    assert_eq!(filled(&load(&file("", ""), &[])), None, "no zones are drawn");
}

#[test]
fn what_the_file_or_the_command_line_assigns_has_priority() {
    let own = "<parameter name='zones' value='pit no-go circle 5,5 1m'/>";
    assert_eq!(filled(&load(&file(ZONES, own), &[])), Some("pit no-go circle 5,5 1m"));
    let over = Override::parse("chart.zones=", Path::new(".")).unwrap();
    assert_eq!(filled(&load(&file(ZONES, ""), &[over])), Some(""));
}

#[test]
fn a_text_of_zones_is_checked() {
    let own = "<parameter name='zones' value='pit no-go circle 5,5'/>";
    let text = file("", own);
    let reading = read(Path::new("a.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    let reading = check(reading, &[], Some(&kinds()));
    let shown = reading.findings.render(Colours::No);
    assert!(shown.contains("at character 11: a circle is its centre and its radius"), "{shown}");
}
