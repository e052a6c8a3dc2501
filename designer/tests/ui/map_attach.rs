//! A window that begins on the map and attached to a system, as by `--view map --attach`: over real
//! connections, with a registry and the processes of the system in this process.

use std::net::TcpListener;
use std::time::Duration;

use armor_designer::View;
use armor_marking::Marking;
use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_sdk::messages::PoseWithCovarianceStamped;
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_sdk::prelude::{Fault, Latched};

use crate::ui::Window;
use crate::ui::map_live::{DRIVEN, marking, pose};

/// Only a hang takes this long.
const DEADLINE: Duration = Duration::from_secs(60);

/// A system that plays a mission, and one that reports where its robot is.
struct RunningSystem {
    registry: BackgroundRegistry,
    executive: SystemNode,
    eye: SystemNode,
}

impl RunningSystem {
    fn start() -> Self {
        let listen = "127.0.0.1:0".parse().unwrap();
        let options = RegistryOptions { listen, ..RegistryOptions::default() };
        let registry = BackgroundRegistry::start(options).unwrap();
        let node = |name: &str, declare: &dyn Fn(&armor_sdk::Armor) -> Result<(), Fault>| {
            let (name, kind) = (name.to_owned(), name.to_owned());
            let node = NodeOptions { name, kind, registry: registry.address().to_string() };
            SystemNode::start(&node, DEADLINE, declare).expect("it is registered")
        };
        let executive =
            node("executive", &|armor| Ok(armor.provide::<Latched<Marking>>("marking")?));
        let eye = node("eye", &|armor| Ok(armor.provide::<PoseWithCovarianceStamped>("pose")?));
        Self { registry, executive, eye }
    }

    fn plays(&self, marking: &Marking) {
        self.executive.armor().send_data("marking", marking).expect("it is published");
    }

    fn is_at(&self, x: f64, y: f64) {
        self.eye.armor().send_data("pose", &pose("map", x, y)).expect("it is published");
    }
}

fn attached(address: &str, text: &str) -> Window {
    let address = address.to_owned();
    Window::open_as(Some(text), |_, start| {
        (start.view, start.attach) = (View::Map, Some(Some(address)));
    })
}

#[test]
fn attached_the_map_shows_the_robots_of_the_system() {
    let system = RunningSystem::start();
    system.plays(&marking());
    let mut window = attached(&system.registry.address().to_string(), DRIVEN);
    // The view stays, with its strip open.
    assert!(window.has("drawing of the map"));
    window.until("the robot on the map", |window| {
        system.is_at(10.0, 4.0);
        window.has_part("robot red, l2")
    });
    assert!(window.has("step l1 of red: done") && window.has("step l2 of red: under way"));
    let mut ended = marking();
    (ended.places[0].place, ended.fired) = ("over".into(), 2);
    ended.history.push(armor_marking::Fired { transition: "red.l2.done".into(), fired_at_s: 20.0 });
    system.plays(&ended);
    window.until("the end of the route", |window| window.has("step l2 of red: done"));
}

#[test]
fn where_no_registry_listens_the_map_states_so_and_shows_the_file() {
    // A port that was free a moment ago.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let mut window = attached(&address, DRIVEN);
    let text = format!("No registry has answered at {address}");
    window.until("the reason", |window| window.has_part(&text));
    assert!(window.has("point P2") && !window.has_part("robot red"));
}

#[test]
fn a_system_that_plays_another_mission_or_none_is_named_and_not_drawn() {
    let system = RunningSystem::start();
    let address = system.registry.address().to_string();
    let mut window = attached(&address, DRIVEN);
    window
        .until("the reason", |window| window.has_part("has not published the state of a mission"));
    let other = Marking { mission: "another".into(), ..marking() };
    system.plays(&other);
    window.until("the other mission", |window| window.has_part("plays the mission another"));
    assert!(!window.has_part("robot red") && window.has("point P2"));
}

#[test]
fn a_mission_without_a_map_is_followed_without_robots() {
    let (head, rest) = DRIVEN.split_once("    <map>").expect("a map");
    let (_, tail) = rest.split_once("</route>").expect("a route");
    let text = format!(
        "{head}    <place name=\"go\" initial=\"true\" components=\"way\"/>\n    \
         <transition name=\"gone\" from=\"go\" to=\"over\" on=\"way.done\"/>{tail}"
    );
    let system = RunningSystem::start();
    let mut playing = marking();
    playing.places[0].place = "go".into();
    (playing.enabled, playing.history) = (Vec::new(), Vec::new());
    system.plays(&playing);
    let mut window = attached(&system.registry.address().to_string(), &text);
    window.until("the state of the mission", |window| window.has_part("version 0 of the file"));
    assert!(window.has("drawing of the map") && !window.has_part("robot "));
    assert_eq!(window.text(), text, "nothing is drawn into the file");
}
