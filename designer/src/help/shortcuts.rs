//! The page of shortcuts (F1): every command with its keys, and what the mouse does.

use eframe::egui::{self, Grid, Id, Key, Modal, Modifiers, RichText, ScrollArea, Ui};

use crate::commands::{COMMANDS, Menu};
use crate::live::TIME_LINE_KEYS;

/// What the mouse does in a drawing.
const MOUSE: &[(&str, &str)] = &[
    ("Wheel", "zooms at the pointer"),
    ("Middle button, or Space and drag", "moves the view"),
    ("Two fingers on a trackpad", "move the view; a pinch zooms"),
    (
        "Drag from a port",
        "draws a link; matching ports are ringed, others show why they do not match",
    ),
    ("Drop a link on the background", "lists what it can be linked with"),
    ("Drag on the background", "selects what is in the frame; with Shift, adds to the selection"),
    ("Double click", "opens the properties; on the background, adds an item"),
    ("Drag from the palette", "adds a component where it is dropped"),
    ("A file dropped on the window", "is opened"),
];

/// What the mouse does on the map, besides.
const MAP_MOUSE: &[(&str, &str)] = &[
    ("Click, and click again", "selects the item in front, then the one behind it"),
    ("Drag a point or a corner", "moves it"),
    ("Drag a circle between corners", "adds a corner"),
    ("Drag the circle of a selected leg", "inserts a point and a leg"),
    ("Double click while drawing", "ends the zone or line, as Enter does"),
];

/// Shows the page; whether it is to be closed.
pub fn show(ctx: &egui::Context) -> bool {
    let modal = Modal::new(Id::unique("shortcuts")).show(ctx, |ui| {
        let room = ui.ctx().content_rect().size();
        ui.set_width((room.x - 60.0).min(860.0));
        ui.heading("Keys and mouse");
        ScrollArea::vertical().max_height(room.y - 140.0).show(ui, page);
        ui.add_space(armor_picture::theme::NEAR);
        ui.vertical_centered(|ui| ui.button("Close").clicked()).inner
    });
    let again = ctx.input_mut(|input| input.consume_key(Modifiers::NONE, Key::F1));
    modal.inner || again || modal.should_close()
}

fn page(ui: &mut Ui) {
    ui.columns(2, |columns| {
        for (n, menu) in Menu::ALL.into_iter().enumerate() {
            commands(&mut columns[n % 2], menu);
        }
        mouse(&mut columns[1]);
    });
}

fn commands(ui: &mut Ui, menu: Menu) {
    ui.label(RichText::new(menu.name()).strong());
    Grid::new(("keys", menu.name())).num_columns(2).striped(true).show(ui, |ui| {
        for about in COMMANDS.iter().filter(|about| about.menu == menu) {
            let keys = about.keys.map(|keys| ui.ctx().format_shortcut(&keys)).unwrap_or_default();
            ui.monospace(keys);
            ui.label(about.name).on_hover_text(about.doc);
            ui.end_row();
        }
    });
    ui.add_space(armor_picture::theme::GAP);
}

fn mouse(ui: &mut Ui) {
    list(ui, "Mouse", MOUSE);
    list(ui, "Mouse on the map", MAP_MOUSE);
    list(ui, "On the time line of a recording", &TIME_LINE_KEYS);
}

fn list(ui: &mut Ui, title: &str, lines: &[(&str, &str)]) {
    ui.label(RichText::new(title).strong());
    Grid::new(title).num_columns(2).striped(true).show(ui, |ui| {
        for (what, does) in lines {
            ui.add(egui::Label::new(*what).wrap());
            ui.add(egui::Label::new(*does).wrap());
            ui.end_row();
        }
    });
    ui.add_space(armor_picture::theme::GAP);
}
