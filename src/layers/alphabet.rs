//! The alphabet of light path expressions: a byte for every event of a path.

use std::ops::BitAnd;

use crate::{
    path::{Densities, JoinedPath},
    scene::{Scene, bsdf::ScatterEvent, light::Light, point::Point},
    text::one_line,
};

/// What happens at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Letter {
    Camera,
    DiffuseReflection,
    DiffuseTransmission,
    GlossyReflection,
    GlossyTransmission,
    SpecularReflection,
    SpecularTransmission,
    Surface,
    Lamp,
    Spot,
    Sun,
    Sky,
}

/// How many letters there are.
const LETTERS: u8 = 12;

impl Letter {
    /// The lights, and what they are called.
    pub const LIGHTS: [(Self, &str); 5] = [
        (Self::Surface, "surface"),
        (Self::Lamp, "point"),
        (Self::Spot, "spot"),
        (Self::Sun, "sun"),
        (Self::Sky, "sky"),
    ];

    pub(super) fn of_event(event: ScatterEvent, transmits: bool) -> Self {
        match (event, transmits) {
            (ScatterEvent::Diffuse, false) => Self::DiffuseReflection,
            (ScatterEvent::Diffuse, true) => Self::DiffuseTransmission,
            (ScatterEvent::Glossy, false) => Self::GlossyReflection,
            (ScatterEvent::Glossy, true) => Self::GlossyTransmission,
            (ScatterEvent::Specular, false) => Self::SpecularReflection,
            (ScatterEvent::Specular, true) => Self::SpecularTransmission,
        }
    }

    /// What it is called, if it is a light's.
    fn name(self) -> &'static str {
        Self::LIGHTS.into_iter().find(|(letter, _)| *letter == self).map_or("light", |(_, name)| name)
    }

    pub(super) fn of_light(light: &Light) -> Self {
        match light {
            Light::Area { .. } => Self::Surface,
            Light::Point { .. } | Light::Goniometric(_) => Self::Lamp,
            Light::Spot(_) => Self::Spot,
            Light::Directional { .. } => Self::Sun,
            Light::Environment { .. } | Light::EnvironmentMap(_) => Self::Sky,
        }
    }
}

/// What expressions call the kind of a light: `surface`, `point`, `spot`, `sun` or `sky`.
pub fn kind_of_light(light: &Light) -> &'static str {
    Letter::of_light(light).name()
}

/// A set of letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Letters(u16);

impl Letters {
    pub const ALL: Self = Self((1 << LETTERS) - 1);

    pub fn just(letter: Letter) -> Self {
        Self(1 << letter as u8)
    }

    fn among(letters: &[Letter]) -> Self {
        Self(letters.iter().fold(0, |set, letter| set | Self::just(*letter).0))
    }

    /// What a letter of an expression stands for.
    pub fn of_letter(letter: char) -> Option<Self> {
        use Letter::{
            Camera, DiffuseReflection, DiffuseTransmission, GlossyReflection, GlossyTransmission, Lamp, Sky,
            SpecularReflection, SpecularTransmission, Spot, Sun, Surface,
        };
        Some(Self::among(match letter {
            '.' => return Some(Self::ALL),
            'C' => &[Camera],
            'D' => &[DiffuseReflection, DiffuseTransmission],
            'G' => &[GlossyReflection, GlossyTransmission],
            'S' => &[SpecularReflection, SpecularTransmission],
            'R' => &[DiffuseReflection, GlossyReflection, SpecularReflection],
            'T' => &[DiffuseTransmission, GlossyTransmission, SpecularTransmission],
            'L' => &[Surface, Lamp, Spot, Sun, Sky],
            _ => return None,
        }))
    }
}

impl BitAnd for Letters {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

/// The names of materials that expressions ask for, each with the materials that have it.
#[derive(Clone, Debug, Default)]
pub struct Tags {
    names: Vec<String>,
    /// For each material one more than the number of its name, or zero.
    of_material: Vec<u8>,
}

/// Why names cannot be told apart.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TagError {
    /// No material is called so.
    #[error("no material of the scene is called '{0}'; 'pathspace info' lists them")]
    Unknown(String),
    /// There are more names than symbols.
    #[error("expressions name more than {} materials", Tags::MOST)]
    TooMany,
}

impl Tags {
    /// So many names fit into a byte beside the letters.
    const MOST: usize = 20;

    /// Looks `names` up among the scene's materials.
    ///
    /// # Errors
    /// If no material has one of the names, or there are more than twenty.
    pub fn new<'a>(names: impl IntoIterator<Item = &'a str>, scene: &Scene) -> Result<Self, TagError> {
        let mut tags = Self { names: Vec::new(), of_material: vec![0; scene.materials().len()] };
        for name in names {
            if tags.names.iter().any(|known| known == name) {
                continue;
            }
            if tags.names.len() == Self::MOST {
                return Err(TagError::TooMany);
            }
            tags.names.push(name.to_owned());
            let mut found = false;
            for (tag, material) in tags.of_material.iter_mut().zip(scene.materials()) {
                if material.name == name {
                    *tag = tags.names.len() as u8;
                    found = true;
                }
            }
            if !found {
                return Err(TagError::Unknown(one_line(name)));
            }
        }
        Ok(tags)
    }

    /// Every symbol that a path may have.
    pub(super) fn symbols(&self) -> impl Iterator<Item = u8> {
        0..LETTERS * (self.names.len() as u8 + 1)
    }

    /// Whether a symbol is of one of these letters, and of that name if there is one.
    pub(super) fn is(&self, symbol: u8, letters: Letters, name: Option<&str>) -> bool {
        let (tag, letter) = (symbol / LETTERS, symbol % LETTERS);
        let named = name.is_none_or(|name| tag > 0 && self.names[usize::from(tag) - 1] == name);
        letters.0 >> letter & 1 == 1 && named
    }

    /// Writes the symbols of a path, camera first, and returns how many they are.
    ///
    /// # Panics
    /// If the path has more vertices than `symbols` has room for.
    pub(super) fn spell(&self, scene: &Scene, path: &JoinedPath, symbols: &mut [u8]) -> usize {
        let n = path.edges() as usize;
        symbols[0] = Letter::Camera as u8;
        for i in 1..n as u32 {
            let letter = Letter::of_event(path.event(i), path.transmits(i));
            symbols[i as usize] = self.symbol(letter, path.point(i));
        }
        let end = path.point(n as u32);
        let light = end.light.map_or(Letter::Surface, |id| Letter::of_light(scene.lights().get(id)));
        symbols[n] = self.symbol(light, end);
        n + 1
    }

    fn symbol(&self, letter: Letter, point: &Point) -> u8 {
        // A place without a surface has no material.
        let tag = self.of_material.get(point.material.0 as usize).copied().unwrap_or(0);
        letter as u8 + LETTERS * tag
    }
}
