//! What was done, counted.

use std::collections::BTreeMap;

use crate::path::Technique;

/// What a render has done so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Samples: camera subpaths, or light subpaths where the integrator has no others.
    pub samples: u64,
    /// Rays, by what they were for.
    pub rays: Rays,
    /// Lookups of light vertices, to merge with them.
    pub lookups: Lookups,
    /// Connections that roulette ended before their ray.
    pub spared: u64,
    /// Walks that ended because N_s and N_g put a direction on different sides: light that is lost to shading normals.
    pub lost_to_sides: u64,
    /// Contributions that were not finite or negative, and so were left out, by technique.
    pub rejected: BTreeMap<Technique, u64>,
}

/// Numbers of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rays {
    /// Of walks from the camera.
    pub camera: u64,
    /// Of walks from lights.
    pub light: u64,
    /// Between two known points: of connections, and one for each sample of an alpha channel.
    pub visibility: u64,
}

/// Numbers of lookups of light vertices around camera vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lookups {
    /// Camera vertices that looked.
    pub made: u64,
    /// Light vertices that they found within the radius.
    pub found: u64,
}

impl Lookups {
    fn add(&mut self, other: Self) {
        self.made = self.made.saturating_add(other.made);
        self.found = self.found.saturating_add(other.found);
    }
}

impl Rays {
    /// All of them.
    pub fn total(self) -> u64 {
        let Self { camera, light, visibility } = self;
        camera.saturating_add(light).saturating_add(visibility)
    }

    fn add(&mut self, other: Self) {
        self.camera = self.camera.saturating_add(other.camera);
        self.light = self.light.saturating_add(other.light);
        self.visibility = self.visibility.saturating_add(other.visibility);
    }
}

impl Statistics {
    /// Adds what another part of the same render has done. (It may come from a file, which can say anything.)
    pub fn add(&mut self, other: &Self) {
        self.samples = self.samples.saturating_add(other.samples);
        self.rays.add(other.rays);
        self.lookups.add(other.lookups);
        self.spared = self.spared.saturating_add(other.spared);
        self.lost_to_sides = self.lost_to_sides.saturating_add(other.lost_to_sides);
        for (technique, count) in &other.rejected {
            let sum = self.rejected.entry(*technique).or_default();
            *sum = sum.saturating_add(*count);
        }
    }
}
