//! How next-event estimation chooses among the lights, and with which probability.

use super::{
    LightChoice, LightId, Lights,
    tree::{LightBounds, LightTree},
};
use crate::{
    sampling::{Discrete, PdfArea},
    scene::{geometry::Geometry, point::Point},
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
    /// The probability of all of the tree's lights by kind and power.
    share: f32,
    /// The lights that are not in the tree, by kind and power.
    others: Discrete,
}

/// The part of the tree's choice that goes by kind and power: what the bounds hide from the tree keeps a probability.
const DESPITE_TREE: f32 = 1.0 / 64.0;

impl Lights {
    /// Makes next-event estimation choose another way.
    pub fn choose_by(&mut self, choice: LightChoice, geometry: &Geometry) {
        self.next_event = match choice {
            LightChoice::All => NextEvent::All,
            LightChoice::Uniform => {
                let emits = |i| if self.emits(LightId::new(i)) { 1.0 } else { 0.0 };
                NextEvent::Uniform(Discrete::new(&(0..self.lights.len() as u32).map(emits).collect::<Vec<_>>()))
            }
            LightChoice::Power => NextEvent::Power,
            LightChoice::Tree => {
                let placed = (0..).map(LightId::new).zip(&self.lights).filter(|(id, _)| self.emits(*id));
                let bounded = placed.filter_map(|(id, l)| Some((id, LightBounds::of(l, geometry, l.brightness())?)));
                let bounded: Vec<_> = bounded.collect();
                let mut others: Vec<_> =
                    (0..self.lights.len()).map(|i| self.choice_of(LightId::new(i as u32))).collect();
                let taken = bounded.iter().map(|(id, _)| f64::from(std::mem::take(&mut others[id.index()])));
                let share = (taken.sum::<f64>() as f32).min(1.0);
                match LightTree::new(bounded, self.lights.len()) {
                    Some(tree) => NextEvent::Tree(Box::new(ByTree { tree, share, others: Discrete::new(&others) })),
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

    /// Whether the light emits any power: others are never chosen.
    pub(super) fn emits(&self, id: LightId) -> bool {
        self.choice_of(id) > 0.0
    }

    /// The probability of the light by kind and power.
    pub(super) fn choice_of(&self, id: LightId) -> f32 {
        if self.is_empty() { 0.0 } else { self.choice.probability(id.index()) }
    }

    /// Chooses a light by every rule but power, with its probability. Out of line: scenes with two lights would pay for it in the size of
    /// the core.
    #[inline(never)]
    pub(super) fn choose_at(&self, from: &Point, u: f32, nth: u32) -> Option<(LightId, f32)> {
        let by = match &self.next_event {
            NextEvent::All => return Some((LightId::new(nth), 1.0)).filter(|(id, _)| self.emits(*id)),
            NextEvent::Uniform(lights) => {
                return (!lights.is_empty()).then(|| lights.sample(u)).map(|(i, p)| (LightId::new(i as u32), p));
            }
            NextEvent::Power => return self.choose(u).map(|id| (id, self.choice_of(id))),
            NextEvent::Tree(by) => by,
        };
        let by_tree = (1.0 - DESPITE_TREE) * by.share;
        let below_one = |u: f32| u.clamp(0.0, 1.0_f32.next_down());
        let id = if u < by_tree {
            let (id, p) = by.tree.sample(from, below_one(u / by_tree));
            return Some((id, self.despite_tree(id, by.share * p)));
        } else if u < by_tree + DESPITE_TREE || by.others.is_empty() {
            self.choose(below_one((u - by_tree) / DESPITE_TREE))?
        } else {
            let begin = by_tree + DESPITE_TREE;
            LightId::new(by.others.sample(below_one((u - begin) / (1.0 - begin))).0 as u32)
        };
        Some((id, self.by_tree(by, from, id)))
    }

    /// The probability of a light by the tree's rule.
    fn by_tree(&self, by: &ByTree, from: &Point, id: LightId) -> f32 {
        let most = by.tree.probability(from, id).map_or_else(|| self.choice_of(id), |p| by.share * p);
        self.despite_tree(id, most)
    }

    fn despite_tree(&self, id: LightId, by_tree: f32) -> f32 {
        DESPITE_TREE * self.choice_of(id) + (1.0 - DESPITE_TREE) * by_tree
    }

    #[inline(never)]
    pub(super) fn pdf_chosen_at(&self, point: &Point, from: &Point) -> PdfArea {
        let Some(id) = point.light.filter(|id| self.emits(*id)) else { return PdfArea::ZERO };
        let choice = match &self.next_event {
            NextEvent::All => 1.0,
            NextEvent::Uniform(lights) => lights.probability(id.index()),
            NextEvent::Tree(by) => self.by_tree(by, from, id),
            NextEvent::Power => self.choice_of(id),
        };
        self.pdf_on(id, point, choice)
    }
}
