//! Where subpaths merge, in a table whose subpaths do.

use crate::lanes::Mask;

/// At which vertices of a path its subpaths may merge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeetingPlaces {
    /// At all that pass no delta lobe.
    #[default]
    Everywhere,
    /// At the first of them, if the camera sees it by specular vertices alone, of light that has been scattered: where
    /// neither next-event estimation nor a ray to the lens finds it.
    SeenBySpecular,
}

impl MeetingPlaces {
    /// Whether subpaths may merge at a vertex; `is_seen` is [`is_seen_by_specular`].
    ///
    /// [`is_seen_by_specular`]: super::Densities::is_seen_by_specular
    #[inline(always)]
    pub fn admit<M: Mask>(self, is_seen: M, is_delta: M) -> M {
        !is_delta & self.admit_seen(is_seen)
    }

    /// The same, of a vertex that passes no delta lobe.
    #[inline(always)]
    pub fn admit_seen<M: Mask>(self, is_seen: M) -> M {
        match self {
            Self::Everywhere => is_seen | !is_seen, // all lanes
            Self::SeenBySpecular => is_seen,
        }
    }

    /// The fewest vertices of a camera subpath that merges with its last.
    #[inline(always)]
    pub fn fewest_camera_vertices(self) -> u32 {
        match self {
            Self::Everywhere => 2,
            Self::SeenBySpecular => 3,
        }
    }

    /// The same of a light subpath.
    #[inline(always)]
    pub fn fewest_light_vertices(self) -> u32 {
        match self {
            Self::Everywhere => 2,
            Self::SeenBySpecular => 3,
        }
    }
}
