//! What the drawings look like: no text over another, no link behind a block, bundles.

use std::path::{Path, PathBuf};

use armor_designer::canvas::{Diagram, NodeShape, path};
use armor_designer::{Command, Item, Kinds, View};
use eframe::egui::{Event, Pos2, Rect, Shape, Vec2, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;

/// Large enough for every shipped drawing at 100 %.
const LARGE: Vec2 = vec2(4000.0, 2400.0);

/// The files in `missions/`.
fn shipped_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|it| it == "xml")).collect();
    files.sort();
    assert!(files.len() > 10, "{files:?}");
    files
}

/// The kinds of the `armor` of this build; without it, blocks have the ports that links name.
pub(super) fn shipped_kinds() -> Option<Kinds> {
    let armor = Path::new(env!("CARGO_BIN_EXE_armor-designer")).parent().unwrap().join("armor");
    armor.exists().then(|| Kinds::ask(&armor, Path::new("."), &[]).unwrap())
}

/// A window on a shipped file, arranged and at 100 %.
fn arranged(size: Vec2, file: &Path, view: View, kinds: Option<&Kinds>) -> Window {
    let kinds = kinds.cloned();
    let mut window = Window::open_sized(size, None, |_, start| {
        start.file = Some(file.to_path_buf());
        start.view = view;
        start.kinds = Some(kinds.unwrap_or_default());
    });
    for command in [Command::Arrange, Command::ZoomFit] {
        let context = window.harness.ctx.clone();
        window.harness.state_mut().run(command, &context);
        window.settle();
    }
    window
}

fn drawing(window: &mut Window) -> Diagram<Item> {
    window.harness.state_mut().drawing().clone()
}

/// Every text in the window, with where it is.
pub(super) fn texts(window: &Window) -> Vec<(String, Rect)> {
    fn collect(shape: &Shape, texts: &mut Vec<(String, Rect)>) {
        match shape {
            Shape::Text(text) => {
                texts.push((text.galley.text().to_owned(), shape.visual_bounding_rect()));
            }
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, texts)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for clipped in &window.harness.output().shapes {
        collect(&clipped.shape, &mut found);
    }
    found
}

/// Every text in the window, with the size of its smallest letters.
pub(super) fn letter_sizes(window: &Window) -> Vec<(String, f32)> {
    fn collect(shape: &Shape, found: &mut Vec<(String, f32)>) {
        match shape {
            Shape::Text(text) => {
                let job = &text.galley.job;
                let sizes = job.sections.iter().map(|section| section.format.font_id.size);
                found.push((text.galley.text().to_owned(), sizes.fold(f32::INFINITY, f32::min)));
            }
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for clipped in &window.harness.output().shapes {
        collect(&clipped.shape, &mut found);
    }
    found
}

/// The texts of bars, and what is wrong with them: which are covered, and how many are missing.
fn faults_of_bar_texts(window: &mut Window) -> (Vec<String>, usize) {
    let diagram = drawing(window);
    let texts = texts(window);
    let label = |n: usize| window.harness.get_by_label(&diagram.nodes[n].label).rect();
    let rects: Vec<Rect> = (0..diagram.nodes.len()).map(label).collect();
    let mut faults = Vec::new();
    let mut missing = 0;
    let mut own: Vec<(String, Rect)> = Vec::new();
    for (n, node) in diagram.nodes.iter().enumerate() {
        if node.shape != NodeShape::Bar {
            continue;
        }
        for line in [&node.title].into_iter().chain(node.lines.iter().map(|line| &line.text)) {
            // The same text may be at several bars: the nearest one is its own.
            let near = texts.iter().filter(|(text, _)| text == line);
            let near = near.map(|(_, rect)| *rect).min_by(|a, b| {
                let away = |rect: &Rect| rect.center().distance(rects[n].center());
                away(a).total_cmp(&away(b))
            });
            match near.filter(|rect| rect.center().distance(rects[n].center()) < 180.0) {
                Some(rect) => own.push((format!("{line} of {}", node.label), rect.shrink(0.5))),
                None => missing += 1,
            }
        }
    }
    for (n, (text, rect)) in own.iter().enumerate() {
        let others = own.iter().skip(n + 1).filter(|(_, other)| other.intersects(*rect));
        faults.extend(others.map(|(other, _)| format!("{text} and {other}")));
        let nodes = rects.iter().zip(&diagram.nodes).filter(|(node, _)| node.intersects(*rect));
        faults.extend(nodes.map(|(_, node)| format!("{text} and {}", node.label)));
    }
    (faults, missing)
}

#[test]
fn texts_of_transitions_cover_nothing_in_the_shipped_missions() {
    let kinds = shipped_kinds();
    let mut count = 0;
    for file in shipped_files() {
        let mut window = arranged(LARGE, &file, View::Mission, kinds.as_ref());
        let (faults, missing) = faults_of_bar_texts(&mut window);
        // The net of a route has more transitions than there is room for the texts of.
        let is_drawn = std::fs::read_to_string(&file).is_ok_and(|text| text.contains("<route "));
        let is_whole = missing == 0 || is_drawn;
        assert!(faults.is_empty() && is_whole, "{}: {faults:?}, {missing}", file.display());
        count += drawing(&mut window).nodes.len();
        // In a small window lines that have no room are left out.
        let mut window = arranged(vec2(900.0, 600.0), &file, View::Mission, kinds.as_ref());
        let (faults, _) = faults_of_bar_texts(&mut window);
        assert!(faults.is_empty(), "{}: {faults:?}", file.display());
    }
    assert!(count > 100, "{count}");
}

#[test]
fn a_text_that_would_cover_another_bar_or_place_is_moved() {
    let close = r#"<armor version="1">
  <system name="bench"><component name="arm" kind="arm"/></system>
  <mission goal="home" safe="home">
    <place name="explore" initial="true" components="arm"/>
    <place name="home"/>
    <transition name="first-of-the-two" from="explore" to="home" on="arm.done"/>
    <transition name="second-of-the-two" from="explore" to="home" timeout="90s"/>
    <transition name="third" from="explore" to="home" timeout="95s"/>
    <layout>
      <block of="explore" x="0" y="0"/>
      <block of="home" x="400" y="0"/>
      <block transition="first-of-the-two" x="200" y="-100"/>
      <block transition="second-of-the-two" x="270" y="-100"/>
      <block transition="third" x="200" y="-46"/>
    </layout>
  </mission>
</armor>
"#;
    let mut window = Window::open(Some(close));
    window.click("view: Mission");
    let (faults, missing) = faults_of_bar_texts(&mut window);
    assert!(faults.is_empty(), "{faults:?}");
    assert_eq!(missing, 0, "each has room at another side");
}

/// The links that pass behind a block that they neither leave nor enter.
fn crossings(diagram: &Diagram<Item>) -> Vec<String> {
    let mut found = Vec::new();
    for (n, wire) in diagram.wires.iter().enumerate() {
        let Some(points) = path(diagram, n, |_| Vec2::ZERO, 24) else { continue };
        for (number, node) in diagram.nodes.iter().enumerate() {
            let is_own = number == wire.from.node || number == wire.to.node;
            // At its own blocks a link touches the edge.
            let rect = if is_own { node.rect.shrink(3.0) } else { node.rect };
            let is_around = |port: usize, at: usize| {
                diagram.nodes[at].ports[port].side == armor_designer::canvas::PortSide::Around
            };
            let ends_inside = (number == wire.from.node && is_around(wire.from.port, number))
                || (number == wire.to.node && is_around(wire.to.port, number));
            let inside = |piece: &[Pos2]| {
                (0..=10).any(|at| rect.contains(piece[0].lerp(piece[1], at as f32 / 10.0)))
            };
            if !ends_inside && points.windows(2).any(inside) {
                found.push(format!("{} behind {}", wire.label, node.label));
            }
        }
    }
    found
}

#[test]
fn no_link_or_arc_passes_behind_a_block_in_the_shipped_files() {
    let kinds = shipped_kinds();
    let mut count = 0;
    for file in shipped_files() {
        for view in [View::System, View::Mission] {
            let mut window = arranged(LARGE, &file, view, kinds.as_ref());
            let diagram = drawing(&mut window);
            let found = crossings(&diagram);
            assert!(found.is_empty(), "{}: {found:#?}", file.display());
            count += diagram.wires.len();
        }
    }
    assert!(count > 300, "{count}");
}

const PAIR: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye"/>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
    <link from="eye.image" to="arm.view"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="arm" x="500" y="0"/>
    </layout>
  </system>
</armor>
"#;

#[test]
fn links_between_the_same_two_blocks_are_one_bundle_until_the_pointer_or_a_selection_opens_it() {
    let mut window = Window::open(Some(PAIR));
    let count = |window: &Window| {
        let (eye, arm) = (window.at("component eye"), window.at("component arm"));
        let between =
            |rect: &Rect| rect.center().x > eye.x + 60.0 && rect.center().x < arm.x - 60.0;
        texts(window).into_iter().find(|(text, rect)| text == "2" && between(rect))
    };
    let (_, pill) = count(&window).expect("the number of links");
    window.harness.event(Event::PointerMoved(pill.center()));
    window.settle();
    assert!(count(&window).is_none(), "open under the pointer");
    window.harness.event(Event::PointerMoved(pill.center() + vec2(0.0, 250.0)));
    window.settle();
    assert!(count(&window).is_some(), "closed when the pointer has left");
    window.click("link eye.image to arm.view");
    window.harness.event(Event::PointerMoved(pill.center() + vec2(0.0, 250.0)));
    window.settle();
    assert!(count(&window).is_none(), "open while a link of it is selected");
    window.key(eframe::egui::Key::Delete);
    assert!(!window.text().contains("eye.image") && window.text().contains("eye.target"));
    assert!(count(&window).is_none(), "a single link is no bundle");
    window.keys(eframe::egui::Modifiers::COMMAND, eframe::egui::Key::Z);
    assert_eq!(window.text(), PAIR);
}

#[test]
fn a_bundle_between_blocks_that_are_near_each_other_stays_in_the_gap() {
    let mut count = 0;
    for x in (100..400).step_by(10) {
        let near = PAIR.replace(r#"of="arm" x="500""#, &format!(r#"of="arm" x="{x}""#));
        let mut window = Window::open(Some(&near));
        let diagram = drawing(&mut window);
        let rect = |name: &str| {
            diagram.nodes.iter().find(|node| node.label.contains(name)).expect("a block").rect
        };
        let gap = rect("arm").min.x - rect("eye").max.x;
        if (15.0..80.0).contains(&gap) {
            assert_eq!(crossings(&diagram), Vec::<String>::new(), "a gap of {gap}");
            count += 1;
        }
    }
    assert!(count >= 3, "{count}");
}

/// What a link shows of its own must be seen: it is in no bundle.
#[test]
fn a_link_with_a_text_is_in_no_bundle() {
    let kept = PAIR.replace(r#"to="arm.view"/>"#, r#"to="arm.view" keep="50"/>"#);
    let window = Window::open(Some(&kept));
    let texts = texts(&window);
    assert!(texts.iter().any(|(text, _)| text == "keep 50"));
    let middle = window.at("component eye").x + 100.0..window.at("component arm").x - 100.0;
    assert!(!texts.iter().any(|(text, at)| text == "2" && middle.contains(&at.center().x)));
}

/// Relays, each fed by the one before.
fn chain(count: usize) -> String {
    let mut parts: Vec<String> =
        (0..count).map(|n| format!(r#"<component name="relay-{n}" kind="relay"/>"#)).collect();
    parts.extend(
        (1..count)
            .map(|n| format!(r#"<link from="relay-{}.element" to="relay-{n}.writers"/>"#, n - 1)),
    );
    format!(
        "<armor version=\"1\">\n  <system name=\"bench\">{}</system>\n</armor>\n",
        parts.concat()
    )
}

#[test]
fn a_large_drawing_is_arranged_to_the_shape_of_the_window() {
    for size in [vec2(1600.0, 800.0), vec2(900.0, 1100.0)] {
        let mut window = Window::open_sized(size, Some(&chain(48)), |_, _| ());
        let context = window.harness.ctx.clone();
        window.harness.state_mut().run(Command::Arrange, &context);
        window.settle();
        let canvas = window.harness.get_by_label("drawing of the system").rect();
        let whole = drawing(&mut window).extent().unwrap();
        let ratio = whole.aspect_ratio() / canvas.aspect_ratio();
        assert!((0.4..2.5).contains(&ratio), "{whole} in {canvas}");
        let found = crossings(&drawing(&mut window));
        assert!(found.is_empty(), "{found:#?}");
    }
}
