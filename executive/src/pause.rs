//! Tokens moved by hand while the mission stands still: what would be wrong afterwards is said
//! before anything is moved.

use crate::controller::Controller;
use crate::order::TokenMove;
use armor_petri::PlaceId;
use std::collections::{BTreeMap, BTreeSet};

impl Controller {
    /// Whether these tokens may be moved, all at once, and how it says so; else all that is wrong.
    pub(crate) fn judge_moves(&self, moves: &[TokenMove]) -> Result<String, String> {
        if self.ledger.pause().is_none() {
            return Err("tokens are moved only while the mission is paused: pause it first".into());
        }
        let mut wrong = Vec::new();
        let mut marking = self.ledger.state.marking().to_vec();
        let mut touched = BTreeSet::new();
        for it in moves {
            match self.move_one(it, &mut marking) {
                Ok(place) => _ = touched.insert(place),
                Err(why) => wrong.push(why),
            }
        }
        let arriving = self.arriving();
        let of = |place: PlaceId| {
            let coming = arriving.get(&place).copied().unwrap_or(0);
            u64::from(marking[place.index()]) + coming
        };
        for place in touched {
            if !self.plan.place(place).components.is_empty() && of(place) > 1 {
                let (name, tokens) = (self.plan.net().place(place), of(place));
                let on_the_way =
                    if arriving.contains_key(&place) { ", some on their way" } else { "" };
                wrong.push(format!(
                    "`{name}` would hold {tokens} tokens{on_the_way}; a place with components holds one"
                ));
            }
        }
        wrong.extend(self.plan.clashes(&|place| of(place) > 0));
        if !wrong.is_empty() {
            return Err(wrong.join("; "));
        }
        let count: u64 = moves.iter().map(|it| u64::from(it.tokens)).sum();
        let tokens = if count == 1 { "1 token is".into() } else { format!("{count} tokens are") };
        Ok(format!("{tokens} moved; what they activate starts when the mission goes on"))
    }

    /// Moves in thought; answers where to.
    pub(crate) fn move_one(&self, it: &TokenMove, marking: &mut [u32]) -> Result<PlaceId, String> {
        let find = |name: &str| {
            self.plan
                .place_named(name)
                .ok_or_else(|| format!("the mission has no place called `{name}`"))
        };
        let (from, to) = (find(&it.from)?, find(&it.to)?);
        if it.tokens == 0 || from == to {
            return Err(format!("from `{}` to `{}` nothing would move", it.from, it.to));
        }
        let there = marking[from.index()];
        marking[from.index()] = there
            .checked_sub(it.tokens)
            .ok_or_else(|| format!("`{}` holds {there} tokens, not {}", it.from, it.tokens))?;
        let sum = marking[to.index()].checked_add(it.tokens);
        marking[to.index()] =
            sum.ok_or_else(|| format!("`{}` cannot hold so many tokens", it.to))?;
        Ok(to)
    }

    /// Tokens on their way into places.
    pub(crate) fn arriving(&self) -> BTreeMap<PlaceId, u64> {
        let mut arriving = BTreeMap::new();
        for &(place, tokens) in self.ledger.firings.values().flat_map(|firing| &firing.to) {
            *arriving.entry(place).or_insert(0) += u64::from(tokens);
        }
        arriving
    }
}
