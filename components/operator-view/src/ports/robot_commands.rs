//! Commands to the robot, as messages on the outputs.

use armor_convert::build_stamped_pose;
use armor_sdk::prelude::*;

use crate::orders::RobotCommand;

/// Publishes a command, and returns the number of links that accepted it.
///
/// # Errors
/// If it cannot be published.
pub(super) fn send_command(armor: &Armor, command: &RobotCommand) -> Result<usize, Fault> {
    let sent = match command {
        RobotCommand::Goal { place, frame } => {
            armor.send_data("goal", &build_stamped_pose(armor.timestamp(), frame, *place))?
        }
        &RobotCommand::Velocity { forward_mps, turn_radps } => {
            armor.send_data("velocity", &Twist::planar(forward_mps, turn_radps))?
        }
        &RobotCommand::Stop(stop) => armor.send_data("stop", &Flag { data: stop })?,
        RobotCommand::Answer { .. } | RobotCommand::Resume => return Ok(0),
    };
    Ok(sent.to)
}
