//! A link: its output, its input, and what a slow subscriber receives.

use armor_robotfile::model::LinkMode;
use armor_wire::keep::{Keep, Wake};
use armor_wire::quantity;
use eframe::egui::{self, ComboBox};

use crate::commands::Command;
use crate::item::Item;
use crate::panels::fields::Form;
use crate::system::properties::field::Field;
use crate::system::state::SystemView;
use crate::workspace::Workspace;

/// An attribute with a few values: its name, what it is called, its values with what they mean. The
/// first value is the default, which the file does not say.
type Choice<'a> = (&'static str, &'static str, &'a [(&'a str, &'a str)]);

impl SystemView {
    pub(super) fn link_properties(
        &mut self,
        ui: &mut egui::Ui,
        workspace: &mut Workspace,
        from: &str,
        to: &str,
    ) {
        let found = workspace.project.configuration().and_then(|configuration| {
            let mut links = configuration.system.links.iter();
            links.find(|link| link.from.data() == from && link.to.data() == to).cloned()
        });
        let Some(link) = found else { return };
        ui.strong("Link");
        for (name, data) in [("from", from), ("to", to)] {
            ui.horizontal(|ui| {
                ui.weak(name);
                if ui.link(data).on_hover_text("Selects the component").clicked()
                    && let Some((component, _)) = data.split_once('.')
                {
                    self.pane.select([Item::component(component)]);
                }
            });
        }
        let item = Item::link(from, to);
        let unread = |attribute| {
            let named = armor_robotfile::Item::Link { from, to };
            workspace.project.unread(named, attribute).map(str::to_owned)
        };
        self.keep(ui, &item, link.keep, (unread("keep"), unread("patience")));
        let mode = if link.mode == LinkMode::Pull { "pull" } else { "push" };
        let wake = if link.wake == Wake::Spin { "spin" } else { "sleep" };
        let transport = link.transport.name();
        let choices: [(Choice<'_>, &str); 3] = [
            (
                (
                    "mode",
                    "Mode",
                    &[("push", "sent as it is published"), ("pull", "asked for before each exec")],
                ),
                mode,
            ),
            (
                (
                    "wake",
                    "Wake",
                    &[
                        ("sleep", "both ends sleep"),
                        ("spin", "both ends poll: lower latency, uses a core"),
                    ],
                ),
                wake,
            ),
            (
                (
                    "transport",
                    "Transport",
                    &[
                        ("auto", "automatic"),
                        ("tcp", "TCP"),
                        ("shm", "shared memory"),
                        ("udp", "UDP, for a remote operator"),
                    ],
                ),
                transport,
            ),
        ];
        for (choice, current) in choices {
            self.choices(ui, &item, choice, current, unread(choice.0));
        }
        ui.label("History").on_hover_text("How many of the newest data the input keeps.");
        let written = || if link.history == 1 { String::new() } else { link.history.to_string() };
        let history = unread("history").unwrap_or_else(written);
        let form = Form { name: "link history", hint: "1", width: 80.0, rows: 1 };
        let field = Field::Attribute(item, "history");
        let response = self.drafts.text(ui, &field, &history, form, &|text| whole(text, u32::MAX));
        self.focus(&response);
        ui.separator();
        if ui.button("Remove the link").clicked() {
            workspace.order_command(Command::Delete);
        }
    }

    /// `unread`: what the file has for `keep` and `patience` that cannot be read.
    fn keep(
        &mut self,
        ui: &mut egui::Ui,
        item: &Item,
        keep: Keep,
        (unread, unread_patience): (Option<String>, Option<String>),
    ) {
        ui.label("Keep").on_hover_text("What a slow consumer gets.");
        let field = Field::Attribute(*item, "keep");
        let last = |count: u32| format!("the newest {count}");
        let shown = match keep {
            // A file pulls by the mode of the link.
            Keep::Latest | Keep::Pull => "the newest".to_owned(),
            Keep::Last { count } => last(count),
            Keep::All { .. } => "everything; the sender waits".to_owned(),
        };
        let is_read = unread.is_none();
        let shown = unread.unwrap_or(shown);
        let combo = ComboBox::from_id_salt("keep").selected_text(shown).width(ui.available_width());
        let combo = combo.show_ui(ui, |ui| {
            let counted = if let Keep::Last { count } = keep { count } else { 10 };
            for (value, text, is_it) in [
                (String::new(), "the newest".to_owned(), keep == Keep::Latest),
                (counted.to_string(), last(counted), matches!(keep, Keep::Last { .. })),
                ("all".into(), "everything; the sender waits".to_owned(), keep.is_all()),
            ] {
                if ui.selectable_label(is_it && is_read, text).clicked() {
                    self.drafts.set(field.clone(), value);
                }
            }
        });
        combo.response.accessible_name("link keep");
        if let Keep::Last { count } = keep {
            let form = Form { name: "link keeps how many", hint: "", width: 80.0, rows: 1 };
            let limit = armor_wire::keep::MAX_KEEP;
            let current = count.to_string();
            self.drafts.text(ui, &field, &current, form, &|text| whole(text, limit));
        }
        if let Keep::All { patience_ms } = keep {
            ui.label("Patience").on_hover_text(
                "How long the sender waits for a consumer that takes nothing; then the link ends.",
            );
            let field = Field::Attribute(*item, "patience");
            let form = Form { name: "link patience", hint: "10s", width: 80.0, rows: 1 };
            let written = match keep {
                Keep::ALL => String::new(),
                _ => format!("{}s", f64::from(patience_ms) / 1e3),
            };
            let patience = unread_patience.unwrap_or(written);
            let check = |text: &str| match quantity::seconds(text) {
                _ if text.is_empty() => Ok(()),
                read => read.map(drop).map_err(|error| error.to_string()),
            };
            let response = self.drafts.text(ui, &field, &patience, form, &check);
            self.focus(&response);
        }
    }

    fn choices(
        &mut self,
        ui: &mut egui::Ui,
        item: &Item,
        choice: Choice<'_>,
        current: &str,
        unread: Option<String>,
    ) {
        let (attribute, label, values) = choice;
        ui.label(label);
        let shown = values.iter().find(|(value, _)| *value == current && unread.is_none());
        let text = |(value, about): &(&str, &str)| format!("{value}: {about}");
        let combo = ComboBox::from_id_salt(attribute).width(ui.available_width());
        let shown_text = unread.or(shown.map(text)).unwrap_or_default();
        let combo = combo.selected_text(shown_text).show_ui(ui, |ui| {
            for (n, entry) in values.iter().enumerate() {
                if ui.selectable_label(shown == Some(entry), text(entry)).clicked() {
                    let written = if n == 0 { "" } else { entry.0 };
                    self.drafts.set(Field::Attribute(*item, attribute), written);
                }
            }
        });
        combo.response.accessible_name(format!("link {attribute}"));
    }
}

fn whole(text: &str, most: u32) -> Result<(), String> {
    match text.parse::<u32>() {
        _ if text.is_empty() => Ok(()),
        Ok(number) if (1..=most).contains(&number) => Ok(()),
        _ if most == u32::MAX => Err("a whole number from 1 is expected".into()),
        _ => Err(format!("a whole number from 1 to {most} is expected")),
    }
}
