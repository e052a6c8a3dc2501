//! The window, on a thread of its own: shows the console whenever it has changed, and sends
//! commands immediately, without waiting for the component's next call.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use eframe::egui::{Context, Ui, ViewportBuilder, ViewportCommand};
use parking_lot::Mutex;
use winit::platform::wayland::EventLoopBuilderExtWayland;
use winit::platform::x11::EventLoopBuilderExtX11;

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::{OperatorOrder, RobotCommand};
use crate::screen::{Screen, SidePanel, apply_theme};

/// Data are shown at most this often.
const FRAME: Duration = Duration::from_millis(33);
/// How long a window may take to close.
const CLOSE_LIMIT: Duration = Duration::from_secs(1);

/// Sends a command; see [`WindowHooks::send`].
pub(crate) type CommandSender = Box<dyn Fn(&RobotCommand) -> Option<usize> + Send>;

/// What the window needs of the component.
pub(crate) struct WindowHooks {
    /// What is shown.
    pub(crate) console: Arc<Mutex<Console>>,
    /// Sends a command to the robot, and returns the number of links that accepted it; `None` if it
    /// is not known yet.
    pub(crate) send: CommandSender,
    /// The panels next to the map.
    pub(crate) panels: Vec<Box<dyn SidePanel>>,
    /// Returns the time of both clocks.
    pub(crate) now: Box<dyn Fn() -> ClockTimes + Send>,
    /// Called once when the window has ended.
    pub(crate) gone: Box<dyn FnOnce(WindowEnd) + Send>,
}

/// Why there is no window.
pub(crate) enum WindowEnd {
    /// The operator closed it.
    Closed,
    /// It could not be opened, or kept, and why.
    Failed(String),
    /// Its code, or that of the window system's library, panicked.
    Panicked(Box<dyn Any + Send>),
}

impl WindowHooks {
    fn with_console<R>(
        &self,
        act: impl FnOnce(&mut Console, ClockTimes) -> (R, Vec<RobotCommand>),
    ) -> R {
        let now = (self.now)();
        let lock = || self.console.lock();
        let (result, commands) = act(&mut lock(), now);
        for command in commands {
            if let Some(to) = (self.send)(&command) {
                lock().record_sent(&command, to, now);
            }
        }
        result
    }
}

/// An open window.
pub(crate) struct ViewWindow {
    context: Arc<OnceLock<Context>>,
    is_closed: Receiver<()>,
}

impl ViewWindow {
    /// Opens a window of `size` points.
    ///
    /// # Errors
    /// If there can be no more threads.
    pub(crate) fn open(title: String, size: [f32; 2], hands: WindowHooks) -> std::io::Result<Self> {
        let context = Arc::new(OnceLock::new());
        let (tell, is_closed) = channel();
        let shared = Arc::clone(&context);
        std::thread::Builder::new()
            .name("window".into())
            .spawn(move || run_window(&title, size, hands, shared, &tell))?;
        Ok(Self { context, is_closed })
    }

    /// Requests a frame, because the console has changed.
    pub(crate) fn request_frame(&self) {
        if let Some(context) = self.context.get() {
            context.request_repaint_after(FRAME);
        }
    }

    /// Waits until the window has closed; `is_over` of the console must be set.
    pub(crate) fn close(&self) {
        if let Some(context) = self.context.get() {
            context.request_repaint();
            // A window that hangs ends with the process.
            let _ = self.is_closed.recv_timeout(CLOSE_LIMIT);
        }
    }
}

fn run_window(
    title: &str,
    size: [f32; 2],
    mut hands: WindowHooks,
    context: Arc<OnceLock<Context>>,
    tell: &Sender<()>,
) {
    let viewport = ViewportBuilder::default()
        .with_app_id("armor-operator-view")
        .with_title(title)
        .with_inner_size(size)
        .with_min_inner_size([560.0, 360.0]);
    let options = eframe::NativeOptions {
        viewport,
        // The component has the main thread.
        event_loop_builder: Some(Box::new(|builder| {
            EventLoopBuilderExtX11::with_any_thread(builder, true);
            EventLoopBuilderExtWayland::with_any_thread(builder, true);
        })),
        ..Default::default()
    };
    let panels = std::mem::take(&mut hands.panels);
    let hands = Arc::new(Mutex::new(Some(hands)));
    let lent = Arc::clone(&hands);
    let create = move |creation: &eframe::CreationContext<'_>| {
        apply_theme(&creation.egui_ctx);
        let _ = context.set(creation.egui_ctx.clone());
        Ok(Box::new(App { hands: lent, screen: Screen::new(panels) }) as Box<dyn eframe::App>)
    };
    let show = || eframe::run_native("armor-operator-view", options, Box::new(create));
    let outcome = catch_unwind(AssertUnwindSafe(show));
    let hands = hands.lock().take();
    if let Some(hands) = hands {
        // Without a window no key or stick is held.
        hands.with_console(|console, now| ((), console.handle_order(OperatorOrder::LetGo, now)));
        (hands.gone)(match outcome {
            Ok(Ok(())) => WindowEnd::Closed,
            Ok(Err(error)) => WindowEnd::Failed(format!(
                "the window cannot be opened: {error}; it needs a display and OpenGL (libGL, \
                 libEGL): set `window` to false to run without one"
            )),
            Err(panic) => WindowEnd::Panicked(panic),
        });
    }
    let _ = tell.send(());
}

struct App {
    hands: Arc<Mutex<Option<WindowHooks>>>,
    screen: Screen,
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let hands = self.hands.lock();
        let Some(hands) = hands.as_ref() else { return };
        let screen = &mut self.screen;
        let is_over = hands.with_console(|console, now| {
            let commands = screen.show_frame(ui, console, now);
            (console.is_over, commands)
        });
        if is_over {
            ui.ctx().send_viewport_cmd(ViewportCommand::Close);
        }
    }
}
