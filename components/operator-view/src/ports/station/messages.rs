//! What the screen of a run hands over.

use super::*;

impl Station {
    pub(super) fn handle_message(&self, message: ToWindow) {
        let now = self.now();
        match message {
            ToWindow::Hello { .. } => {}
            ToWindow::Settings {
                speed_mps,
                turn_radps,
                tolerance_m,
                robot_radius_m,
                laser,
                no_laser,
                buttons,
                is_light,
            } => {
                let mut console = self.console.lock();
                console.orders.limits = OrderLimits { speed_mps, turn_radps, tolerance_m };
                console.robot_radius_m = robot_radius_m;
                console.scene.robot_from_laser = match laser[..] {
                    [x_m, y_m, yaw_rad] => LaserPlace::Known(Pose2::new(x_m, y_m, yaw_rad)),
                    _ => LaserPlace::Unknown(no_laser),
                };
                console.buttons = buttons;
                console.is_light |= is_light;
            }
            ToWindow::Data { input, instance, sequence, stamp_s, bytes } => {
                let Some(input) = all_inputs().find(|known| known.id == input) else { return };
                let update = input.read_bytes(&bytes);
                let number = SequenceNumber { instance, sequence };
                let mut console = self.console.lock();
                let outcome = update.and_then(|update| update(&mut console));
                console.record_arrival(input.id, now, stamp_s, number, outcome);
            }
            ToWindow::Tick { system_s } => {
                self.system_time.store(system_s.to_bits(), Ordering::Relaxed);
                self.report_orders(now);
            }
            ToWindow::Sent { output, to } => {
                let to = usize::try_from(to).unwrap_or(usize::MAX);
                self.console.lock().record_delivery(&output, to);
            }
            ToWindow::StopState { is_on, to } => {
                let to = usize::try_from(to).unwrap_or(usize::MAX);
                self.console.lock().record_stop(is_on, to, now);
            }
            ToWindow::Mission {
                name,
                stage,
                why,
                now_at_s,
                is_running,
                paused_by,
                frozen,
                places,
                last_cause,
                questions,
            } => {
                let questions = questions.into_iter().map(|question| MissionQuestion {
                    transition: question.transition,
                    answer_by_at_s: question.answer_by_at_s,
                    unanswered: question.unanswered,
                });
                let questions = questions.collect();
                let received_s = now.host_s;
                let mission = MissionState {
                    name,
                    stage,
                    why,
                    now_at_s,
                    is_running,
                    paused_by,
                    frozen,
                    places,
                    last_cause,
                    questions,
                    received_s,
                };
                self.console.lock().set_mission(mission, now);
            }
            ToWindow::Hosts { hosts } => {
                self.console.lock().readings.store(HostsReading::of_shown(hosts));
            }
            ToWindow::Links { links } => {
                self.console.lock().readings.store(LinksReading::of_reports(links));
            }
            ToWindow::Answered { order, is_accepted, text } => {
                self.console.lock().record_answer(&order, is_accepted, &text, now);
            }
        }
    }
}
