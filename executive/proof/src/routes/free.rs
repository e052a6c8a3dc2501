//! From which places a route comes to the end of the mission by itself.

use armor_petri::PlaceId;

use super::machines::{RouteMachines, RouteMove};

impl RouteMachines<'_> {
    /// Per place, whether the route comes from there to the end of the mission by its own firings,
    /// whatever the others do: also from where another one takes it on the way.
    pub(super) fn find_free(&self) -> Vec<bool> {
        let mut is_free = vec![false; self.net.places().len()];
        for route in 0..self.places.len() {
            if self.enters_once[route] && !self.has_shared_circle(route) {
                self.find_free_of(route, &mut is_free);
            }
        }
        is_free
    }

    fn find_free_of(&self, route: usize, is_free: &mut [bool]) {
        let moves = &self.moves[route];
        for place in self.find_reachable(route) {
            is_free[place.index()] = true;
        }
        let own: Vec<_> = moves.iter().filter(|it| it.is_own && self.fires_in_time(it)).collect();
        let others: Vec<_> = moves.iter().filter(|it| !it.is_own).collect();
        loop {
            // Where no other one can take the token to a place that is not free, nor away.
            let mut stays = is_free.to_vec();
            for it in &others {
                let leads_on =
                    self.leads_to_end(it.transition) || it.to.is_some_and(|to| is_free[to.index()]);
                if let Some(from) = it.from.filter(|_| !leads_on) {
                    stays[from.index()] = false;
                }
            }
            let mut comes = vec![false; stays.len()];
            let mut has_changed = true;
            while has_changed {
                has_changed = false;
                for it in &own {
                    let Some(from) = it.from.filter(|from| stays[from.index()]) else { continue };
                    let leads_on = self.leads_to_end(it.transition)
                        || it.to.is_some_and(|to| comes[to.index()]);
                    if leads_on && !comes[from.index()] {
                        (comes[from.index()], has_changed) = (true, true);
                    }
                }
            }
            let lost: Vec<_> = self.places[route]
                .iter()
                .filter(|place| is_free[place.index()] && !comes[place.index()])
                .collect();
            if lost.is_empty() {
                return;
            }
            lost.iter().for_each(|place| is_free[place.index()] = false);
        }
    }

    /// Whether nothing else must fire before: the clocks of a route begin when its token arrives.
    fn fires_in_time(&self, it: &RouteMove) -> bool {
        let Some(from) = it.from else { return false };
        let route = self.routes[from.index()].into_iter();
        let competing = route.flat_map(|route| &self.moves[route]);
        let competing = competing.filter(|other| other.is_own && other.from == Some(from));
        let latest = competing.filter_map(|other| {
            let other = self.net.transition(other.transition);
            other.interval.latest.filter(|_| !other.gated)
        });
        let earliest = self.net.transition(it.transition).interval.earliest;
        latest.min().is_none_or(|limit| earliest <= limit)
    }

    /// The places that the token of a route comes to if the others do what they like.
    fn find_reachable(&self, route: usize) -> Vec<PlaceId> {
        let mut is_known = vec![false; self.net.places().len()];
        let mut found = Vec::new();
        let entries =
            self.moves[route].iter().filter(|it| it.from.is_none()).filter_map(|it| it.to);
        let mut open: Vec<_> = self.start(route).into_iter().chain(entries).collect();
        while let Some(place) = open.pop() {
            if std::mem::replace(&mut is_known[place.index()], true) {
                continue;
            }
            found.push(place);
            let next = self.moves[route].iter().filter(|it| it.from == Some(place));
            open.extend(next.filter_map(|it| it.to));
        }
        found
    }

    /// Whether a route can come back to where another one moves its token: then it may be kept from its
    /// end for ever.
    fn has_shared_circle(&self, route: usize) -> bool {
        let moves = &self.moves[route];
        let shared = moves.iter().filter(|it| !it.is_own);
        let mut ends = shared.filter_map(|it| Some((it.from?, it.to?)));
        ends.any(|(from, to)| {
            let mut is_known = vec![false; self.net.places().len()];
            let mut open = vec![to];
            while let Some(place) = open.pop() {
                if place == from {
                    return true;
                }
                if !std::mem::replace(&mut is_known[place.index()], true) {
                    let next = moves.iter().filter(|it| it.from == Some(place));
                    open.extend(next.filter_map(|it| it.to));
                }
            }
            false
        })
    }
}
