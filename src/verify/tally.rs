//! What one integrator's passes add up to, class by class, and how rare its finds are.

use std::sync::OnceLock;

use super::{Class, rare::Sizes};
use crate::{
    film::{Crop, Film, FixedPoint, Half, Image},
    integrator::Integrator,
    math::{Rgb, luminance},
    path::{JoinedPath, is_covered, relative_deposit},
    render::Collector,
    sampling::Filter,
    scene::{Scene, camera::Sensor},
    statistics::{REGIONS, Regions, TILES, tile_of},
};

/// Which of the compared integrators cover a path: bit i for the i-th.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Covering(pub u8);

impl Covering {
    /// How many integrators can be compared at most.
    pub const MOST: usize = 8;

    /// The set of these.
    pub fn of(members: &[usize]) -> Self {
        Self(members.iter().fold(0, |set, i| set | 1 << i))
    }

    /// Whether all of `other` are in it.
    pub fn holds(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// The paths of a class that the same integrators cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Group {
    /// The class.
    pub class: Class,
    /// Who covers them.
    pub covering: Covering,
}

/// The sums of one pass: groups in order, with the means of their image.
pub type Pass = Vec<(Group, Regions)>;

/// What is the same for all passes: the image, the integrators and the unit of deposits' sizes.
pub struct Setting {
    pub(super) integrators: Vec<Integrator>,
    sensor: Sensor,
    scale: FixedPoint,
    /// The brightest light's radiance.
    pub(super) unit: f64,
}

impl Setting {
    pub(super) fn new(scene: &Scene, integrators: Vec<Integrator>) -> Self {
        let peak = f64::from(scene.lights().peak_radiance());
        let unit = if peak.is_normal() { peak } else { 1.0 };
        let scale = FixedPoint::for_radiance(scene.lights().typical_radiance());
        Self { integrators, sensor: scene.camera.sensor(), scale, unit }
    }

    /// What the sum of a tile is multiplied with to be a mean of [`Regions`].
    pub(super) fn per_tile(&self) -> f64 {
        (TILES * TILES) as f64 / f64::from(self.sensor.pixels())
    }
}

/// The mean images of one integrator: one film for each set of integrators that cover a path.
pub struct Films([OnceLock<Film>; 1 << Covering::MOST]);

impl Films {
    pub(super) fn new() -> Self {
        Self([const { OnceLock::new() }; 1 << Covering::MOST])
    }

    /// The mean image after `passes` passes, of the paths that all of `who` cover.
    pub(super) fn image(&self, who: Covering, sensor: Sensor, passes: usize) -> Image {
        let black = vec![Rgb::ZERO; sensor.pixels() as usize];
        let mut sum = Image { width: sensor.width, height: sensor.height, pixels: black };
        for (set, film) in self.0.iter().enumerate() {
            let Some(film) = film.get().filter(|_| Covering(set as u8).holds(who)) else { continue };
            let image = film.image(passes.max(1) as u32);
            sum.pixels.iter_mut().zip(image.pixels).for_each(|(s, p)| *s += p);
        }
        sum
    }

    /// Deposits that the films could not hold.
    pub(super) fn faults(&self) -> u64 {
        self.0.iter().filter_map(OnceLock::get).map(|film| film.errors().total()).sum()
    }
}

/// Adds up the paths of one task of a pass.
pub(super) struct Tally<'a> {
    setting: &'a Setting,
    own: usize,
    /// None for what is in no image.
    films: Option<&'a Films>,
    half: Half,
    groups: Pass,
    sizes: Option<Sizes>,
}

/// Whether a pass looks at how large the finds of all integrators would be, which costs more than the sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    Sums,
    Sizes,
}

impl<'a> Tally<'a> {
    pub(super) fn new(setting: &'a Setting, own: usize, films: Option<&'a Films>, half: Half, look: Look) -> Self {
        let sizes = (look == Look::Sizes).then(|| Sizes::new(setting.integrators.len()));
        Self { setting, own, films, half, groups: Pass::new(), sizes }
    }

    /// The sums of all tasks, as means of the image, and the sizes of the finds if they were looked at.
    pub(super) fn sum(tallies: Vec<Self>) -> (Pass, Option<Sizes>) {
        let mut pass = Pass::new();
        let mut sizes: Option<Sizes> = None;
        let (mut per_tile, mut per_image) = (0.0, 0.0);
        for tally in tallies {
            per_tile = tally.setting.per_tile();
            per_image = per_tile / (TILES * TILES) as f64;
            for (group, part) in tally.groups {
                let sum = regions_of(&mut pass, group);
                sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
            }
            match (&mut sizes, tally.sizes) {
                (Some(sum), Some(part)) => sum.add(&part),
                (none, part) => *none = part,
            }
        }
        for (_, regions) in &mut pass {
            let (channels, tiles) = regions.split_at_mut(3);
            channels.iter_mut().for_each(|x| *x *= per_image);
            tiles.iter_mut().for_each(|x| *x *= per_tile);
        }
        pass.sort_by_key(|(group, _)| *group);
        (pass, sizes)
    }
}

/// The sums of `group`; there are few groups, and the one that is looked for often is the last one's.
fn regions_of(pass: &mut Pass, group: Group) -> &mut Regions {
    let place = pass.iter().position(|(known, _)| *known == group).unwrap_or_else(|| {
        pass.push((group, vec![0.0; REGIONS]));
        pass.len() - 1
    });
    &mut pass[place].1
}

impl Collector for Tally<'_> {
    fn collect(&mut self, path: &JoinedPath, value: Rgb) {
        let Setting { integrators, sensor, scale, unit } = self.setting;
        let (x, y) = (path.raster().0.x.floor(), path.raster().0.y.floor());
        let inside = x >= 0.0 && y >= 0.0 && x < sensor.width as f32 && y < sensor.height as f32;
        if !inside {
            return;
        }
        let covers = |i: &usize| *i == self.own || is_covered(path, integrators[*i].techniques());
        let covering = (0..integrators.len()).filter(covers).fold(Covering(0), |set, i| Covering(set.0 | 1 << i));
        let class = Class::of(path);
        if let Some(Films(films)) = self.films {
            let film = || Film::new(*sensor, Crop::full(*sensor), Filter::Box, *scale);
            films[usize::from(covering.0)].get_or_init(film).deposit(path.raster(), value, self.half);
        }

        let tile = tile_of(x as usize, y as usize, sensor.width as usize, sensor.height as usize);
        let mass = f64::from(luminance(value));
        let sums = regions_of(&mut self.groups, Group { class, covering });
        sums[tile] += mass;
        sums[..3].iter_mut().zip(value.to_array()).for_each(|(s, v)| *s += f64::from(v));

        let Some(sizes) = &mut self.sizes else { return };
        let own = integrators[self.own].techniques();
        // Of a dispersed path channels may be negative: its size is what counts.
        let contribution = luminance(path.contribution()).abs();
        let single = f64::from(contribution * path.survival() / own.samples(path.technique()));
        for (i, other) in integrators.iter().enumerate() {
            if i != self.own && covering.holds(Covering::of(&[i])) {
                let relative = relative_deposit(path, path.technique(), own, other.techniques(), other.heuristic());
                sizes.count(class, i, tile - 3, single * relative / unit, mass.abs());
            }
        }
    }
}
