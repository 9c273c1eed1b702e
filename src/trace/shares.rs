//! Who could have found a path, and how often.

use std::f64::consts::PI;

use crate::{
    integrator::{Integrator, IntegratorKind},
    lanes::One,
    path::{Path, Strategy, Technique, Techniques},
    scene::bsdf::Directions,
    scene::camera::Raster,
};

/// A technique beside a path that something has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Which.
    pub technique: Technique,
    /// p: the density with which one of its samples is this path, with respect to the product area measure. Of a merge
    /// it has the factor πr², so that F/(n p) is its estimate as well. Zero if it cannot find the path.
    pub pdf: f64,
    /// r of a merge in that pass, of another integrator's if this one has none; m.
    pub radius: Option<f32>,
    /// n: its samples in a pass, zero if the integrator does not have it.
    pub count: f64,
    /// v: by how much less noise its samples have than independent ones, as far as weights know; they compare v n p.
    pub variance_factor: f64,
    /// w: its weight by the integrator's rule.
    pub weight: f64,
    /// The other integrators that have it, if this one does not.
    pub elsewhere: Vec<IntegratorKind>,
    /// n in the first of them.
    pub count_elsewhere: f64,
}

impl Share {
    /// n p: how many of the technique's samples of a pass are this path, per unit of the measure.
    pub fn expected(&self) -> f64 {
        self.count * self.pdf
    }

    /// The same by whichever integrator has the technique.
    pub fn expected_anywhere(&self) -> f64 {
        if self.count > 0.0 { self.expected() } else { self.count_elsewhere * self.pdf }
    }
}

/// The tables of a pass.
pub(super) struct Tables {
    /// Of the integrator that is traced.
    pub own: Integrator,
    /// Of those that a person could choose.
    pub elsewhere: Vec<(IntegratorKind, Integrator)>,
    /// Where the path arrives on the image.
    pub raster: Raster,
}

impl Tables {
    /// The shares of all techniques in a path that `found` has found.
    pub fn shares(&self, path: &Path, found: Technique) -> Vec<Share> {
        if found == Technique::Area {
            // It shares with nobody.
            let own = Share { pdf: path.pdf_area(), weight: 1.0, ..self.share(path, found) };
            return std::iter::once(own).chain(self.strategies(path)).collect();
        }
        self.strategies(path).collect()
    }

    fn strategies(&self, path: &Path) -> impl Iterator<Item = Share> {
        let vertices = path.edges() as u32 + 1;
        let strategies = move || (0..vertices).map(move |s| Strategy { s, t: vertices - s });
        // A merge is at p_{t−1}, which is neither end.
        let merges = strategies().filter(|x| x.s >= 1 && x.t >= 2).map(Technique::Merged);
        let all = strategies().map(Technique::Bidirectional).chain(merges);
        all.map(move |technique| self.share(path, technique))
    }

    fn share(&self, path: &Path, technique: Technique) -> Share {
        let table = self.own.techniques();
        // A table may have merges elsewhere, and not of this path.
        let has_it = |table: &Techniques| match technique {
            Technique::Merged(strategy) => path.density_of_merging(strategy, table) > 0.0,
            _ => true,
        };
        let count = if has_it(table) { f64::from(table.samples(technique)) } else { 0.0 };
        let has = |(_, other): &&(IntegratorKind, Integrator)| {
            other.techniques().samples(technique) > 0.0 && has_it(other.techniques())
        };
        let elsewhere: Vec<_> = self.elsewhere.iter().filter(|_| count == 0.0).filter(has).collect();
        let count_elsewhere = elsewhere.first().map_or(0.0, |(_, x)| f64::from(x.techniques().samples(technique)));
        let tables = std::iter::once(&self.own).chain(elsewhere.iter().map(|(_, x)| x)).map(|x| x.techniques());
        let merging = tables.filter(|table| has_it(table)).filter_map(|x| Some((x, x.radius()?))).next();
        let merging = merging.filter(|_| matches!(technique, Technique::Merged(_)));
        let radius = merging.map(|(_, radius)| radius);
        let pdf = match technique {
            Technique::Bidirectional(strategy) if count > 0.0 => path.pdf_by(table.directions(), strategy),
            Technique::Bidirectional(strategy) => path.pdf_by(Directions::Bsdf, strategy),
            Technique::Merged(strategy) => {
                merging.map_or(0.0, |(table, r)| PI * f64::from(r).powi(2) * path.density_of_merging(strategy, table))
            }
            Technique::Area => 0.0,
        };
        let factors = table.variance_factors();
        let variance_factor = match (technique, factors) {
            (Technique::Bidirectional(x), Some(factors)) => factors.of(One, x, self.raster.0.to_array()).into(),
            _ => 1.0,
        };
        let weighed = count > 0.0 && pdf > 0.0 && technique != Technique::Area;
        let weight = if weighed { path.mis_weight(technique, table, self.own.heuristic()) } else { 0.0 };
        let elsewhere = elsewhere.into_iter().map(|(kind, _)| *kind).collect();
        Share { technique, pdf, radius, count, variance_factor, weight, elsewhere, count_elsewhere }
    }
}
