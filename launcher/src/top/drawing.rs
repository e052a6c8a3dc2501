//! Draws the view of `armor top` into a terminal of any size.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Cell, Paragraph, Row, Table, TableState};

use super::snapshot::{CUT_OFF, HOST_CELL, ProcessRow, SortKey};
use super::view::{ShownTable, TopView};

/// A column of the components: its cell, the width that it needs, and how important it is; the least
/// important ones are left out first.
struct Column {
    cell: usize,
    width: u16,
    rank: u8,
}

const STATE_CELL: usize = 1;
/// Narrower names are hard to tell apart.
const MIN_NAME_WIDTH: u16 = 12;

const fn column(cell: usize, width: u16, rank: u8) -> Column {
    Column { cell, width, rank }
}

/// All but the name, which has the rest of the width.
const COLUMNS: [Column; 10] = [
    column(STATE_CELL, 9, 1),
    column(2, 6, 0),
    column(3, 8, 2),
    column(4, 4, 7),
    column(5, 7, 5),
    column(6, 7, 4),
    column(7, 8, 3),
    column(8, 6, 1),
    column(9, 4, 6),
    column(HOST_CELL, 10, 8),
];

/// Most lines about other hosts; the components need the rest.
const MAX_HOST_LINES: usize = 8;

/// Draws the whole.
pub fn draw(frame: &mut Frame<'_>, view: &TopView) {
    let mut lines = vec![view.snapshot.describe_system(), view.snapshot.describe_mission()];
    lines.extend(view.snapshot.describe_hosts().into_iter().take(MAX_HOST_LINES));
    let head_height = u16::try_from(lines.len()).unwrap_or(u16::MAX);
    let heights = [Constraint::Length(head_height), Constraint::Min(0), Constraint::Length(1)];
    let [head, table, last] = Layout::vertical(heights).areas(frame.area());
    let lines: Vec<_> = lines.into_iter().map(Line::from).collect();
    frame.render_widget(Paragraph::new(lines), head);
    match view.shows {
        ShownTable::Components => draw_components(frame, view, table),
        ShownTable::Links => draw_links(frame, view, table),
    }
    let style = Style::new().add_modifier(Modifier::REVERSED);
    frame.render_widget(Paragraph::new(view.last_line()).style(style), last);
}

/// Returns the columns that fit next to a name, in order.
fn choose_columns(width: u16, has_hosts: bool) -> Vec<&'static Column> {
    let mut columns: Vec<&Column> =
        COLUMNS.iter().filter(|column| has_hosts || column.cell != HOST_CELL).collect();
    let needed = |columns: &[&Column]| {
        columns.iter().map(|column| column.width + 1).sum::<u16>() + MIN_NAME_WIDTH
    };
    while needed(&columns) > width && !columns.is_empty() {
        let ranks = columns.iter().map(|column| column.rank);
        let Some(least) = ranks.max() else { break };
        columns.retain(|column| column.rank != least);
    }
    columns
}

fn draw_components(frame: &mut Frame<'_>, view: &TopView, area: Rect) {
    let columns = choose_columns(area.width, view.snapshot.has_several_hosts());
    let heading = |cell: usize| match cell {
        0 => SortKey::Name.heading(),
        STATE_CELL => "STATE",
        // The cells are those of `SortKey::ALL`, with the state after the name.
        cell => SortKey::ALL[cell - 1].heading(),
    };
    let is_sorted = |cell: usize| heading(cell) == view.sort.heading();
    let head = std::iter::once(0).chain(columns.iter().map(|column| column.cell)).map(|cell| {
        let style = if is_sorted(cell) { Style::new().fg(Color::Cyan) } else { Style::new() };
        align(cell, heading(cell).into()).style(style)
    });
    let rows = view.rows();
    let lines = rows.iter().map(|row| {
        let cells = row.format_cells();
        let shown = std::iter::once(0).chain(columns.iter().map(|column| column.cell));
        let shown = shown.map(|cell| align(cell, cells[cell].clone()));
        Row::new(shown.collect::<Vec<_>>()).style(style_of(row))
    });
    let widths = std::iter::once(Constraint::Min(MIN_NAME_WIDTH))
        .chain(columns.iter().map(|column| Constraint::Length(column.width)));
    let table = Table::new(lines, widths)
        .header(Row::new(head).style(Style::new().add_modifier(Modifier::BOLD)))
        .row_highlight_style(Style::new().add_modifier(Modifier::REVERSED));
    let mut state = TableState::new().with_selected(view.selected());
    frame.render_stateful_widget(table, area, &mut state);
}

/// Names and states are at the left, numbers at the right.
fn align(cell: usize, text: String) -> Cell<'static> {
    let line = Line::from(text);
    Cell::from(match cell {
        0 | STATE_CELL | HOST_CELL => line,
        _ => line.right_aligned(),
    })
}

fn style_of(row: &ProcessRow) -> Style {
    let color = match row.state.as_str() {
        "failed" | "given up" => Color::Red,
        "suspected" | "starting" | "stopped" | CUT_OFF => Color::Yellow,
        _ if row.losses > 0 => Color::Yellow,
        _ => Color::Reset,
    };
    Style::new().fg(color)
}

fn draw_links(frame: &mut Frame<'_>, view: &TopView, area: Rect) {
    let links = view.links();
    let right = |text: String| Cell::from(Line::from(text).right_aligned());
    let lines = links.iter().skip(view.first_link).map(|link| {
        let state = match (link.connected, link.paused) {
            (false, _) => "down",
            (true, true) => "paused",
            (true, false) => "up",
        };
        let rate = link.rate_hz.map_or("-".into(), |rate_hz| format!("{rate_hz:.1}"));
        let losses = link.dropped + link.lost;
        let style = match losses > 0 || !link.connected {
            true => Style::new().fg(Color::Yellow),
            false => Style::new(),
        };
        Row::new([
            Cell::from(link.from.clone()),
            Cell::from(link.to.clone()),
            right(rate),
            right(losses.to_string()),
            Cell::from(state),
        ])
        .style(style)
    });
    let widths = [
        Constraint::Fill(1),
        Constraint::Fill(1),
        Constraint::Length(8),
        Constraint::Length(8),
        Constraint::Length(6),
    ];
    let head = ["FROM", "TO"].map(Cell::from).into_iter();
    let head = head.chain(["MSG/s", "LOST"].map(|text| right(text.into()))).chain(["STATE".into()]);
    let head = Row::new(head).style(Style::new().add_modifier(Modifier::BOLD));
    frame.render_widget(Table::new(lines, widths).header(head), area);
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

    use armor_inspect::run_control::HostLink;

    use super::super::snapshot::tests::{report, row, snapshot};
    use super::*;

    fn drawn(view: &TopView, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
        terminal.draw(|frame| draw(frame, view)).expect("it draws");
        let buffer = terminal.backend().buffer().clone();
        let line = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        (0..height).map(|y| line(y).trim_end().to_owned()).collect()
    }

    fn view() -> TopView {
        let mut view = TopView::default();
        view.set_snapshot(snapshot());
        view
    }

    #[test]
    fn a_terminal_of_eighty_columns_shows_every_column_but_the_host() {
        let lines = drawn(&view(), 80, 24);
        assert_eq!(lines[0], "probes: 3 processes, 0 links, cpu 23.2 %, memory 37.0 MB, lost 13");
        assert_eq!(lines[1], "mission work: playing, 1 min 15 s; marked: working");
        let expected =
            "NAME         STATE      CPU %   MEMORY  THR  EXEC/s   MSG/s OUTPUT/s   LOST  RST";
        assert_eq!(lines[2], expected);
        let expected =
            "watcher      active      20.2  12.3 MB    5    50.0    50.0  50.8 kB      4    0";
        assert_eq!(lines[3], expected);
        assert!(lines[23].starts_with("q quit  s sort: CPU %"), "{}", lines[23]);
    }

    #[test]
    fn a_narrow_or_low_terminal_shows_what_matters_most() {
        let lines = drawn(&view(), 40, 6);
        assert!(lines[2].contains("CPU %") && !lines[2].contains("RST"), "{lines:#?}");
        for (width, height) in [(1, 1), (5, 2), (12, 3), (300, 100)] {
            drawn(&view(), width, height);
        }
    }

    #[test]
    fn the_selected_row_is_in_sight_and_a_host_is_shown_if_there_are_several() {
        let mut view = view();
        let many = (0..100).map(|number| row(&format!("part-{number:03}"), 1.0, 0));
        view.snapshot.components.extend(many);
        view.snapshot.components[0].host = "arm".into();
        view.handle_key(KeyEvent::new(KeyCode::End, KeyModifiers::NONE));
        let lines = drawn(&view, 100, 24);
        assert!(lines[2].ends_with("HOST"), "{}", lines[2]);
        assert!(lines[22].starts_with("part-099"), "{lines:#?}");
    }

    #[test]
    fn a_host_that_is_cut_off_has_a_line_and_its_components_are_marked() {
        let mut view = view();
        view.snapshot.hosts = vec![report("arm", HostLink::CutOff)];
        (view.snapshot.components[0].host, view.snapshot.components[0].state) =
            ("arm".into(), CUT_OFF.into());
        let lines = drawn(&view, 100, 24);
        assert_eq!(lines[2], "host arm: cut off for 3.0 s (it has fallen silent)");
        assert!(lines[4].contains("cut off") && lines[4].ends_with("arm"), "{lines:#?}");
    }

    #[test]
    fn links_are_listed_from_the_one_that_is_scrolled_to() {
        let mut view = view();
        let link = |number: u64| armor_inspect::ObservedLink {
            from: format!("north.out{number}"),
            to: "watcher.a".into(),
            type_name: "Numbered".into(),
            keep: "latest".into(),
            transport: "unix".into(),
            connected: number != 1,
            paused: false,
            sent: 10,
            dropped: number,
            skipped: 0,
            history_dropped: 0,
            lost: 1,
            queued: 0,
            waiting: 0,
            received: 9,
            rate_hz: Some(50.0),
            problem: String::new(),
        };
        view.snapshot.links = (0..5).map(link).collect();
        for code in [KeyCode::Char('l'), KeyCode::Down] {
            view.handle_key(KeyEvent::new(code, KeyModifiers::NONE));
        }
        let lines = drawn(&view, 60, 10);
        assert!(lines[2].starts_with("FROM"), "{lines:#?}");
        assert!(lines[3].starts_with("north.out1") && lines[3].ends_with("down"), "{lines:#?}");
        view.filter = "out3".into();
        view.first_link = 0;
        assert_eq!(view.links().len(), 1);
    }
}
