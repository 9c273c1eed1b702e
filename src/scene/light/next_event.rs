//! How next-event estimation chooses among the lights, and with which probability.

use super::{
    LightChoice, LightId, Lights,
    tree::{LightBounds, LightTree, Receiver},
};
use crate::{
    sampling::{Choice, Discrete, Part, Remainder},
    scene::geometry::Geometry,
};

/// See [`LightChoice`].
#[derive(Clone, Debug)]
pub(super) enum NextEvent {
    All,
    Uniform(Discrete),
    Power,
    Tree(Box<ByTree>),
}

/// The choice by importance among the lights with a place, and by kind and power between them and the infinite ones.
#[derive(Clone, Debug)]
pub(super) struct ByTree {
    tree: LightTree,
    /// How many of a choice's integers, from 0 on, choose by the tree: the part of its lights by kind and power, of
    /// what [`DESPITE_TREE`] leaves.
    width: u64,
    /// The lights that are not in the tree, by kind and power: for the integers behind all others.
    others: Discrete,
}

/// How many integers, behind the tree's, choose by kind and power, one in 64: what the bounds hide from the tree keeps
/// a probability. A light has at least 1/(64 N) of them, 2²⁶ for as many as have ids.
const DESPITE_TREE: u64 = 1 << 58;

impl ByTree {
    /// The integers of those lights that are not in the tree.
    fn width_of_others(&self) -> u64 {
        Choice::COUNT - DESPITE_TREE - self.width
    }
}

impl Lights {
    /// Makes next-event estimation choose another way.
    pub fn choose_by(&mut self, choice: LightChoice, geometry: &Geometry) {
        self.next_event = match choice {
            LightChoice::All => NextEvent::All,
            LightChoice::Uniform => {
                let emits = |i| f64::from(u8::from(self.emits(LightId::new(i))));
                NextEvent::Uniform(Discrete::new(&(0..self.lights.len() as u32).map(emits).collect::<Vec<_>>()))
            }
            LightChoice::Power => NextEvent::Power,
            LightChoice::Tree => {
                let placed = (0..).map(LightId::new).zip(&self.lights).filter(|(id, _)| self.emits(*id));
                let bounded = placed.filter_map(|(id, l)| Some((id, LightBounds::of(l, geometry, l.brightness())?)));
                let bounded: Vec<_> = bounded.collect();
                let by_power = |i| f64::from(self.choice_of(LightId::new(i as u32)));
                let mut others: Vec<_> = (0..self.lights.len()).map(by_power).collect();
                let taken: f64 = bounded.iter().map(|(id, _)| std::mem::take(&mut others[id.index()])).sum();
                let left: f64 = others.iter().sum();
                let most = Choice::COUNT - DESPITE_TREE;
                let width = if left > 0.0 { (most as f64 * (taken / (taken + left))) as u64 } else { most };
                match LightTree::new(bounded, self.lights.len()) {
                    Some(tree) => NextEvent::Tree(Box::new(ByTree { tree, width, others: Discrete::new(&others) })),
                    None => NextEvent::Power,
                }
            }
        };
    }

    /// The choice with the least noise in the same time: by the tree where it has something to choose from.
    pub fn suitable_choice(&self) -> LightChoice {
        let placed = |id: &LightId| self.emits(*id) && self.get(*id).has_a_place();
        let several = (0..self.lights.len() as u32).map(LightId::new).filter(placed).nth(2).is_some();
        if several { LightChoice::Tree } else { LightChoice::Power }
    }

    /// How next-event estimation chooses.
    pub fn choice(&self) -> LightChoice {
        match self.next_event {
            NextEvent::All => LightChoice::All,
            NextEvent::Uniform(_) => LightChoice::Uniform,
            NextEvent::Power => LightChoice::Power,
            NextEvent::Tree(_) => LightChoice::Tree,
        }
    }

    /// How many samples a next-event estimate has: one, or one of each light.
    #[inline(always)]
    pub fn next_event_samples(&self) -> u32 {
        if matches!(self.next_event, NextEvent::All) { self.lights.len() as u32 } else { 1 }
    }

    /// How many integers choose by the tree, if there is one.
    #[cfg(test)]
    pub fn integers_of_tree(&self) -> Option<u64> {
        match &self.next_event {
            NextEvent::Tree(by) => Some(by.width),
            _ => None,
        }
    }

    /// Whether the light emits any power: others are never chosen.
    pub(super) fn emits(&self, id: LightId) -> bool {
        self.choice_of(id) > 0.0
    }

    /// The probability of the light by kind and power.
    pub(super) fn choice_of(&self, id: LightId) -> f32 {
        if self.is_empty() { 0.0 } else { self.choice.probability(id.index()) }
    }

    /// Chooses a light by every rule but power, with its probability and what the choice has left. Out of line: scenes
    /// with two lights would pay for it in the size of the core.
    #[inline(never)]
    pub(super) fn choose_at(&self, from: &Receiver, choice: Choice, nth: u32) -> Option<(LightId, f32, Remainder)> {
        let by = match &self.next_event {
            NextEvent::All => {
                return Some((LightId::new(nth), 1.0, choice.whole())).filter(|(id, ..)| self.emits(*id));
            }
            NextEvent::Uniform(lights) => {
                let chosen = (!lights.is_empty()).then(|| lights.sample(choice));
                return chosen.map(|(i, rest)| (LightId::new(i as u32), lights.probability(i), rest));
            }
            NextEvent::Power => return self.choose(choice).map(|(id, rest)| (id, self.choice_of(id), rest)),
            NextEvent::Tree(by) => by,
        };
        let (half, rest) = choice.whole().split(by.width);
        if half == Part::First {
            let (id, rest) = by.tree.sample(from, rest);
            return Some((id, self.despite_tree(id, rest.width()), rest));
        }
        let (half, rest) = rest.split(DESPITE_TREE);
        let (id, rest) = match half {
            Part::First => self.choose(rest.rest())?,
            Part::Second => {
                let (i, rest) = by.others.sample(rest.rest());
                (LightId::new(i as u32), rest)
            }
        };
        Some((id, self.by_tree(by, from, id), rest))
    }

    /// The probability of a light by the tree's rule.
    fn by_tree(&self, by: &ByTree, from: &Receiver, id: LightId) -> f32 {
        match by.tree.width(from, id, by.width) {
            Some(width) => self.despite_tree(id, width),
            None => {
                let others = by.others.probability(id.index()) * Choice::probability(by.width_of_others());
                others + self.despite_tree(id, 0)
            }
        }
    }

    /// The probability of a light to which the tree leads by so many integers.
    #[inline(always)]
    fn despite_tree(&self, id: LightId, by_tree: u64) -> f32 {
        Choice::probability(DESPITE_TREE) * self.choice_of(id) + Choice::probability(by_tree)
    }

    /// The probability with which a light is chosen at `from` by every rule but power.
    #[inline(never)]
    pub(super) fn probability_at(&self, id: LightId, from: &Receiver) -> f32 {
        match &self.next_event {
            _ if !self.emits(id) => 0.0,
            NextEvent::All => 1.0,
            NextEvent::Uniform(lights) => lights.probability(id.index()),
            NextEvent::Tree(by) => self.by_tree(by, from, id),
            NextEvent::Power => self.choice_of(id),
        }
    }
}
