//! A route as it is written in a file: `4,1 9.5,1 9.5,-3`, metres on the map.

use armor_grid::Point2;
use thiserror::Error;

/// Most waypoints of a route.
pub const MAX_WAYPOINTS: usize = 1000;

/// Why a text is no route.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RouteError {
    /// There is nothing in it.
    #[error("the route has no waypoint; write them as x,y with spaces between, such as `4,1 9,1`")]
    Empty,
    /// A waypoint is not two numbers.
    #[error("waypoint {number}, `{text}`, is not x,y in metres, such as `4,1.5`")]
    NotAPoint {
        /// Counted from 1.
        number: usize,
        /// What stands there.
        text: String,
    },
    /// More than can be meant.
    #[error("the route has more than {MAX_WAYPOINTS} waypoints")]
    TooLong,
}

/// Reads the waypoints of a route, in metres, in their order.
///
/// # Errors
/// [`RouteError`] naming the first waypoint that is none.
pub fn parse_route(text: &str) -> Result<Vec<Point2>, RouteError> {
    let mut route = Vec::new();
    for (index, word) in text.split_whitespace().enumerate() {
        if index == MAX_WAYPOINTS {
            return Err(RouteError::TooLong);
        }
        let point = parse_point(word).ok_or_else(|| RouteError::NotAPoint {
            number: index + 1,
            text: word.chars().take(40).collect(),
        })?;
        route.push(point);
    }
    if route.is_empty() { Err(RouteError::Empty) } else { Ok(route) }
}

fn parse_point(word: &str) -> Option<Point2> {
    let (x, y) = word.split_once(',')?;
    let metres = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite());
    Some(Point2::new(metres(x)?, metres(y)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_route_is_points_with_spaces_between() {
        let route = parse_route(" 4,1\n 9.5,-1e0 ").expect("a route");
        assert_eq!(route, [Point2::new(4.0, 1.0), Point2::new(9.5, -1.0)]);
    }

    #[test]
    fn what_is_no_route_names_the_waypoint() {
        assert_eq!(parse_route("  "), Err(RouteError::Empty));
        for (text, number) in [("4", 1), ("1,2 3,4,5", 2), ("1,2 nan,3", 2), ("1,2 3, 4", 2)] {
            match parse_route(text) {
                Err(RouteError::NotAPoint { number: found, .. }) => assert_eq!(found, number),
                other => panic!("{text}: {other:?}"),
            }
        }
        assert_eq!(parse_route(&"1,1 ".repeat(MAX_WAYPOINTS + 1)), Err(RouteError::TooLong));
    }
}
